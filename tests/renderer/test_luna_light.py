"""How Luna's water is lit (row L12), and what may be asked of it (rows L1, L17, L18)."""

from __future__ import annotations

from typing import Any

import numpy as np
import pytest

from renderer.scene.images import ImageLibrary
from renderer.water.luna import Luna
from tests.reference import microfacet, normals, tonemap
from tests.renderer import making_images
from tests.renderer.drawing import (
    FLAT,
    GRAZING,
    PLAIN,
    STEEP,
    WINDOW,
    Floats,
    broken_shaders,
    drawn,
    furthest,
    linear,
    mask,
    picture,
    views,
)
from tests.renderer.world import DRY, EMPTY, LEVEL

pytestmark = pytest.mark.usefixtures("world")

OPEN = [-4000.0, 4000.0, -4000.0, 4000.0]


# ---------------------------------------------------------------------------------------------- L12: light and material

ZERO, ONE = [0.0] * 3, [1.0] * 3
BLACK: dict[str, Any] = {f"{a}_{b}": ZERO for a in ("material", "light") for b in ("ambient", "diffuse", "specular")}
SUN = {"direction": [0.3, 0.8, 0.5], "shadows": False}
HIGH = 0.8 / np.sqrt(0.98)
"""Sine of that sun's elevation: n.l of flat water."""


@pytest.mark.parametrize(
    ("light", "factor"),
    [
        ({"material_ambient": ONE, "light_ambient": [0.8, 0.4, 0.2]}, [0.8, 0.4, 0.2]),
        ({"material_ambient": [0.3, 0.6, 0.9], "light_ambient": ONE}, [0.3, 0.6, 0.9]),
        ({"material_diffuse": ONE, "light_diffuse": [0.9, 0.5, 0.1]}, [0.9 * HIGH, 0.5 * HIGH, 0.1 * HIGH]),
        ({"material_diffuse": [0.2, 0.4, 0.8], "light_diffuse": ONE}, [0.2 * HIGH, 0.4 * HIGH, 0.8 * HIGH]),
        ({"material_ambient": ONE, "light_diffuse": ONE}, ZERO),
        ({"material_diffuse": ONE, "light_ambient": ONE}, ZERO),
        (
            {
                "material_ambient": [0.5] * 3,
                "light_ambient": [0.4] * 3,
                "material_diffuse": [0.6] * 3,
                "light_diffuse": [0.7] * 3,
            },
            [0.2 + 0.42 * HIGH] * 3,
        ),
    ],
)
def test_each_light_times_its_material_lights_the_blend(light: dict[str, Any], factor: list[float]) -> None:
    water = {**FLAT, **BLACK, **light, "refraction_bias": 0.1}
    blend = linear(picture(water={**FLAT, "refraction_bias": 0.1}, sun=SUN))
    expected = 255 * tonemap.srgb(np.clip(blend * factor, 0, 1))
    shown = picture(water=water, sun=SUN)

    assert (np.abs(shown - expected)[mask()] <= 1.6).all()


def test_the_suns_own_brightness_does_not_dim_the_documents_light() -> None:
    water = {**WINDOW, **BLACK, "material_diffuse": ONE, "light_diffuse": ONE}
    dark = {**SUN, "intensity": 0.25}
    bright = linear(picture(scene=EMPTY, water=water, sun=SUN, sky="constant", camera=STEEP))
    dim = linear(picture(scene=EMPTY, water=water, sun=dark, sky="constant", camera=STEEP))

    assert np.abs(bright - dim).max() < 1e-6


def glint(direction: list[float], camera: dict[str, Any], power: float, **fields: Any) -> Floats:
    """The picture of the sun's glint alone, in linear light."""
    water = {**FLAT, **BLACK, "material_specular": [0.9, 0.6, 0.3], "light_specular": ONE, "specular_power": power}
    sun = {"direction": direction, "shadows": False}
    return linear(picture(scene=EMPTY, camera=camera, sun=sun, water={**water, "extents": OPEN}, **fields))


@pytest.mark.parametrize("power", [4.0, 60.0, 200.0])
def test_the_glint_is_phongs_lobe_about_the_mirrored_sun(power: float) -> None:
    direction = [-0.1, 0.8, -0.6]
    view = views(STEEP)
    up = np.broadcast_to([0.0, 1.0, 0.0], view.shape)
    lobe = microfacet.phong(up, np.broadcast_to(normals.unit(direction), view.shape), view, power)
    expected = 255 * tonemap.srgb(lobe[..., None] * [0.9, 0.6, 0.3])
    shown = 255 * tonemap.srgb(glint(direction, STEEP, power))

    assert expected.max() > 100
    assert np.abs(shown - expected).max() <= 1.0


@pytest.mark.parametrize("direction", [[-0.1, -0.01, -0.6], [-0.1, 0.0, -0.6], [0.0, -1.0, 0.0]])
def test_a_sun_below_the_water_has_no_glint_and_no_diffuse_light(direction: list[float]) -> None:
    water = {**WINDOW, **BLACK, "material_diffuse": ONE, "light_diffuse": ONE, "extents": OPEN}
    sun = {"direction": direction, "shadows": False}

    assert glint(direction, GRAZING, 1.0).max(where=(views(GRAZING)[..., 1] > 0)[..., None], initial=0) == 0
    assert picture(scene=EMPTY, camera=STEEP, sun=sun, water=water).max() == 0


def test_a_glint_from_behind_is_caught() -> None:
    guard = "NoL > 0.0 ? pow(max(dot(mirrored, v), 0.0), power) : 0.0"
    with broken_shaders({"lib/microfacet.glsl": (guard, "pow(abs(dot(mirrored, v)), power)")}):
        assert glint([-0.1, -0.01, -0.6], GRAZING, 1.0).max() > 0.1


def test_no_sun_is_neither_diffuse_light_nor_glint() -> None:
    water = {**WINDOW, **BLACK, "material_ambient": ONE, "light_ambient": ONE}
    lit = {**water, "material_diffuse": ONE, "light_diffuse": ONE, "material_specular": ONE, "light_specular": ONE}

    assert furthest(picture(water=water, sun=None), picture(water=lit, sun=None)) == 0
    assert furthest(picture(water=water, sun=SUN), picture(water=lit, sun=SUN)) > 50


# -------------------------------------------------------------------------------------- L1, L18: parameters and figures

OTHER: dict[str, Any] = {
    "level": LEVEL + 0.4,
    "extents": [-8.0, 8.0, -8.0, 8.0],
    "ripple_scale": [0.02, 0.09],
    "refraction_bias": -0.2,
    "refraction_power": 5.0,
    "tile_0": 7.0,
    "tile_1": 5.0,
    "velocity_0": [0.2, 0.1],
    "velocity_1": [0.1, -0.2],
    "ripple_height": 2.0,
    "material_ambient": [0.1, 0.5, 0.9],
    "material_diffuse": [0.3, 0.5, 0.9],
    "material_specular": [0.9, 0.1, 0.1],
    "specular_power": 20.0,
    "light_ambient": [0.2, 0.5, 0.9],
    "light_diffuse": [0.2, 0.5, 0.9],
    "light_specular": [0.1, 0.5, 0.9],
    "depth_fade": 1.0,
    "distance_fade": 0.2,
    "displacement": 4.0,
    "color_layers": [{"image": "silt", "opacity": 1.0}],
}
OWN_IMAGES = {"normal_map": 3, "bias_map": 1}
"""Parameters that name an uploaded image, and its channels."""


@pytest.mark.parametrize("name", sorted(set(Luna.model_fields) - {"technique", "as_published"}))
def test_every_parameter_changes_the_water_and_nothing_else(name: str, images: ImageLibrary) -> None:
    if name in OWN_IMAGES:
        pixels = making_images.painted(channels=OWN_IMAGES[name])
        pixels[..., -1] |= 160  # normals point up
        other = images.put(making_images.file_of(pixels.squeeze()), name).id
    else:
        other = OTHER[name]
    glittering = {"direction": [-5.0, 4.0, -8.0], "shadows": False}
    view = {**PLAIN, "sun": glittering, "time": 2.0}
    region = mask(time=2.0, water={name: other}) | mask(time=2.0)
    plain, changed = (picture(**view, water=water) for water in ({}, {name: other}))

    assert furthest(plain, changed, region) > 3
    assert furthest(plain, changed, ~region) == 0


def test_the_figures_of_the_document_can_be_asked_for() -> None:
    rippled, still = picture(), picture(water={"ripple_height": 0.0})
    water = mask()

    assert furthest(rippled, still, water) > 30
    assert furthest(rippled, still, ~water) == 0
    assert furthest(picture(layers=["refraction_map"]), picture(water={"extents": DRY})) == 0
    assert furthest(picture(layers=["reflection_map"]), picture(layers=["refraction_map"])) > 100
    assert drawn(**PLAIN, layers=["reflection_weight"]).color[water].max() > 100


def test_ripples_are_sown_by_the_seed() -> None:
    assert furthest(picture(seed=0), picture(seed=1), mask()) > 20
    assert furthest(picture(seed=0), picture(seed=1), ~mask()) == 0
