"""Frames look as they did when they were last looked at.

The README's views, small; every technique in every scene; and the tests' own world.
"""

from __future__ import annotations

import os
from typing import Any

import pytest

from renderer.request import FrameRequest
from renderer.scene.catalogue import SCENES
from renderer.water.catalogue import TECHNIQUES
from tests.golden.comparing import FRAMES, PINNED, bless, compare, decide, forget, golden, read, report
from tests.golden.pictures import PICTURES
from tests.renderer.drawing import shared_renderer
from tests.renderer.world import NAME, registered

SMALL: dict[str, Any] = {"width": 480, "height": 270, "msaa": 4}
WORLD: dict[str, dict[str, Any]] = {
    "test-world": {"scene": NAME, "time": 1.5},
    "test-world-below": {
        "scene": NAME,
        "camera": {"eye": [3.0, -0.6, 4.0], "target": [0.0, 0.2, 0.0], "fov_y": 70},
        "fog": {"color": [0.1, 0.3, 0.25], "density": 0.08},
    },
}
EVERYWHERE: dict[str, dict[str, Any]] = {
    f"{technique}-in-{scene}": {"scene": scene, "water": technique, "time": 2.0, "width": 640, "height": 360}
    for scene in SCENES
    for technique in TECHNIQUES
}
CASES: dict[str, dict[str, Any]] = {
    **WORLD,
    **EVERYWHERE,
    **{name: picture.request for name, picture in PICTURES.items()},
}


@pytest.mark.golden
@pytest.mark.parametrize("name", CASES)
def test_a_frame_looks_as_it_did(name: str, is_blessing: bool) -> None:
    renderer = shared_renderer()
    with registered():
        request = FrameRequest.parse({**SMALL, **CASES[name]})
        frame = renderer.render(request)
        canonical = request.canonical()
    if is_blessing:
        bless(name, frame.color, canonical)
        forget(name)
        return
    has_golden = golden(name).is_file()
    verdict = decide(is_pinned=PINNED in frame.renderer, has_golden=has_golden, is_ci=os.environ.get("CI") == "true")
    if verdict != "compare":
        lack = (
            f"golden pictures hold on {PINNED}, this is {frame.renderer}"
            if has_golden
            else "nobody blessed it: `make bless`"
        )
        (pytest.fail if verdict == "fail" else pytest.skip)(f"{name} was drawn, not compared: {lack}")

    expected = read(golden(name))
    difference = compare(name, expected, frame.color, f"request {canonical.decode()}", frame.renderer)
    if not difference.is_tolerable:
        page = report(difference, expected, frame.color)
        pytest.fail(f"{difference}, on {frame.renderer}. Look at {page}, then mend it or `make bless`.")
    forget(name)


def test_no_golden_picture_lies_about_unused() -> None:
    assert {path.stem for path in FRAMES.glob("*")} <= set(CASES)
