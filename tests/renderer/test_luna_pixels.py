"""A thousand pixels of Luna's water, evaluated outside the shader from what the shader read."""

from __future__ import annotations

from typing import Any

import numpy as np
import pytest
from numpy.typing import NDArray

from renderer.scene.material import Texture
from tests.reference import luna, normals, projection, tonemap
from tests.reference.sampling import Sampler
from tests.renderer.drawing import broken_shaders, mask
from tests.renderer.dumping import Dump, dumped, points

pytestmark = pytest.mark.usefixtures("world")

Floats = NDArray[np.float64]
COUNT = 1000
CAMERA: dict[str, Any] = {"eye": [1.0, 7.0, 6.0], "target": [0.5, 0.0, 0.8], "fov_y": 62}
"""Water down to the picture's bottom, where the shift fades."""
TIME = 2.75
SUN = np.array([0.3, 0.8, 0.5])
WATER: dict[str, Any] = {
    "ripple_scale": [0.05, 0.08],
    "refraction_bias": -0.15,
    "refraction_power": 1.7,
    "tile_0": 23.0,
    "tile_1": 17.0,
    "velocity_0": [0.04, -0.02],
    "velocity_1": [-0.03, 0.05],
    "ripple_height": 0.8,
    "material_ambient": [0.5, 0.45, 0.4],
    "material_diffuse": [0.6, 0.7, 0.8],
    "material_specular": [0.5, 0.6, 0.7],
    "light_ambient": [0.7, 0.8, 0.9],
    "light_diffuse": [0.5, 0.4, 0.3],
    "light_specular": [0.6, 0.5, 0.4],
    "specular_power": 12.0,
}
SLOPES = [
    np.random.default_rng(seed).normal(scale=0.15, size=(32, 32, 2)).astype(np.float16).astype(np.float32)
    for seed in (5, 6)
]
"""Normal maps so coarse that no pixel reads them smaller than they are; half floats, as textures are stored."""


@pytest.fixture(autouse=True)
def coarse_ripples(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(
        "renderer.water.luna.ripple_slopes", lambda number: Texture(f"coarse ripples {number}", SLOPES[number % 2])
    )


def product(name: str) -> Floats:
    return np.asarray(np.array(WATER[f"material_{name}"]) * np.array(WATER[f"light_{name}"]))


def rippled_normal(place: Floats) -> Floats:
    """The mean of the two scrolled normals at points of the water."""
    slopes = [
        WATER["ripple_height"]
        * Sampler(SLOPES[i].astype(np.float64), "repeat").read(
            place[:, [0, 2]] / WATER[f"tile_{i}"] + TIME * np.array(WATER[f"velocity_{i}"])
        )
        for i in range(2)
    ]
    return normals.mean_of_two(*slopes)


def read_map(dump: Dump, name: str, place: Floats, normal: Floats | None) -> Floats:
    """A map at points of the water, by its own projection; moved by the ripples where a normal is given."""
    u, v = projection.map_place(np.c_[place, np.ones(len(place))] @ dump.projections[name].T).T
    at = np.stack([u, 1 - v], axis=-1)
    moved = at if normal is None else luna.shifted(at, normal, WATER["ripple_scale"])
    return Sampler(dump.maps[name], "clamp").read(moved)


def shaded(pixels: NDArray[np.int_], dump: Dump, *, as_published: bool) -> tuple[Floats, NDArray[np.bool_]]:
    """What the document's formulae make of these pixels, as displayed, 0..255; and where a map's edge lies too near.

    There the last digit decides on which side of it a pixel is.
    """
    place, eye = points(pixels, camera=CAMERA)
    n = rippled_normal(place)
    reflected, refracted = (read_map(dump, name, place, n) for name in ("reflection", "refraction"))
    edge = np.zeros(len(pixels), bool)
    if not as_published:
        leaks = refracted[:, 3] < 0.5
        edge = np.abs(refracted[:, 3] - 0.5) < 0.05
        reflected = np.where(leaks[:, None], read_map(dump, "reflection", place, None), reflected)
        refracted = np.where(leaks[:, None], read_map(dump, "refraction", place, None), refracted)
    share = luna.weight(n, eye, WATER["refraction_bias"], WATER["refraction_power"])
    result = luna.lit(
        luna.blended(reflected[:, :3], refracted[:, :3], share),
        n,
        eye,
        SUN / np.linalg.norm(SUN),
        ambient=product("ambient"),
        diffuse=product("diffuse"),
        specular=product("specular"),
        power=WATER["specular_power"],
    )
    clipped = np.clip(result, 0, 1)
    return 255 * (clipped if as_published else tonemap.srgb(clipped)), edge


def errors(*, as_published: bool) -> Floats:
    """How far each of a thousand random pixels is from its formulae, in steps of 255."""
    water = {**WATER, "as_published": as_published}
    fields: dict[str, Any] = {"camera": CAMERA, "time": TIME, "sun": {"direction": SUN.tolist(), "shadows": False}}
    frame, dump = dumped(**fields, water=water)
    wet = np.argwhere(mask(**fields, water=water))
    pixels = wet[np.random.default_rng(4).choice(len(wet), COUNT, replace=False)]
    expected, edge = shaded(pixels, dump, as_published=as_published)
    assert edge.mean() < 0.02
    return np.asarray(np.abs(frame.color[pixels[:, 0], pixels[:, 1]] - expected).max(axis=-1)[~edge])


@pytest.mark.parametrize("as_published", [False, True])
def test_a_thousand_pixels_are_what_the_formulae_make_of_the_maps(as_published: bool) -> None:
    assert errors(as_published=as_published).max() <= 1.0


BROKEN = [
    ("water/luna.glsl", "place.y - shift.y", "place.y + shift.y"),
    ("water/luna.glsl", "shift.y *= bottom_damping(1.0 - place.y);", "shift.y *= bottom_damping(place.y);"),
    ("water/luna.glsl", "mix(reflected, refracted.rgb, weight)", "mix(refracted.rgb, reflected, weight)"),
    ("lib/fresnel.glsl", "bias + pow(max(NoV, 0.0), power), 0.0", "pow(max(NoV + bias, 0.0), power), 0.0"),
    ("water/luna.glsl", "luna.light_diffuse * (sun * NoL)", "luna.light_diffuse * sun"),
]
"""File, what it says, and what it must not say."""


@pytest.mark.parametrize(("file", "said", "broken"), BROKEN)
def test_a_shader_that_does_otherwise_is_noticed(file: str, said: str, broken: str) -> None:
    with broken_shaders({file: (said, broken)}):
        assert errors(as_published=False).max() > 2.0
