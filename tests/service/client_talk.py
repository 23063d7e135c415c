"""Both clients behind one call, and answers that look like images."""

from __future__ import annotations

import asyncio
import base64
import hashlib
from collections.abc import Callable
from typing import Any

import millpond

from tests.service.client_server import Answer, ScriptedServer

Talk = Callable[..., Any]
Serve = Callable[..., ScriptedServer]


def digest(body: bytes) -> str:
    return f"sha-256=:{base64.b64encode(hashlib.sha256(body).digest()).decode()}:"


def image(body: bytes = b"image", **facts: Any) -> Answer:
    return Answer(200, body, {"Content-Type": "image/png", "Repr-Digest": digest(body), "X-Frame-Key": "k"}, **facts)


def blocking(url: str, method: str, /, *arguments: Any, options: dict[str, Any] | None = None, **named: Any) -> Any:
    with millpond.Millpond(url, **(options or {})) as client:
        return getattr(client, method)(*arguments, **named)


def awaited(url: str, method: str, /, *arguments: Any, options: dict[str, Any] | None = None, **named: Any) -> Any:
    async def talk() -> Any:
        async with millpond.AsyncMillpond(url, **(options or {})) as client:
            return await getattr(client, method)(*arguments, **named)

    return asyncio.run(talk())
