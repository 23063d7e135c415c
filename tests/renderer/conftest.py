"""What the renderer's tests share: one renderer a process, and a small world to draw."""

from __future__ import annotations

from collections.abc import Iterator

import pytest

from renderer.pipeline import Renderer
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


@pytest.fixture(scope="module")
def telling() -> Iterator[None]:
    """The worlds that tell much stand in the catalogue: the pillar, the markers, the moved and mirrored ones."""
    with telling_worlds():
        yield
