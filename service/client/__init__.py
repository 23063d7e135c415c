"""Millpond's client: frames of reflective and refractive water over HTTP.

import millpond

pond = millpond.Millpond("http://127.0.0.1:8000")
pond.frame(water="luna", time=2, width=640, height=360).save("pond.png")
"""

from .asynchronous import AsyncJob, AsyncMillpond
from .errors import (
    Conflict,
    ConnectionFailed,
    Damaged,
    FieldError,
    Forbidden,
    Gone,
    InvalidRequest,
    JobFailed,
    MillpondError,
    NotFound,
    Problem,
    TimedOut,
    TooManyRequests,
    Unauthorized,
    Unavailable,
)
from .operations import UnknownJobState
from .picture import Frame, Movie, Picture
from .release import __version__
from .shapes import Camera, FrameRequest, ImageFacts, JobFacts, JobRequest, Turntable
from .sync import Job, Millpond

__all__ = [
    "AsyncJob",
    "AsyncMillpond",
    "Camera",
    "Conflict",
    "ConnectionFailed",
    "Damaged",
    "FieldError",
    "Forbidden",
    "Frame",
    "FrameRequest",
    "Gone",
    "ImageFacts",
    "InvalidRequest",
    "Job",
    "JobFacts",
    "JobFailed",
    "JobRequest",
    "Millpond",
    "MillpondError",
    "Movie",
    "NotFound",
    "Picture",
    "Problem",
    "TimedOut",
    "TooManyRequests",
    "Turntable",
    "Unauthorized",
    "Unavailable",
    "UnknownJobState",
    "__version__",
]
