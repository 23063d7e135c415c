"""Ways to draw the maps otherwise than Luna does, so that a check can be seen to fail."""

from __future__ import annotations

from dataclasses import replace
from typing import Any, Literal

import pytest

from renderer.passes import mapping
from renderer.water.luna import Luna
from renderer.water.technique import MapSpec

Kind = Literal["mirror", "look_at", "yaw_only", "direct"]
REFLECTION = MapSpec(camera="mirror", clip="above", clear=(1.0, 1.0, 1.0, 0.0))


def change_reflection(monkeypatch: pytest.MonkeyPatch, **changes: Any) -> None:
    """Let Luna say something else of its reflection map."""
    specs = {"reflection": replace(REFLECTION, **changes), "refraction": MapSpec(camera="direct")}
    monkeypatch.setattr(Luna, "maps", lambda _: specs)


def shift_mirror(monkeypatch: pytest.MonkeyPatch, rise: float) -> None:
    """Mirror about a plane that lies higher than the water."""
    monkeypatch.setitem(mapping.MAP_CAMERAS, "mirror", lambda camera, level: camera.mirrored(level + rise))
