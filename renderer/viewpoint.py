"""The forms in which a request may give its camera; the fields that appear tell them apart."""

from __future__ import annotations

from collections.abc import Mapping
from typing import Annotated, Any

import numpy as np
from pydantic import BeforeValidator, Discriminator, Field, Tag, field_validator
from pydantic_core import PydanticCustomError
from pydantic_core.core_schema import ValidationInfo

from renderer.blocks import Declaration
from renderer.camera import Matrix, compass_direction, look_at, pose, rotation_from_angles
from renderer.lens import Viewpoint, turn_point
from renderer.units import FARTHEST, Angle, Direction, Length, Mat4, Point

PARALLEL = 1e-6
"""Sine of the angle below which two directions count as parallel."""


class LookAt(Viewpoint):
    """An eye and the point that it looks at."""

    form = frozenset({"eye", "target", "up"})

    eye: Point
    """Where the camera stands."""
    target: Point
    """What it looks at: the centre of the image."""
    up: Direction = (0.0, 1.0, 0.0)
    """What is up in the image; not parallel to the view."""

    @field_validator("target")
    @classmethod
    def _elsewhere(cls, target: Any, info: ValidationInfo) -> Any:
        eye = info.data.get("eye")
        if eye is not None and np.linalg.norm(np.subtract(target, eye)) < PARALLEL:
            raise PydanticCustomError("target", "target must differ from eye", {"bound": "not the eye's place"})
        return target

    @field_validator("up")
    @classmethod
    def _not_along_the_view(cls, up: Any, info: ValidationInfo) -> Any:
        eye, target = info.data.get("eye"), info.data.get("target")
        if np.linalg.norm(up) < PARALLEL:
            raise PydanticCustomError("up", "up must not be zero", {"bound": "a direction"})
        if eye is not None and target is not None:
            view = np.subtract(target, eye)
            sine = np.linalg.norm(np.cross(up, view)) / np.linalg.norm(up) / np.linalg.norm(view)
            if sine < PARALLEL:
                raise PydanticCustomError(
                    "up",
                    "up is parallel to the view from eye to target; give another, say [0, 0, -1]",
                    {"bound": "not parallel to the view"},
                )
        return up

    def pose(self) -> Matrix:
        """See ``Viewpoint.pose``."""
        return look_at(np.array(self.eye), np.array(self.target), np.array(self.up))

    @property
    def pivot(self) -> tuple[float, float, float] | None:
        """The target."""
        return self.target

    def turned(self, pivot: tuple[float, float, float], angle: float) -> LookAt:
        """See ``Viewpoint.turned``."""
        return self.model_copy(
            update={
                "eye": turn_point(self.eye, pivot, angle),
                "target": turn_point(self.target, pivot, angle),
                "up": turn_point(self.up, (0.0, 0.0, 0.0), angle),
            },
        )


class Posed(Viewpoint):
    """A position and three angles: ``Ry(yaw) @ Rx(pitch) @ Rz(roll)``; all zero looks along −z."""

    form = frozenset({"position", "yaw", "pitch", "roll"})

    position: Point
    """Where the camera stands."""
    yaw: Angle = 0.0
    """Turn about +y, to the left if positive."""
    pitch: Angle = 0.0
    """Turn about the camera's x, upwards if positive."""
    roll: Angle = 0.0
    """Turn about the camera's z, anticlockwise if positive (the image then leans clockwise)."""

    def pose(self) -> Matrix:
        """See ``Viewpoint.pose``."""
        return pose(rotation_from_angles(self.yaw, self.pitch, self.roll), np.array(self.position))

    def turned(self, pivot: tuple[float, float, float], angle: float) -> Posed:
        """See ``Viewpoint.turned``."""
        return self.model_copy(
            update={
                "position": turn_point(self.position, pivot, angle),
                "yaw": self.yaw - angle,
            },
        )


class OrbitPlace(Declaration):
    """A place on a sphere round a target."""

    target: Point
    """The centre of the sphere and of the image."""
    distance: Length = Field(gt=0, le=1e6)
    """Radius of the sphere."""
    azimuth: Angle = 0.0
    """Compass direction from the target to the eye: clockwise from −z, so 90 is +x."""
    elevation: Angle = Field(0.0, ge=-90, le=90)
    """Angle of the eye above the horizon of the target."""


class Orbit(Viewpoint):
    """A camera on a sphere round its target, upright."""

    form = frozenset({"orbit"})

    orbit: OrbitPlace

    def pose(self) -> Matrix:
        """See ``Viewpoint.pose``."""
        place = self.orbit
        direction = compass_direction(place.azimuth, place.elevation)
        rotation = rotation_from_angles(180.0 - place.azimuth, -place.elevation, 0.0)
        return pose(rotation, np.array(place.target) + place.distance * direction)

    @property
    def pivot(self) -> tuple[float, float, float] | None:
        """The target."""
        return self.orbit.target

    def turned(self, pivot: tuple[float, float, float], angle: float) -> Orbit:
        """See ``Viewpoint.turned``."""
        place = self.orbit.model_copy(
            update={
                "target": turn_point(self.orbit.target, pivot, angle),
                "azimuth": self.orbit.azimuth + angle,
            },
        )
        return self.model_copy(update={"orbit": place})


class MatrixPose(Viewpoint):
    """A camera-to-world matrix, 16 numbers row by row."""

    form = frozenset({"matrix"})

    matrix: Mat4

    @field_validator("matrix")
    @classmethod
    def _rigid(cls, matrix: tuple[float, ...]) -> tuple[float, ...]:
        values = np.array(matrix).reshape(4, 4)
        rotation = values[:3, :3]
        if np.abs(values).max() > FARTHEST:
            raise PydanticCustomError("matrix", "a number is too large", {"bound": f"within ±{FARTHEST:g}"})
        is_rotation = np.abs(rotation @ rotation.T - np.eye(3)).max() < 1e-3
        if not is_rotation or np.linalg.det(rotation) < 0:
            raise PydanticCustomError(
                "matrix",
                "the upper left 3×3 must be a rotation",
                {"bound": "orthonormal, determinant +1"},
            )
        if np.abs(values[3] - [0, 0, 0, 1]).max() > 1e-6:
            raise PydanticCustomError("matrix", "the last row must be 0 0 0 1", {"bound": "0, 0, 0, 1"})
        return matrix

    def pose(self) -> Matrix:
        """See ``Viewpoint.pose``; the rotation is made exactly orthonormal."""
        values = np.array(self.matrix).reshape(4, 4)
        left, _, right = np.linalg.svd(values[:3, :3])
        return pose(left @ right, values[:3, 3])

    def turned(self, pivot: tuple[float, float, float], angle: float) -> MatrixPose:
        """See ``Viewpoint.turned``."""
        columns = np.array(self.matrix).reshape(4, 4)
        turn = pose(rotation_from_angles(-angle, 0, 0), np.zeros(3))
        turned = turn @ columns
        turned[:3, 3] = turn_point(tuple(columns[:3, 3]), pivot, angle)
        return self.model_copy(update={"matrix": tuple(float(v) for v in turned.round(12).flat)})


FORMS: dict[str, type[Viewpoint]] = {
    "<look_at>": LookAt,
    "<posed>": Posed,
    "<orbit>": Orbit,
    "<matrix>": MatrixPose,
}
"""The forms by their tag; the brackets keep a tag from being taken for a field in an error's path."""


def form_of(data: Any) -> str | None:
    """The tag of the form whose fields appear in the data; None where none or several do."""
    if isinstance(data, Viewpoint):
        return next(tag for tag, form in FORMS.items() if isinstance(data, form))
    if not isinstance(data, Mapping):
        return None
    matching = [tag for tag, form in FORMS.items() if form.form & set(data)]
    return matching[0] if len(matching) == 1 else None


def _one_form(data: Any) -> Any:
    if isinstance(data, Viewpoint) or form_of(data) is not None:
        return data
    if not isinstance(data, Mapping):
        raise PydanticCustomError("camera", "a camera is an object")
    given = sorted(set(data) & set().union(*(form.form for form in FORMS.values())))
    raise PydanticCustomError(
        "camera",
        "give one form of camera: eye and target; position, yaw, pitch, roll; orbit; or matrix{given}",
        {"given": f" (mixed: {', '.join(given)})" if given else ""},
    )


AnyViewpoint = Annotated[
    Annotated[LookAt, Tag("<look_at>")]
    | Annotated[Posed, Tag("<posed>")]
    | Annotated[Orbit, Tag("<orbit>")]
    | Annotated[MatrixPose, Tag("<matrix>")],
    Discriminator(form_of),
    BeforeValidator(_one_form),
]
