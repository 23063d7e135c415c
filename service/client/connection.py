"""Where the service is and how to speak to it: shared by both clients."""

from __future__ import annotations

import ipaddress
import math
from dataclasses import dataclass
from typing import Any

import httpx

from .exchange import Policy
from .release import __version__
from .shapes import ENDED, Counts, JobFacts

DEFAULT_URL = "http://127.0.0.1:8000"
DEFAULT_TIMEOUT = 120.0
"""Seconds."""
DEFAULT_RETRIES = 5
DAY = 86_400.0
"""Seconds."""


@dataclass(frozen=True)
class Connection:
    """A service's address, the caller's key, and the policy of its calls."""

    base_url: str
    api_key: str | None
    policy: Policy

    @classmethod
    def to(cls, base_url: str, api_key: str | None, timeout: float, retries: int) -> Connection:
        """Checked. Raises ValueError for what is no address or no time."""
        url = httpx.URL(base_url)
        if url.scheme not in {"http", "https"} or not url.host:
            raise ValueError(f"{base_url!r} is no address: it should look like {DEFAULT_URL}")
        if retries < 0:
            raise ValueError("retries cannot be fewer than none")
        return cls(base_url, api_key, Policy(checked_seconds(timeout), retries))

    def arguments(self) -> dict[str, Any]:
        """What an httpx client of either kind is made with."""
        headers = {"User-Agent": f"millpond-python/{__version__}"}
        if self.api_key is not None:
            headers["Authorization"] = f"Bearer {self.api_key}"
        # A proxy of the environment does not reach this machine's own loopback.
        return {
            "base_url": self.base_url,
            "headers": headers,
            "trust_env": not is_loopback(httpx.URL(self.base_url).host),
        }


class JobView:
    """A job as it was when the service was last asked; the part that both kinds of job share."""

    def __init__(self, facts: JobFacts) -> None:
        self.facts = facts
        """Everything that the service said of it."""

    @property
    def id(self) -> str:
        """The job's id; ``client.job(id)`` finds it again."""
        return self.facts["id"]

    @property
    def kind(self) -> str:
        """``turntable``."""
        return self.facts["kind"]

    @property
    def state(self) -> str:
        """``queued``, ``running``, ``paused``, ``succeeded``, ``failed``, ``cancelled`` or ``expired``."""
        return self.facts["state"]

    @property
    def is_over(self) -> bool:
        """Whether nothing more will be drawn."""
        return self.state in ENDED

    @property
    def counts(self) -> Counts:
        """How many frames are in which state."""
        return self.facts["counts"]

    @property
    def frames_per_second(self) -> float | None:
        """How fast it is being drawn."""
        return self.facts["frames_per_second"]

    @property
    def eta_seconds(self) -> float | None:
        """Seconds until its end, as the service predicts it."""
        return self.facts["eta_seconds"]

    @property
    def error(self) -> dict[str, Any] | None:
        """Why it failed, if it did."""
        return self.facts["error"]

    def __repr__(self) -> str:
        return f"<{type(self).__name__} {self.id} {self.state}, {self.counts['done']} of {self.counts['total']} frames>"


def checked_seconds(seconds: float) -> float:
    """The time, if it is one to wait. Raises ValueError."""
    if not (math.isfinite(seconds) and seconds > 0):
        raise ValueError(f"a timeout is a finite number of seconds above zero, not {seconds}")
    return float(seconds)


def is_loopback(host: str) -> bool:
    """Whether the host is this machine."""
    try:
        return ipaddress.ip_address(host.strip("[]")).is_loopback
    except ValueError:
        return host == "localhost" or host.endswith(".localhost")
