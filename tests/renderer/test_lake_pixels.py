"""A thousand pixels of each lake technique, evaluated outside the shader from what the shader read."""

from __future__ import annotations

from typing import Any

import numpy as np
import pytest
from numpy.typing import NDArray

from renderer.scene.material import Texture
from tests.reference import lake, normals, projection, tonemap
from tests.reference.sampling import Sampler
from tests.renderer.drawing import STEEP, broken_shaders, mask
from tests.renderer.dumping import Dump, dumped, points
from tests.renderer.world import EXTENTS

pytestmark = pytest.mark.usefixtures("world")

Floats = NDArray[np.float64]
COUNT = 1000
TIME = 2.75
WATER: dict[str, Any] = {
    "wave_length": 0.6,
    "wave_height": 0.15,
    "wind_force": 7.0,
    "wind_direction": 33.0,
    "draw_mode": 1.3,
    "spec_power": 40.0,
    "spec_perturb": 30.0,
    "dull_blend_factor": 0.7,
}
SLOPES = np.random.default_rng(9).normal(scale=0.2, size=(32, 32, 2)).astype(np.float16).astype(np.float32)
"""A bump map so coarse that no pixel reads it smaller than it is; half floats, as textures are stored."""


@pytest.fixture(autouse=True)
def coarse_bumps(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr("renderer.water.lake_waves.ripple_slopes", lambda _: Texture("coarse bumps", SLOPES))


def displayed(held: Floats, *, is_encoded: bool) -> Floats:
    return held if is_encoded else tonemap.srgb(np.clip(held, 0, 1))


def held(color: tuple[float, ...], *, is_encoded: bool) -> Floats:
    """A displayed colour as the maps hold it (IEC 61966-2-1, section 5.2)."""
    c = np.array(color)
    return c if is_encoded else np.where(c <= 0.04045, c / 12.92, ((c + 0.055) / 1.055) ** 2.4)


def shift_of(place: Floats, water: dict[str, Any]) -> Floats:
    """The waves' shift at points of the water, in the documents' texture coordinates."""
    x0, x1, z0, z1 = EXTENTS
    plane = (place[:, [0, 2]] - [x0, z0]) / [x1 - x0, z1 - z0]
    read = lake.bump_place(plane, water["wind_direction"], water["wave_length"], 1000 * TIME, water["wind_force"])
    bumps = Sampler(SLOPES.astype(np.float64), "mirror" if water["as_published"] else "repeat")
    return lake.perturbation(lake.in_document(normals.of_slope(bumps.read(read))), water["wave_height"])


def read_map(dump: Dump, name: str, place: Floats, shift: Floats) -> Floats:
    """A map at points of the water, by its own projection, shifted; v downwards."""
    clip = np.c_[place, np.ones(len(place))] @ dump.projections[name].T
    u, v = projection.map_place(clip).T
    return Sampler(dump.maps[name]).read(np.stack([u, 1 - v], axis=-1) + shift)


def shaded(pixels: NDArray[np.int_], dump: Dump, water: dict[str, Any]) -> Floats:
    """What the documents' formulae make of these pixels, as displayed, 0..255."""
    is_encoded, is_edges = water["as_published"], water["technique"] == "lake_edges"
    place, eye = points(pixels, camera=STEEP, water=water)
    shift = shift_of(place, water)
    reflected, refracted = (read_map(dump, name, place, shift) for name in ("reflection", "refraction"))
    if not is_encoded and not is_edges:
        leaks = refracted[:, 3:] < 0.5
        still = [read_map(dump, name, place, 0 * shift) for name in ("reflection", "refraction")]
        reflected = np.where(leaks & (still[1][:, 3:] >= 0.5), still[0], reflected)
        refracted = np.where(leaks, still[1], refracted)
    share = lake.weight(water["fresnel_mode"], eye[:, 1], water["draw_mode"], has_third=not is_edges)
    combined = lake.blended(refracted[:, :3], reflected[:, :3], share)
    t = lake.highlight(lake.in_document(eye), shift, water["spec_perturb"], water["spec_power"], lake.LIGHT)
    color = np.r_[held(lake.HIGHLIGHT[:3], is_encoded=is_encoded), lake.HIGHLIGHT[3]]
    glint = lake.added(t, color)
    if not is_edges:
        result = lake.dulled(combined, water["dull_blend_factor"], held(lake.DULL, is_encoded=is_encoded)) + glint
    else:
        valid = [lake.is_valid(displayed(m[:, :3], is_encoded=is_encoded)) for m in (reflected, refracted)]
        if not is_encoded:
            valid += [reflected[:, 3] <= 0.01, refracted[:, 3] >= 0.99]
        rgba = lake.tinted(combined, np.all(valid, axis=0), water["dull_blend_factor"])
        behind = dump.behind[pixels[:, 0], pixels[:, 1], :3]
        source, alpha = rgba[:, :3] + glint, rgba[:, 3]
        result = over_bytes(source, alpha, behind) if is_encoded else lake.over(source, alpha, behind)
    return 255 * displayed(np.clip(result, 0, 1), is_encoded=is_encoded)


def over_bytes(color: Floats, alpha: Floats, behind: Floats) -> Floats:
    """The blend where colours and alpha are bytes: each of them and both products are rounded."""
    source, opaque = (np.rint(255 * np.minimum(c, 1)) / 255 for c in (color, alpha))
    products = lake.over(source, opaque, 0 * behind), lake.over(0 * source, opaque, behind)
    return np.asarray(sum(np.rint(255 * product) / 255 for product in products))


def errors(water: dict[str, Any]) -> Floats:
    """How far each of a thousand random pixels is from its formulae, in steps of 255."""
    frame, dump = dumped(camera=STEEP, water=water, time=TIME)
    wet = np.argwhere(mask(camera=STEEP, water=water, time=TIME))
    pixels = wet[np.random.default_rng(4).choice(len(wet), COUNT, replace=False)]
    shown = frame.color[pixels[:, 0], pixels[:, 1]]
    return np.asarray(np.abs(shown - shaded(pixels, dump, water)).max(axis=-1))


def asked_water(technique: str, mode: int, *, as_published: bool) -> dict[str, Any]:
    return {**WATER, "technique": technique, "fresnel_mode": mode, "as_published": as_published}


@pytest.mark.parametrize("as_published", [False, True])
@pytest.mark.parametrize("mode", [0, 1, 2])
@pytest.mark.parametrize("technique", ["lake", "lake_edges"])
def test_a_thousand_pixels_are_what_the_formulae_make_of_the_maps(
    technique: str, mode: int, as_published: bool
) -> None:
    assert errors(asked_water(technique, mode, as_published=as_published)).max() <= 1.0 + 1e-9


@pytest.mark.parametrize(
    ("technique", "change"),
    [
        ("lake", ("lib/lake.glsl", "1.0 - 1.3 * NoV", "1.0 - NoV")),
        ("lake", ("lib/lake.glsl", "vec2(n.x, -n.z)", "vec2(n.x, n.z)")),
        ("lake", ("lib/lake.glsl", "wave_height * 0.5 *", "wave_height *")),
        ("lake", ("lib/lake.glsl", "plane_place.x * turn.y +", "-plane_place.x * turn.y +")),
        ("lake", ("water/lake.glsl", "lake.spec_alpha * t * t", "lake.spec_alpha * t")),
        ("lake", ("water/lake.glsl", "vec3 radiance = dulled +", "vec3 radiance = (1.0 - lake.dull_blend_factor) *")),
        ("lake", ("passes/water.frag", "- position_world * view.eye.w", "- (position_world - vec3(0, 0.25, 0))")),
        ("lake_edges", ("water/lake_edges.glsl", "float opacity = lake_edges.dull_blend_factor *", "float opacity =")),
        ("lake_edges", ("water/lake_edges.glsl", " * map_validity(refracted, 0.0)", "")),
    ],
)
def test_another_formula_fails(technique: str, change: tuple[str, str, str]) -> None:
    file, old, new = change
    water = asked_water(technique, 0, as_published=True)
    with broken_shaders({file: (old, new)}):
        assert errors(water).max() > 2
