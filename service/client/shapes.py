"""Shapes of what goes to the service and comes from it, for type checkers and readers.

Nothing here is checked at run time: the service checks, and names every mistake by its path.
"""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from typing import Any, Literal, TypedDict

import numpy as np
from numpy.typing import NDArray

Vector = Sequence[float] | NDArray[np.floating[Any]] | NDArray[np.integer[Any]]
"""Three numbers: metres, or a linear RGB colour."""
Color = Vector | str
"""Linear RGB, or ``"#rrggbb"`` in sRGB."""

ImageKind = Literal["normal_map", "bias_map", "color_layer"]
"""What an uploaded image is for."""
ImageFormat = Literal["png", "jpeg", "webp"]
Product = Literal["zip", "mp4"]
JobState = Literal["queued", "running", "paused", "succeeded", "failed", "cancelled", "expired"]
ENDED: frozenset[str] = frozenset({"succeeded", "failed", "cancelled", "expired"})
"""States that nothing but a retry leaves."""
ACTIVE: frozenset[str] = frozenset({"queued", "running", "paused"})


class Orbit(TypedDict, total=False):
    """A camera on a sphere round its target; angles in degrees."""

    target: Vector
    distance: float
    azimuth: float
    elevation: float


class Intrinsics(TypedDict):
    """A pinhole camera in pixels."""

    fx: float
    fy: float
    cx: float
    cy: float


class Camera(TypedDict, total=False):
    """Where the picture is taken from: one of ``eye``, ``position``, ``orbit`` and ``matrix`` tells which form."""

    eye: Vector
    target: Vector
    up: Vector
    position: Vector
    yaw: float
    pitch: float
    roll: float
    orbit: Orbit
    matrix: Sequence[float] | NDArray[np.floating[Any]]
    """Camera to world, 16 numbers row by row."""
    fov_y: float
    """Degrees."""
    intrinsics: Intrinsics


class Sun(TypedDict, total=False):
    """The directional light; angles in degrees."""

    azimuth: float
    elevation: float
    color: Color
    intensity: float
    shadows: bool


class Fog(TypedDict, total=False):
    """Air that scatters light."""

    color: Color
    density: float
    """Per metre."""
    height_falloff: float


class ToneMap(TypedDict, total=False):
    """How light becomes the picture."""

    operator: Literal["none", "reinhard", "aces", "agx"]
    exposure: float


class FrameRequest(TypedDict, total=False):
    """One image. Every field has a default; an empty request is a good-looking frame of the pond."""

    scene: str
    water: str | Mapping[str, Any]
    """A technique's name, or its parameters with ``technique`` among them."""
    camera: Camera | Mapping[str, Any]
    time: float
    """Seconds."""
    period: float | None
    """Seconds after which all that moves repeats."""
    width: int
    height: int
    sun: Sun | Mapping[str, Any] | None
    ambient: Color
    sky: str | Mapping[str, Any]
    fog: Fog | Mapping[str, Any] | None
    msaa: Literal[1, 4]
    samples: int
    shutter: float
    """Seconds."""
    tonemap: str | ToneMap | Mapping[str, Any]
    maps: Mapping[str, Any] | None
    layers: Sequence[str]
    seed: int
    format: ImageFormat


class Turntable(TypedDict, total=False):
    """A camera carried round a vertical axis while time runs."""

    frames: int
    fps: float
    sweep: float
    """Degrees over the whole sequence."""
    pivot: Vector | None
    """A point of the axis; None is the camera's target, else the scene's centre."""
    loop: bool
    """Whether the last frame leads into the first; needs whole turns."""
    maps_every: int
    """Frames that share their reflection and refraction maps."""


class JobRequest(TypedDict, total=False):
    """What ``submit`` sends."""

    kind: Literal["turntable"]
    frame: FrameRequest | Mapping[str, Any]
    turntable: Turntable
    outputs: Sequence[Product]
    """Products to be made as soon as the frames are there; others are made when asked for."""
    priority: int
    order: Literal["sequential", "coarse_to_fine"]


class ImageFacts(TypedDict):
    """An uploaded image: ``id`` is what requests name."""

    id: str
    kind: ImageKind
    width: int
    height: int


class Counts(TypedDict):
    """How many of a job's frames are in which state."""

    total: int
    done: int
    failed: int
    pending: int
    leased: int


class JobFacts(TypedDict):
    """A job as the service describes it; times are ISO 8601."""

    id: str
    kind: str
    state: str
    counts: Counts
    frames_per_second: float | None
    eta_seconds: float | None
    created: str
    started: str | None
    finished: str | None
    links: dict[str, str]
    error: dict[str, Any] | None


class FrameFacts(TypedDict):
    """A job's frame as the service lists it."""

    index: int
    state: Literal["pending", "leased", "done", "failed"]
    key: str
    digest: str | None
    url: str | None
