"""Headers of image answers: identity, caching, timing."""

from __future__ import annotations

import base64
from collections.abc import Mapping
from functools import cache
from importlib.metadata import PackageNotFoundError, version

from renderer.encode.image import FORMATS
from renderer.query import to_query
from renderer.request import FrameRequest
from renderer.source_digest import source_digest
from service.frames import StoredFrame
from service.settings import Settings

LONGEST_LOCATION = 8192
"""Bytes of a Content-Location beyond which it is left out."""
STAGES = ("queue", "render", "encode")


@cache
def release() -> str:
    """The version of the installed package."""
    try:
        return version("millpond")
    except PackageNotFoundError:  # run from a checkout that was never installed
        return "0"


@cache
def running_version() -> str:
    """What ``v=`` in a URL must say for its answer to be immutable: release and digest of the sources."""
    return f"{release()}-{source_digest()[:12]}"


def identity(frame: FrameRequest, key: str, etag: str, fingerprint: str) -> dict[str, str]:
    """The headers that are known before anything is rendered."""
    headers = {
        "ETag": etag,
        "X-Frame-Key": key,
        "X-Fingerprint": fingerprint,
        "Vary": "Accept",
    }
    location = f"/v1/frame.{FORMATS[frame.format].suffixes[0]}?{to_query(frame)}"
    if len(location) < LONGEST_LOCATION:
        headers["Content-Location"] = location
    return headers


def caching(settings: Settings, asked_version: str | None = None) -> dict[str, str]:
    """The Cache-Control of a frame: private behind API keys, immutable under the running version's URL."""
    scope = "private" if settings.api_keys else "public"
    lasting = ", immutable" if asked_version == running_version() else ""
    return {"Cache-Control": f"{scope}, max-age=86400{lasting}"}


def provenance(stored: StoredFrame) -> dict[str, str]:
    """What is known of the bytes: who drew them, their digest, how long it took."""
    return {
        "X-Renderer": header_text(stored.driver),
        "Repr-Digest": repr_digest(stored.digest),
        "Server-Timing": server_timing(stored.timings, is_hit=stored.hit),
    }


def repr_digest(digest: str) -> str:
    """The Repr-Digest of a SHA-256 in hex (RFC 9530)."""
    return f"sha-256=:{base64.b64encode(bytes.fromhex(digest)).decode()}:"


def server_timing(seconds: Mapping[str, float], *, is_hit: bool) -> str:
    """The stages in milliseconds; zeros and a mark where the frame was there already."""
    stages = [f"{stage};dur={seconds.get(stage, 0.0) * 1e3:.2f}" for stage in STAGES]
    return ", ".join([*stages, 'cache;desc="hit"'] if is_hit else stages)


def header_text(text: str) -> str:
    """The text as a header can hold it."""
    return text.encode("ascii", "replace").decode()


def is_known_to(if_none_match: str, etag: str) -> bool:
    """Whether an If-None-Match header names this entity tag (RFC 9110, section 13.1.2: weak comparison)."""
    tags = [tag.strip().removeprefix("W/") for tag in if_none_match.split(",")]
    return etag in tags or "*" in tags
