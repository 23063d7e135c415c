"""The plotted weights are what the shaders compute, and real water is what the tables say."""

from __future__ import annotations

from pathlib import Path

import numpy as np
import pytest

from tests.golden.curves import ANGLE, ANGLES, CURVES, WEIGHT, draw, lines_of, luna, real_water, reflection_weight
from tests.golden.plot import Line, read_lines
from tests.reference.fresnel import luna_reflection_weight

FOLDER = Path(__file__).resolve().parents[2] / "docs" / "pictures"


@pytest.mark.parametrize("name", CURVES)
def test_a_chart_shows_what_the_shaders_compute(name: str, is_blessing: bool) -> None:
    curves, path = CURVES[name], FOLDER / f"{name}.svg"
    if not curves.is_drawable:
        pytest.skip(f"{name}: a technique is not in the catalogue")
    lines = lines_of(curves)
    if is_blessing:
        path.write_text(draw(curves, lines), encoding="utf-8")
    text = path.read_text(encoding="utf-8")
    plotted = read_lines(text, ANGLE, WEIGHT)

    assert len(plotted) == len(lines)
    for line, (places, values) in zip(lines, plotted, strict=True):
        assert f">{line.text}</text>" in text
        assert np.abs(places - ANGLES).max() < 0.02
        assert np.abs(values - line.values).max() < 2e-3


@pytest.mark.parametrize(("bias", "power"), [(0.0, 1.0), (-0.3, 1.0), (0.1, 2.0)])
def test_a_weight_that_is_read_from_a_picture_is_the_formula(bias: float, power: float) -> None:
    expected = luna_reflection_weight(np.cos(np.radians(ANGLES)), bias, power)

    assert np.abs(reflection_weight(luna(bias, power)) - expected).max() < 2e-3


def test_real_water_reflects_what_its_index_says() -> None:
    angles = np.array([0.0, 30.0, 45.0, 60.0, 75.0, 85.0, 90.0])

    assert np.abs(real_water(angles) - [0.0204, 0.0214, 0.0279, 0.0597, 0.2124, 0.5835, 1.0]).max() < 6e-5


def test_a_chart_of_other_values_is_told_apart() -> None:
    curves = CURVES["curves-luna-simple"]
    lines = [Line("a", ANGLES / 90), Line("b", 1 - ANGLES / 90)]
    (_, first), (_, second) = read_lines(draw(curves, lines), ANGLE, WEIGHT)

    assert np.abs(first - lines[0].values).max() < 1e-3
    assert np.abs(second - lines[0].values).max() > 0.9
