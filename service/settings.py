"""What the operator chooses: the only reader of the environment.

Every setting is ``MILLPOND_<NAME>`` in the environment (a cap is ``MILLPOND_LIMITS__<NAME>``), or a line of a
TOML file named by ``MILLPOND_CONFIG``; the environment wins. Lists are written as JSON.
"""

from __future__ import annotations

import ipaddress
import os
from pathlib import Path
from typing import Annotated, Literal, Self

from pydantic import BaseModel, ConfigDict, Field, SecretStr, model_validator
from pydantic_settings import (
    BaseSettings,
    PydanticBaseSettingsSource,
    SettingsConfigDict,
    TomlConfigSettingsSource,
)

PREFIX = "MILLPOND_"

Seconds = Annotated[float, Field(allow_inf_nan=False, json_schema_extra={"x-unit": "s"})]
"""A span of wall time, seconds."""


def cores() -> int:
    """Processors that this process may run on."""
    return len(os.sched_getaffinity(0))


def is_loopback(host: str) -> bool:
    """Whether only this machine can reach the address."""
    if host == "localhost":
        return True
    try:
        return ipaddress.ip_address(host).is_loopback
    except ValueError:
        return False


def state_folder() -> Path:
    """Where data is kept when nobody says otherwise (XDG Base Directory Specification)."""
    home = os.environ.get("XDG_STATE_HOME")
    return (Path(home) if home else Path.home() / ".local" / "state") / "millpond"


def unknown_variables() -> tuple[str, ...]:
    """Variables that look like settings and are none: a misspelt one would else be ignored in silence."""
    caps = {f"{PREFIX}LIMITS__{name.upper()}" for name in Limits.model_fields}
    known = {f"{PREFIX}CONFIG", f"{PREFIX}CACHE", *caps, *(f"{PREFIX}{name.upper()}" for name in Settings.model_fields)}
    return tuple(sorted(name for name in os.environ if name.startswith(PREFIX) and name not in known))


class Limits(BaseModel):
    """Every cap of the service; what lies past one is refused with 422 or 413, or 503 where it is the queue."""

    model_config = ConfigDict(frozen=True, extra="forbid", use_attribute_docstrings=True)

    pixels: int = Field(12_441_600, ge=1)
    """Pixels of one frame, width times height. A cap on memory: 1 GiB per attachment is 16384 pixels squared."""
    width: int = Field(8192, ge=1, le=8192)
    """Width of one frame, pixels."""
    height: int = Field(8192, ge=1, le=8192)
    """Height of one frame, pixels."""
    samples: int = Field(64, ge=1, le=64)
    """Jittered sub-frames of one frame."""
    sequence_frames: int = Field(600, ge=1)
    """Frames of a sequence or turntable that is answered as it renders."""
    sequences: int = Field(4, ge=1)
    """Sequences and turntables that are answered as they render at one time."""
    job_frames: int = Field(20_000, ge=1)
    """Frames of one job."""
    body_bytes: int = Field(1_048_576, ge=1024)
    """Bytes of a JSON request body."""
    image_bytes: int = Field(64 << 20, ge=1024, le=1 << 30)
    """Bytes of an uploaded image's file."""
    image_side: int = Field(8192, ge=1, le=8192)
    """Width and height of an uploaded image, pixels."""
    image_pixels: int = Field(8192 * 8192, ge=1, le=8192 * 8192)
    """Pixels of an uploaded image, width times height."""
    image_library_bytes: int = Field(4 << 30, ge=1024)
    """Bytes of all uploaded images together; past them uploads are refused with 503."""
    url_bytes: int = Field(16_384, ge=1024, le=65_536)
    """Bytes of a request's path and query."""
    queue_seconds: float = Field(30.0, gt=0, allow_inf_nan=False)
    """Predicted seconds of work that may wait for the interactive worker before new frames are refused with 503."""


class Settings(BaseSettings):
    """The service's settings."""

    model_config = SettingsConfigDict(
        env_prefix=PREFIX,
        env_nested_delimiter="__",
        extra="forbid",
        frozen=True,
        use_attribute_docstrings=True,
    )

    host: str = "127.0.0.1"
    """Address to bind. Anything but loopback needs API keys, or ``allow_anonymous``."""
    port: int = Field(8000, ge=0, le=65_535)
    """Port to bind; 0 takes a free one."""
    data_dir: Path = Field(default_factory=state_folder)
    """Folder of the artifacts and of the job store."""
    allowed_hosts: tuple[str, ...] = ()
    """Host names that requests may name, beside loopback and the bound address; ``["*"]`` admits all."""
    allowed_origins: tuple[str, ...] = ()
    """Origins (``https://example.org``) whose pages may write, beside this service's own."""
    api_keys: tuple[SecretStr, ...] = ()
    """Keys, one of which every request under /v1 must carry as ``Authorization: Bearer`` or ``X-API-Key``."""
    allow_anonymous: bool = False
    """Whether to serve without API keys on an address that is not loopback."""

    require: Literal["any", "gpu", "cpu"] = "any"
    """The kind of device that frames are drawn on; the start fails where there is none."""
    workers: int = Field(default_factory=cores, ge=1, le=256)
    """Batch worker processes, each on one core."""
    interactive: bool = True
    """Whether a process beside the batch workers draws interactive frames alone, with a thread for each core."""
    deadline_seconds: Seconds = Field(10.0, gt=0)
    """The least time after which a frame's process is ended; more where the frame's estimate is longer."""
    deadline_factor: float = Field(8.0, ge=1, allow_inf_nan=False)
    """A frame's process is ended after so many times the frame's estimate."""
    worker_frames: int = Field(10_000, ge=1)
    """Frames after which a worker process is replaced."""
    worker_bytes: int = Field(2 << 30, ge=1 << 28)
    """Resident bytes past which a worker process is replaced."""
    artifact_bytes: int = Field(8 << 30, ge=1 << 20)
    """Bytes of artifacts to keep; past them the least recently used are dropped."""
    memory_bytes: int = Field(256 << 20, ge=0)
    """Bytes of artifacts that the web process keeps in memory."""
    job_days: float = Field(7.0, gt=0, allow_inf_nan=False)
    """Days after its end at which a job expires."""
    grace_seconds: Seconds = Field(10.0, gt=0)
    """Time that answers under way have to finish after SIGTERM."""
    ready_seconds: Seconds = Field(30.0, gt=0)
    """Time that a frame waits for the workers to start before it is answered with 503."""
    log_format: Literal["json", "text"] = "json"
    """How log lines are written: a JSON object a line, or text for people."""
    log_level: Literal["debug", "info", "warning", "error"] = "info"
    """The least severity that is logged."""
    limits: Limits = Limits()
    """The caps."""

    @classmethod
    def settings_customise_sources(
        cls,
        settings_cls: type[BaseSettings],
        init_settings: PydanticBaseSettingsSource,
        env_settings: PydanticBaseSettingsSource,
        dotenv_settings: PydanticBaseSettingsSource,  # noqa: ARG003 -- part of the signature; no .env file is read
        file_secret_settings: PydanticBaseSettingsSource,  # noqa: ARG003 -- as above
    ) -> tuple[PydanticBaseSettingsSource, ...]:
        """Where settings come from, the strongest first."""
        config = os.environ.get(f"{PREFIX}CONFIG")
        files = () if config is None else (TomlConfigSettingsSource(settings_cls, Path(config)),)
        return (init_settings, env_settings, *files)

    @model_validator(mode="after")
    def _is_not_open_to_the_world(self) -> Self:
        if not (is_loopback(self.host) or self.api_keys or self.allow_anonymous):
            message = (
                f"host {self.host!r} is not loopback: set {PREFIX}API_KEYS='[\"…\"]', "
                f"or {PREFIX}ALLOW_ANONYMOUS=true to serve anybody"
            )
            raise ValueError(message)
        return self

    @property
    def database_url(self) -> str:
        """SQLAlchemy URL of the job store."""
        return f"sqlite:///{self.data_dir / 'jobs.sqlite3'}"
