"""The two drivers that carry scripts out, and the receiver that both hand their bytes to."""

from __future__ import annotations

import asyncio
import base64
import contextlib
import hashlib
import re
import secrets
import time
from collections.abc import Iterator, Mapping
from contextlib import contextmanager
from pathlib import Path
from types import TracebackType
from typing import Any, BinaryIO, Self, TypeVar

import httpx

from .errors import ConnectionFailed, Damaged, MillpondError, TimedOut
from .exchange import Reply, Script, Send, Sleep

T = TypeVar("T")

CONNECT_SECONDS = 5.0
"""How long a service may take to accept a connection; then it counts as not reachable, and is tried again."""
_DIGEST = re.compile(r"sha-256\s*=\s*:([A-Za-z0-9+/=]+):")
"""In a Repr-Digest header (RFC 9530)."""


def run(script: Script[T], http: httpx.Client) -> T:
    """Carry a script out, blocking."""
    reply: Reply | None = None
    failure: MillpondError | None = None
    while True:
        try:
            step = script.send(reply) if failure is None else script.throw(failure)
        except StopIteration as stop:
            result: T = stop.value
            return result
        reply = failure = None
        try:
            if isinstance(step, Sleep):
                time.sleep(step.seconds)
            else:
                reply = _exchange(step, http)
        except MillpondError as error:
            failure = error


async def run_async(script: Script[T], http: httpx.AsyncClient) -> T:
    """Carry a script out with asyncio."""
    reply: Reply | None = None
    failure: MillpondError | None = None
    while True:
        try:
            step = script.send(reply) if failure is None else script.throw(failure)
        except StopIteration as stop:
            result: T = stop.value
            return result
        reply = failure = None
        try:
            if isinstance(step, Sleep):
                await asyncio.sleep(step.seconds)
            else:
                reply = await _exchange_async(step, http)
        except MillpondError as error:
            failure = error


def _exchange(step: Send, http: httpx.Client) -> Reply:
    with _in_our_words(step):
        response = http.send(http.build_request(**_request(step)), stream=True)
        with contextlib.closing(response), Receiver(step, response.status_code, response.headers) as receiver:
            for piece in response.iter_raw():
                receiver.take(piece)
            return receiver.finish()


async def _exchange_async(step: Send, http: httpx.AsyncClient) -> Reply:
    with _in_our_words(step):
        async with asyncio.timeout(step.seconds):
            response = await http.send(http.build_request(**_request(step)), stream=True)
            async with contextlib.aclosing(response):
                with Receiver(step, response.status_code, response.headers) as receiver:
                    async for piece in response.aiter_raw():
                        receiver.take(piece)
                    return receiver.finish()


def _request(step: Send) -> dict[str, Any]:
    """What httpx builds its request from."""
    call = step.call
    return {
        "method": call.method,
        "url": call.path,
        "params": dict(call.query) or None,
        "content": call.body,
        # A digest is of the bytes as they travel, and images do not shrink: nothing is to be compressed.
        "headers": {"Accept-Encoding": "identity", **call.headers},
        "timeout": httpx.Timeout(step.seconds, connect=min(step.seconds, CONNECT_SECONDS)),
    }


@contextmanager
def _in_our_words(step: Send) -> Iterator[None]:
    """Turn what httpx and asyncio raise into the client's own errors."""
    try:
        yield
    except (httpx.ConnectTimeout, httpx.NetworkError, httpx.ProtocolError, httpx.ProxyError) as error:
        raise ConnectionFailed(f"{step.call}: {str(error) or type(error).__name__}") from error
    except (httpx.TimeoutException, TimeoutError) as error:
        raise TimedOut(f"{step.call}: no complete answer within {step.seconds:.3g} s") from error
    except httpx.RequestError as error:
        raise MillpondError(f"{step.call}: {error}") from error


class Receiver:
    """Takes an answer piece by piece, into memory or a file, and compares it with its digest.

    A file appears under its name only when it is complete; an answer that is no success stays in memory. The time is
    checked with each piece: an answer that trickles ends at the deadline, one that stalls at most as long after it.
    """

    def __init__(self, step: Send, status: int, headers: Mapping[str, str]) -> None:
        self._step = step
        self._status = status
        self._headers = {name.lower(): value for name, value in headers.items()}
        self._deadline = time.monotonic() + step.seconds
        self._pieces: list[bytes] = []
        digest = _DIGEST.search(self._headers.get("repr-digest", ""))
        self._expected = digest[1] if digest else None
        self._hash = hashlib.sha256()
        self._part: Path | None = None
        self._file: BinaryIO | None = None
        to = step.call.to
        if to is not None and status < 300:
            self._part = to.with_name(f".{to.name}.{secrets.token_hex(4)}.part")
            self._file = self._part.open("wb")

    def take(self, piece: bytes) -> None:
        """The next bytes. Raises TimedOut past the deadline."""
        if self._expected:
            self._hash.update(piece)
        if self._file is None:
            self._pieces.append(piece)
        else:
            self._file.write(piece)
        if time.monotonic() > self._deadline:
            raise TimedOut(f"{self._step.call}: no complete answer within {self._step.seconds:.3g} s")

    def finish(self) -> Reply:
        """The answer. Raises Damaged where it does not match its digest."""
        if self._expected and base64.b64encode(self._hash.digest()).decode() != self._expected:
            raise Damaged(f"{self._step.call}: the answer does not match its digest {self._expected}")
        if self._file is not None and self._part is not None and self._step.call.to is not None:
            self._file.close()
            self._part.replace(self._step.call.to)
        return Reply(self._status, self._headers, b"".join(self._pieces))

    def __enter__(self) -> Self:
        return self

    def __exit__(
        self, kind: type[BaseException] | None, error: BaseException | None, trace: TracebackType | None
    ) -> None:
        if self._file is not None and self._part is not None:
            self._file.close()
            self._part.unlink(missing_ok=True)
