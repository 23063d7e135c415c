"""The functions of `lib/lake.glsl` against their twins. Rows of Habib 2009 by their numbers."""

from __future__ import annotations

import numpy as np
import pytest
from numpy.typing import NDArray

from tests.reference import lake
from tests.shaders.calling import call

MODES = {0: "lake_fresnel_projected(c)", 1: "lake_fresnel_power(c)", 2: "lake_fresnel_inverse(c)"}
ANGLES = [0, 30, 45, 60, 75, 80, 85, 89, 90]
# Read off the formulae at those angles, four places.
TABLE = {
    0: [0, 0, 0.0808, 0.3500, 0.6635, 0.7743, 0.8867, 0.9773, 1],
    1: [0.0200, 0.0200, 0.0221, 0.0503, 0.2370, 0.3938, 0.6348, 0.9083, 0.9900],
    2: [0.0312, 0.0442, 0.0690, 0.1317, 0.3164, 0.4491, 0.6585, 0.9171, 1],
}


def shader(expression: str, result: str = "float", **arguments: object) -> NDArray[np.floating]:
    return call("lib/lake.glsl", expression, result, **arguments)  # type: ignore[arg-type]


def directions(count: int, seed: int) -> NDArray[np.float64]:
    """Random unit vectors that point upwards, in the y-up world."""
    v = lake.unit(np.random.default_rng(seed).normal(size=(count, 3)))
    v[:, 1] = np.abs(v[:, 1])
    return v


@pytest.mark.parametrize("mode", MODES)
def test_each_fresnel_mode_is_its_formula(mode: int) -> None:
    cosine = np.linspace(0, 1, 4001)

    assert np.abs(shader(MODES[mode], c=cosine) - lake.fresnel(mode, cosine)).max() < 1e-5


@pytest.mark.parametrize("mode", MODES)
def test_the_weights_have_the_values_of_the_table(mode: int) -> None:
    cosine = np.cos(np.radians(ANGLES))
    weight = shader(f"lake_reflection_weight({MODES[mode]}, 1.0)", c=cosine)

    assert np.abs(weight - TABLE[mode]).max() < 7e-5


def test_the_first_mode_reflects_nothing_below_40_degrees_and_the_second_tops_at_99_hundredths() -> None:
    steep = np.cos(np.radians([0, 20, 39.7]))
    first = shader("lake_reflection_weight(lake_fresnel_projected(c), 1.0)", c=steep)

    assert (first == 0).all()
    assert shader("lake_reflection_weight(lake_fresnel_projected(c), 1.0)", c=np.cos(np.radians([39.74]))) > 0
    assert shader(MODES[1], c=np.array([0.0])) == pytest.approx(0.99)
    assert shader(MODES[2], c=np.array([1.0])) == pytest.approx(1 / 32)


@pytest.mark.parametrize("mode", MODES)
@pytest.mark.parametrize("draw_mode", [0.0, 0.5, 1.0, 2.0, 100.0])
def test_hardness_multiplies_before_the_cut(mode: int, draw_mode: float) -> None:
    cosine = np.linspace(0, 1, 1001)
    weight = shader(f"lake_reflection_weight({MODES[mode]}, d)", c=cosine, d=draw_mode)
    early = np.clip(lake.fresnel(mode, cosine), 0, 1) * draw_mode

    assert np.abs(weight - lake.weight(mode, cosine, draw_mode)).max() < 2e-5 * max(draw_mode, 1)
    assert draw_mode <= 1 or np.abs(early - weight).max() > 0.9, "a cut before the factor must be told apart"


def test_waves_shift_by_half_the_wave_height_times_the_normal() -> None:
    n = directions(500, 1)
    shift = shader("lake_perturbation(n, h)", "vec2", n=n, h=0.07)

    assert np.abs(shift - lake.perturbation(lake.in_document(n), 0.07)).max() < 1e-8
    assert shader("lake_perturbation(n, 0.07)", "vec2", n=[[1.0, 0.0, 0.0]])[0] == pytest.approx([0.035, 0])


def test_a_flat_bump_shifts_by_exactly_nothing() -> None:
    assert (shader("lake_perturbation(n, 2.0)", "vec2", n=[[0.0, 1.0, 0.0]]) == 0).all()


def test_a_shift_downwards_in_the_document_is_downwards_here() -> None:
    moved = shader("lake_moved(p, s)", "vec2", p=[[0.5, 0.5]], s=[[0.1, 0.2]])

    assert moved[0] == pytest.approx([0.6, 0.3])


@pytest.mark.parametrize("degrees", [0.0, 33.0, 90.0, -120.0, 360.0])
def test_the_bump_map_is_turned_divided_and_then_moved(degrees: float) -> None:
    plane = np.random.default_rng(2).uniform(size=(300, 2))
    a = np.radians(degrees)
    offset = [0.0, 2.5 * 1000 / 100000 * 20]
    place = shader("lake_bump_place(p, t, l, o)", "vec2", p=plane, t=[[np.cos(a), np.sin(a)]], l=0.3, o=[offset])

    assert np.abs(place - lake.bump_place(plane, degrees, 0.3, 2500.0, 20.0)).max() < 1e-5


@pytest.mark.parametrize(("perturb", "power"), [(0.0, 364.0), (4.0, 364.0), (40.0, 60.0), (2.0, 1.0)])
def test_the_highlight_is_the_power_of_the_bent_half_vector(perturb: float, power: float) -> None:
    view, light, n = directions(800, 3), directions(800, 4), directions(800, 5)
    view[:200] = light[:200] * [-1, 1, -1] + 0.02 * view[:200]  # near the mirrored light, where there is something
    view = lake.unit(view)
    shift = lake.perturbation(lake.in_document(n), 0.07)
    t = shader("lake_highlight(v, l, vec3(0.0, 1.0, 0.0), s, k, p)", v=view, l=light, s=shift, k=perturb, p=power)
    expected = lake.highlight(lake.in_document(view), shift, perturb, power, lake.in_document(light))

    assert expected.max() > 0.3
    assert np.abs(t - expected).max() < 1e-4


def test_no_eye_and_no_light_makes_the_highlight_less_than_nothing() -> None:
    rng = np.random.default_rng(6)
    view, light, up = (lake.unit(rng.normal(size=(2000, 3))) for _ in range(3))
    t = shader("lake_highlight(v, l, u, s, 40.0, 3.0)", v=view, l=light, u=up, s=rng.normal(size=(2000, 2)))

    assert np.isfinite(t).all()
    assert t.min() == 0
    assert (t[(light * up).sum(axis=1) < 0] == 0).all()


def test_the_power_of_a_negative_cosine_is_no_number() -> None:
    """Why the highlight guards its base: the formula as it stands is undefined behind the water."""
    raised = shader("pow(c, 364.5)", c=np.array([-0.5]))

    assert not np.isfinite(raised).any() or not 0 <= raised[0] <= 1
