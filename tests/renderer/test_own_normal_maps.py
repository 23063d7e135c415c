"""A user's own normal map in every technique that has one."""

from __future__ import annotations

from typing import Any

import numpy as np
import pytest

from renderer.errors import InvalidRequest, MissingImage
from renderer.scene.images import ImageLibrary
from renderer.water.catalogue import TECHNIQUES
from tests.renderer.drawing import asked, furthest, mask, picture
from tests.renderer.making_images import even, file_of

pytestmark = pytest.mark.usefixtures("world")

TAKING = sorted(name for name, technique in TECHNIQUES.items() if "normal_map" in technique.model_fields)
FLAT: dict[str, dict[str, Any]] = {
    "luna": {"ripple_height": 0.0},
    "lake": {"wave_height": 0.0, "spec_alpha": 0.0},
    "lake_edges": {"wave_height": 0.0, "spec_alpha": 0.0},
    "tut29": {"normal_map": "flat"},
}
"""How each technique is flat."""
UNLIT: dict[str, dict[str, Any]] = {"lake": {"spec_alpha": 0.0}, "lake_edges": {"spec_alpha": 0.0}}


def test_every_document_takes_one() -> None:
    assert sorted(FLAT) == TAKING


@pytest.mark.parametrize("technique", TAKING)
def test_a_map_painted_flat_is_flat_water(technique: str, images: ImageLibrary) -> None:
    flat = images.put(file_of(even(128, 128, 255)), "normal_map").id
    own = picture(water={"technique": technique, **UNLIT.get(technique, {}), "normal_map": flat})

    assert furthest(own, picture(water={"technique": technique, **FLAT[technique]})) == 0


@pytest.mark.parametrize("technique", TAKING)
def test_one_tilt_is_seen_and_goes_the_way_it_points(technique: str, images: ImageLibrary) -> None:
    east, west = (images.put(file_of(even(128 + tilt, 128, 240)), "normal_map").id for tilt in (40, -40))
    first, second = (picture(water={"technique": technique, "normal_map": name}) for name in (east, west))
    region = mask(water={"technique": technique, "normal_map": east})

    assert furthest(first, second, region) > 5
    assert np.array_equal(first[~region], second[~region])


@pytest.mark.usefixtures("images")
@pytest.mark.parametrize("technique", TAKING)
def test_an_image_that_is_not_there_is_told(technique: str) -> None:
    with pytest.raises(MissingImage):
        picture(water={"technique": technique, "normal_map": "0" * 64})
    with pytest.raises(InvalidRequest) as refused:
        asked(water={"technique": technique, "normal_map": "mine"})
    assert refused.value.problems[0].path == "water.normal_map"
