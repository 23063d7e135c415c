"""What the renderer's tests share: one renderer a process, and a small world to draw."""

from __future__ import annotations

from collections.abc import Iterator
from pathlib import Path

import pytest

from renderer.pipeline import Renderer
from renderer.scene.images import ImageLibrary, image_library
from tests.renderer.drawing import shared_renderer
from tests.renderer.techniques import telling_worlds
from tests.renderer.world import registered


@pytest.fixture(scope="session")
def renderer() -> Renderer:
    """The renderer of this process, for all tests."""
    return shared_renderer()


@pytest.fixture(scope="module")
def world() -> Iterator[None]:
    """The small scene ``test`` stands in the catalogue."""
    with registered():
        yield


@pytest.fixture
def images(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> ImageLibrary:
    """This user's library of images, empty."""
    monkeypatch.setenv("MILLPOND_CACHE", str(tmp_path / "cache"))
    return image_library()


@pytest.fixture(scope="module")
def telling() -> Iterator[None]:
    """The worlds that tell much stand in the catalogue: the pillar, the markers, the moved and mirrored ones."""
    with telling_worlds():
        yield
