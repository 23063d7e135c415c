"""Finite lists of cameras and times."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Any

from pydantic import Field, field_validator
from pydantic_core import PydanticCustomError
from pydantic_core.core_schema import ValidationInfo

from renderer.blocks import Declaration
from renderer.lens import Viewpoint
from renderer.units import Angle, Number, Point


@dataclass(frozen=True)
class View:
    """One entry of a trajectory."""

    camera: Viewpoint
    time: float
    """Seconds."""
    period: float | None
    """Seconds after which everything that moves repeats, or None."""


class Turntable(Declaration):
    """A camera carried once round a vertical axis, or part of the way, while time runs."""

    frames: int = Field(120, ge=1, le=100_000)
    """How many frames."""
    fps: Number = Field(30.0, ge=0.01, le=240, json_schema_extra={"x-unit": "1/s"})
    """Frames per second of time."""
    sweep: Angle = Field(360.0, ge=-36_000, le=36_000)
    """Degrees of azimuth over the whole sequence."""
    pivot: Point | None = None
    """A point of the axis: else the camera's target, else the scene's centre."""
    loop: bool = True
    """Whether the last frame leads into the first: the water then repeats after the sequence."""
    maps_every: int = Field(1, ge=1, le=100_000)
    """How many frames share their reflection and refraction maps, which the first of them draws; 1 draws them anew."""

    @field_validator("loop")
    @classmethod
    def _whole_turns(cls, loop: Any, info: ValidationInfo) -> Any:
        sweep: Any = info.data.get("sweep", 360.0)
        if loop and abs(sweep / 360.0 - round(sweep / 360.0)) > 1e-9:
            raise PydanticCustomError(
                "loop",
                "a loop needs a sweep of whole turns (a multiple of 360), not {sweep}; or set loop to false",
                {"sweep": sweep, "bound": "a multiple of 360"},
            )
        return loop

    @property
    def duration(self) -> float:
        """Seconds from the first frame to the one that would follow the last."""
        return self.frames / self.fps

    def views(
        self,
        camera: Viewpoint,
        time: float,
        period: float | None,
        centre: tuple[float, float, float],
    ) -> list[View]:
        """The views, starting from this camera and time; ``centre`` is the scene's."""
        pivot = self.pivot or camera.pivot or centre
        return [
            View(
                camera.turned(pivot, self.sweep * i / self.frames) if i else camera,
                time + i / self.fps,
                self.duration if self.loop else period,
            )
            for i in range(self.frames)
        ]
