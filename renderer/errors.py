"""What can go wrong in the renderer.

    MillpondError
    ├── InvalidRequest      a request that breaks the schema or its bounds
    ├── SceneError          a scene's data is damaged or inconsistent
    ├── MissingImage        an image that the request names is not in the library
    ├── ImageLibraryFull    the library of users' images takes no more
    ├── EncodeError         an image or movie cannot be written, read or verified
    ├── Cancelled           nobody waits for the frame any more
    └── DeviceError
        ├── NoDevice        no OpenGL device that meets the demand
        ├── WrongThread     the context was used from a thread that does not own it
        ├── ShaderError     a shader did not compile or link
        └── DrawError       OpenGL reported an error or left the target undrawn

The docstring of a class is its default message; attributes carry the facts.
"""

from __future__ import annotations

from dataclasses import dataclass
from typing import Any


class MillpondError(Exception):
    """Something went wrong in Millpond."""

    def __init__(self, message: str | None = None) -> None:
        super().__init__(message or (type(self).__doc__ or "").strip().splitlines()[0])


@dataclass(frozen=True)
class FieldProblem:
    """One mistake in a request: where it is, what is wrong, what was given, what would be right."""

    path: str
    message: str
    value: Any = None
    bound: str | None = None

    def __str__(self) -> str:
        given = "" if self.value is None else f" (given: {_brief(self.value)})"
        return f"{self.path or 'request'}: {self.message}{given}"


class InvalidRequest(MillpondError):
    """The request is not valid."""

    def __init__(self, problems: tuple[FieldProblem, ...]) -> None:
        self.problems = problems
        super().__init__("; ".join(str(problem) for problem in problems) or None)

    def __reduce__(self) -> tuple[type[InvalidRequest], tuple[tuple[FieldProblem, ...]]]:
        return type(self), (self.problems,)


class SceneError(MillpondError):
    """The scene's data is damaged or inconsistent."""


class MissingImage(MillpondError):
    """The image is not in this machine's library, or it is damaged."""

    def __init__(self, image_id: str, kind: str = "image") -> None:
        self.image_id, self.kind = image_id, kind
        super().__init__(f"The {kind} {image_id} is not in this machine's library, or is damaged: upload it again.")

    def __reduce__(self) -> tuple[type[MissingImage], tuple[str, str]]:
        return type(self), (self.image_id, self.kind)


class ImageLibraryFull(MillpondError):
    """The library of images takes no more."""


class EncodeError(MillpondError):
    """The image or movie could not be encoded, read or verified."""


class Cancelled(MillpondError):
    """The frame was cancelled: nobody waits for it any more."""


class DeviceError(MillpondError):
    """The OpenGL device failed."""


class NoDevice(DeviceError):
    """No OpenGL device meets the demand."""


class WrongThread(DeviceError):
    """An OpenGL context may be used by the thread that made it, and by no other."""


class ShaderError(DeviceError):
    """A shader did not compile."""


class DrawError(DeviceError):
    """OpenGL reported an error, or left the target undrawn."""


def _brief(value: Any, limit: int = 60) -> str:
    text = repr(value)
    return text if len(text) <= limit else text[: limit - 1] + "…"
