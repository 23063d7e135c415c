"""What every form of camera has: a lens, a range of depth, and a turn about a vertical axis."""

from __future__ import annotations

from collections.abc import Mapping
from typing import Any, ClassVar

import numpy as np
from numpy.typing import NDArray
from pydantic import Field, field_validator, model_validator
from pydantic_core import PydanticCustomError
from pydantic_core.core_schema import ValidationInfo

from renderer.blocks import Declaration
from renderer.camera import NEAR, Camera, Lens, Matrix, rotation_from_angles
from renderer.units import Angle, Length, Number

DEFAULT_FOV_Y = 45.0
LENSES = ("fov_y", "intrinsics", "orthographic")


class Intrinsics(Declaration):
    """A pinhole in pixels (OpenCV's K: origin top-left, y down)."""

    fx: Number = Field(ge=1e-3, le=1e7)
    fy: Number = Field(ge=1e-3, le=1e7)
    cx: Number = Field(ge=-1e7, le=1e7)
    cy: Number = Field(ge=-1e7, le=1e7)


class Orthographic(Declaration):
    """A parallel projection."""

    height: Length = Field(ge=1e-6, le=1e6)
    """Height of the image in the world."""


class Viewpoint(Declaration):
    """What every form of camera has: a lens, and the range of depth."""

    form: ClassVar[frozenset[str]] = frozenset()

    fov_y: Angle | None = Field(None, ge=0.1, le=175)
    """Vertical field of view (45 where no lens is given)."""
    intrinsics: Intrinsics | None = None
    """A pinhole in pixels instead of a field of view."""
    orthographic: Orthographic | None = None
    """A parallel projection instead of a field of view."""
    near: Length | None = Field(None, ge=1e-6, le=1e5)
    """Distance of the near plane; chosen by the renderer where left out."""
    far: Length | None = Field(None, gt=0, le=1e7)
    """Distance of the far plane; infinity (10 km if orthographic) where left out."""

    @model_validator(mode="before")
    @classmethod
    def _one_lens(cls, data: Any) -> Any:
        if not isinstance(data, Mapping):
            return data
        given = [name for name in LENSES if data.get(name) is not None]
        if len(given) > 1:
            raise PydanticCustomError(
                "lens",
                "give one of fov_y, intrinsics and orthographic, not {given}",
                {"given": " and ".join(given), "bound": "one of " + ", ".join(LENSES)},
            )
        return data if given else {**data, "fov_y": DEFAULT_FOV_Y}

    @field_validator("far")
    @classmethod
    def _beyond_near(cls, far: float | None, info: ValidationInfo) -> float | None:
        near = info.data.get("near") or NEAR
        if far is not None and far <= near:
            raise PydanticCustomError("far", "far must lie beyond near", {"bound": f"> {near}"})
        return far

    def lens(self, width: int, height: int) -> Lens:
        """The lens in pixels of an image of this size."""
        if self.intrinsics is not None:
            k = self.intrinsics
            return Lens(k.fx, k.fy, k.cx, k.cy)
        if self.orthographic is not None:
            scale = height / self.orthographic.height
            return Lens(scale, scale, width / 2, height / 2, is_orthographic=True)
        focal = height / 2 / np.tan(np.radians((self.fov_y or DEFAULT_FOV_Y) / 2))
        return Lens(float(focal), float(focal), width / 2, height / 2)

    def pose(self) -> Matrix:
        """``world_from_camera``."""
        raise NotImplementedError

    def camera(self, width: int, height: int) -> Camera:
        """The camera for an image of this size in pixels."""
        return Camera(
            self.pose(),
            self.lens(width, height),
            width,
            height,
            near=self.near or NEAR,
            far=self.far,
        )

    @property
    def pivot(self) -> tuple[float, float, float] | None:
        """The point that the camera looks at, where its form names one."""
        return None

    def turned(self, pivot: tuple[float, float, float], angle: float) -> Viewpoint:
        """The camera carried round the vertical through ``pivot`` by degrees of azimuth."""
        raise NotImplementedError


def turn_point(
    point: tuple[float, ...],
    pivot: tuple[float, ...],
    angle: float,
) -> tuple[float, float, float]:
    """Carry a point round the vertical through ``pivot`` by degrees of compass azimuth.

    Rounded to a picometre, so that the last bit of a platform's sine does not reach the frame's key.
    """
    turned: NDArray[np.float64] = rotation_from_angles(-angle, 0, 0) @ np.subtract(point, pivot)
    x, y, z = (float(v) for v in (turned + pivot).round(12))
    return x, y, z
