"""The outermost layer: request ids, refusals before any route runs, and every exception as problem+json.

Pure ASGI, so that a route sees its client leave, and a warm frame pays microseconds for it.
"""

from __future__ import annotations

import hmac
import ipaddress
import logging
import re
import secrets
import time
from collections.abc import Collection
from urllib.parse import urlsplit

from starlette.datastructures import Headers, MutableHeaders
from starlette.types import ASGIApp, Message, Receive, Scope, Send

from service.problems import Problem, problem_of
from service.settings import Settings, is_loopback

ACCESS = logging.getLogger("millpond.http")
SANE_ID = re.compile(r"[A-Za-z0-9._:+/=-]{1,128}\Z")
WRITES = frozenset({"POST", "PUT", "PATCH", "DELETE"})
LOOPBACK_NAMES = frozenset({"localhost", "127.0.0.1", "::1"})


class ClientLeft(Exception):
    """The client closed the connection before its answer was ready."""


class Boundary:
    """Wraps the application: what passes here has an id, a known host, a friendly origin and a key."""

    def __init__(self, app: ASGIApp, settings: Settings) -> None:
        self.app = app
        self.settings = settings
        self.keys = tuple(key.get_secret_value().encode() for key in settings.api_keys)
        self.hosts = frozenset(host.lower() for host in settings.allowed_hosts) | {settings.host.lower()}

    async def __call__(self, scope: Scope, receive: Receive, send: Send) -> None:
        """Answer one request; nothing but cancellation comes out of here."""
        if scope["type"] != "http":
            await self.app(scope, receive, send)
            return
        headers = Headers(scope=scope)
        request_id = _request_id(headers)
        scope.setdefault("state", {}).update(request_id=request_id, is_head=scope["method"] == "HEAD")
        begun = time.perf_counter()
        status = 0

        async def send_with_id(message: Message) -> None:
            nonlocal status
            if message["type"] == "http.response.start":
                status = message["status"]
                added = MutableHeaders(scope=message)
                added["X-Request-Id"] = request_id
                added["X-Content-Type-Options"] = "nosniff"
            await send(message)

        try:
            self._admit(scope, headers)
            # HEAD is GET whose body the protocol does not send
            await self.app({**scope, "method": "GET"} if scope["method"] == "HEAD" else scope, receive, send_with_id)
        except ClientLeft:
            status = status or CLIENT_CLOSED
        except Exception as error:  # noqa: BLE001 -- this is the place where every one becomes an answer
            problem = problem_of(error)
            if problem.kind in UNEXPECTED or status:
                ACCESS.error("request failed", exc_info=error, extra={"request_id": request_id, "kind": problem.kind})
            if not status:  # an answer that has begun can only be broken off, which the return does
                response = problem.response(scope["path"], request_id)
                await response(scope, receive, send_with_id)
        ACCESS.info(
            "request",
            extra={
                "method": scope["method"],
                "path": scope["path"],
                "status": status,
                "ms": round((time.perf_counter() - begun) * 1e3, 2),
                "request_id": request_id,
            },
        )

    def _admit(self, scope: Scope, headers: Headers) -> None:
        if not self._knows(headers.get("host", ""), scope):
            raise Problem("unknown-host", "The Host header names a host that this server does not answer for.")
        length = len(scope.get("raw_path") or b"") + len(scope["query_string"]) + 1
        limit = self.settings.limits.url_bytes
        if length > limit:
            raise Problem(
                "url-too-long",
                f"Path and query have {length} bytes; at most {limit} are read.",
                facts={"bound": limit},
            )
        if scope["method"] in WRITES and not self._is_friendly(headers):
            raise Problem("cross-origin-write", "The request was sent by a page of another origin.")
        if self.keys and scope["path"].startswith("/v1/") and not self._holds_key(headers):
            raise Problem(
                "unauthorized",
                "Send one of the server's API keys.",
                headers={"WWW-Authenticate": 'Bearer realm="millpond"'},
            )

    def _knows(self, host: str, scope: Scope) -> bool:
        name = _host_name(host)
        if name in LOOPBACK_NAMES or name in self.hosts or "*" in self.hosts:
            return True
        bound = scope.get("server")  # on a wildcard address: the one that this connection came in by
        return bool(bound and name == bound[0] and not is_loopback(self.settings.host))

    def _is_friendly(self, headers: Headers) -> bool:
        origin = headers.get("origin")
        if origin is not None and origin in self.settings.allowed_origins:
            return True
        if headers.get("sec-fetch-site", "none") not in {"none", "same-origin"}:
            return False
        return origin is None or urlsplit(origin).netloc == headers.get("host")

    def _holds_key(self, headers: Headers) -> bool:
        scheme, _, bearer = headers.get("authorization", "").partition(" ")
        given = bearer.strip() if scheme.lower() == "bearer" else headers.get("x-api-key", "")
        return _is_among(given.encode(), self.keys)


CLIENT_CLOSED = 499
"""What the log says of a client that left (no such status is ever sent)."""
UNEXPECTED = frozenset({"internal-error", "render-failed"})
"""Kinds whose whole story the log must hold."""


def _request_id(headers: Headers) -> str:
    given = headers.get("x-request-id", "")
    return given if SANE_ID.match(given) else secrets.token_hex(8)


def _host_name(host: str) -> str:
    """The name of a Host header, without port and brackets, lower case."""
    bracketed = re.fullmatch(r"\[([0-9a-fA-F:.]+)\](:\d+)?", host)
    if bracketed:
        return _plain_address(bracketed[1])
    name, _, _port = host.partition(":")
    return name.lower()


def _plain_address(text: str) -> str:
    """An IPv6 address in its shortest form, or nothing."""
    try:
        return str(ipaddress.ip_address(text))
    except ValueError:
        return ""


def _is_among(given: bytes, keys: Collection[bytes]) -> bool:
    """Whether one of the keys is given, in a time that does not tell which or how much of it."""
    found = False
    for key in keys:
        found |= hmac.compare_digest(given, key)
    return found
