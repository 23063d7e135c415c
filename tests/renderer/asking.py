"""Requests that Hypothesis draws: every field, every form, many values."""

from __future__ import annotations

from typing import Any

import numpy as np
from hypothesis import strategies as st

from renderer.camera import pose, rotation_from_angles
from renderer.request import LAYERS
from renderer.water.catalogue import TECHNIQUES

Fields = dict[str, Any]


def number(low: float, high: float) -> st.SearchStrategy[float | int]:
    """A number between two bounds: a float, or as JSON may write it a whole one, negative zero included."""
    whole = st.integers(int(np.ceil(low)), int(np.floor(high)))
    return st.one_of(st.floats(low, high, allow_nan=False), whole)


def triple(low: float = -50, high: float = 50) -> st.SearchStrategy[list[float | int]]:
    return st.lists(number(low, high), min_size=3, max_size=3)


color = st.one_of(triple(0, 4), st.from_regex(r"\A#[0-9a-fA-F]{6}\Z"))
lens: st.SearchStrategy[Fields] = st.one_of(
    st.just({}),
    st.fixed_dictionaries({"fov_y": number(1, 170)}),
    st.fixed_dictionaries({"orthographic": st.fixed_dictionaries({"height": number(0.5, 50)})}),
    st.fixed_dictionaries(
        {"intrinsics": st.fixed_dictionaries({n: number(1, 2000) for n in ("fx", "fy", "cx", "cy")})}
    ),
)
depth = st.fixed_dictionaries({}, optional={"near": number(0.01, 1), "far": number(100, 5000)})


@st.composite
def matrices(draw: st.DrawFn) -> list[float]:
    turn = rotation_from_angles(*(draw(st.integers(-180, 180)) for _ in range(3)))
    return [float(v) for v in pose(turn, np.array(draw(triple()), np.float64)).flat]


@st.composite
def cameras(draw: st.DrawFn) -> Fields:
    form = draw(st.sampled_from(["eye", "position", "orbit", "matrix"]))
    if form == "eye":
        eye = draw(triple())
        away = draw(st.lists(number(1, 9), min_size=3, max_size=3))
        camera: Fields = {"eye": eye, "target": [e + a for e, a in zip(eye, away, strict=True)]}
        if draw(st.booleans()):
            camera["up"] = [0, 1, 0.25]
    elif form == "position":
        angles = {name: number(-180, 180) for name in ("yaw", "pitch", "roll")}
        camera = {"position": draw(triple()), **draw(st.fixed_dictionaries({}, optional=angles))}
    elif form == "orbit":
        place: Fields = {"target": triple(), "distance": number(0.5, 90)}
        angles = {"azimuth": number(-360, 360), "elevation": number(-90, 90)}
        camera = {"orbit": draw(st.fixed_dictionaries(place, optional=angles))}
    else:
        camera = {"matrix": draw(matrices())}
    return {**camera, **draw(lens), **draw(depth)}


light: Fields = {"color": color, "intensity": number(0, 9), "shadows": st.booleans()}
suns = st.one_of(
    st.none(),
    st.fixed_dictionaries({}, optional={**light, "azimuth": number(-360, 360), "elevation": number(-90, 90)}),
    st.fixed_dictionaries({"direction": triple(1, 9)}, optional=light),
)
skies = st.one_of(
    st.sampled_from(["constant", "gradient", "analytic"]),
    st.fixed_dictionaries({"model": st.just("constant")}, optional={"color": color}),
    st.fixed_dictionaries({"model": st.just("gradient")}, optional={"horizon": color, "zenith": color}),
    st.fixed_dictionaries(
        {"model": st.just("analytic")}, optional={"turbidity": number(1, 10), "clouds": number(0, 1)}
    ),
)
pair = st.lists(number(-2, 2), min_size=2, max_size=2)
waters = st.one_of(
    st.sampled_from(sorted(TECHNIQUES)),
    st.fixed_dictionaries(
        {},
        optional={
            "technique": st.just("luna"),
            "level": number(-2, 2),
            "extents": st.just([-10, 10.5, -8, 8]),
            "ripple_scale": pair,
            "refraction_bias": number(-1, 1),
            "refraction_power": number(0.5, 60),
            "velocity_0": pair,
            "material_diffuse": color,
            "specular_power": number(1, 500),
        },
    ),
)
fogs = st.one_of(
    st.none(),
    st.fixed_dictionaries({}, optional={"color": color, "density": number(0, 2), "height_falloff": number(0, 2)}),
)
tonemaps = st.one_of(
    st.sampled_from(["none", "reinhard", "aces", "agx"]),
    st.fixed_dictionaries({}, optional={"operator": st.sampled_from(["none", "agx"]), "exposure": number(-3, 3)}),
)
maps = st.one_of(st.none(), st.fixed_dictionaries({"time": number(0, 9), "camera": cameras()}))


def frames() -> st.SearchStrategy[Fields]:
    """A request as a caller may write it, as JSON would bring it."""
    return st.fixed_dictionaries(
        {},
        optional={
            "scene": st.just("pond"),
            "water": waters,
            "camera": cameras(),
            "time": number(-1e6, 1e6),
            "period": st.one_of(st.none(), number(0.1, 1e4)),
            "width": st.integers(1, 4000),
            "height": st.integers(1, 4000),
            "sun": suns,
            "ambient": color,
            "sky": skies,
            "fog": fogs,
            "msaa": st.sampled_from([1, 4]),
            "samples": st.integers(1, 64),
            "shutter": number(0, 1),
            "tonemap": tonemaps,
            "maps": maps,
            "layers": st.sampled_from([[layer] for layer in LAYERS]),
            "seed": st.integers(0, 2**31 - 1),
            "format": st.sampled_from(["png", "jpeg", "webp"]),
        },
    )


def noise(names: list[str]) -> st.SearchStrategy[Any]:
    """Anything that JSON or Python may bring, with the schema's own names among the keys."""
    leaves = st.one_of(
        st.none(),
        st.booleans(),
        st.integers(),
        st.floats(),
        st.text(max_size=6),
        st.sampled_from(["luna", "pond", "none", "gradient", "#ffffff", 10**400, -(10**30), 1e308, b"bytes"]),
        st.lists(st.floats(), min_size=2, max_size=4),
        st.lists(number(-3, 3), min_size=16, max_size=16),
    )
    keys = st.one_of(st.sampled_from(names), st.text(max_size=4), st.integers())
    return st.recursive(
        leaves,
        lambda inner: st.one_of(st.lists(inner, max_size=4), st.dictionaries(keys, inner, max_size=4)),
        max_leaves=12,
    )
