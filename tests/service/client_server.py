"""A real HTTP server on a real port that answers what a test tells it to, in order."""

from __future__ import annotations

import json
import threading
from collections.abc import Iterator, Mapping
from contextlib import contextmanager
from dataclasses import dataclass, field
from http.server import BaseHTTPRequestHandler, ThreadingHTTPServer
from typing import Any


@dataclass(frozen=True)
class Answer:
    """What the server does with one request."""

    status: int = 200
    body: bytes = b""
    headers: Mapping[str, str] = field(default_factory=dict)
    drops: bool = False
    """Close the connection without an answer."""
    missing: int = 0
    """Bytes that are promised and not sent."""
    stalls: float = 0.0
    """Seconds of silence before the last byte."""
    trickles: float = 0.0
    """Seconds before each byte."""


@dataclass(frozen=True)
class Seen:
    """A request that came."""

    method: str
    path: str
    headers: Mapping[str, str]
    """Names in lower case."""
    body: bytes

    @property
    def json(self) -> Any:
        """The body's value."""
        return json.loads(self.body)


def as_json(value: Any, status: int = 200, **headers: str) -> Answer:
    """An answer of JSON."""
    named = {name.replace("_", "-"): text for name, text in headers.items()}
    return Answer(status, json.dumps(value).encode(), {"Content-Type": "application/json", **named})


def problem(status: int, **facts: Any) -> Answer:
    """A refusal; ``retry_after`` becomes the header."""
    headers = {"Content-Type": "application/problem+json"}
    if "retry_after" in facts:
        headers["Retry-After"] = str(facts.pop("retry_after"))
    return Answer(
        status, json.dumps({"type": "/problems/x", "title": "No", "status": status, **facts}).encode(), headers
    )


class ScriptedServer:
    """Answers in order; the last answer is repeated for ever."""

    def __init__(self, *answers: Answer) -> None:
        self.answers = list(answers)
        self.seen: list[Seen] = []
        self.url = ""
        self._lock = threading.Lock()
        self._closing = threading.Event()

    def next(self, seen: Seen) -> Answer:
        """The answer to this request."""
        with self._lock:
            self.seen.append(seen)
            return self.answers.pop(0) if len(self.answers) > 1 else self.answers[0]

    def pause(self, seconds: float) -> None:
        """Wait, but not longer than the test."""
        self._closing.wait(seconds)

    @contextmanager
    def running(self) -> Iterator[ScriptedServer]:
        """The server on a free loopback port."""
        script = self

        class Handler(BaseHTTPRequestHandler):
            protocol_version = "HTTP/1.1"

            def _answer(self) -> None:
                body = self.rfile.read(int(self.headers.get("Content-Length", "0")))
                headers = {name.lower(): value for name, value in self.headers.items()}
                _send(self, script, script.next(Seen(self.command, self.path, headers, body)))

            do_GET = do_POST = do_DELETE = _answer  # noqa: N815 -- http.server's names

            def log_message(self, *_: Any) -> None:
                """Keep quiet."""

        with _Server(("127.0.0.1", 0), Handler) as server:
            thread = threading.Thread(target=server.serve_forever, args=(0.02,), daemon=True)
            thread.start()
            self.url = f"http://127.0.0.1:{server.server_address[1]}"
            try:
                yield self
            finally:
                self._closing.set()
                server.shutdown()
                thread.join()


class _Server(ThreadingHTTPServer):
    daemon_threads = True

    def handle_error(self, request: Any, client_address: Any) -> None:
        """A client that left early is part of the script."""


def _send(handler: BaseHTTPRequestHandler, script: ScriptedServer, answer: Answer) -> None:
    if answer.drops:
        handler.close_connection = True
        handler.connection.close()
        return
    handler.send_response(answer.status)
    for name, value in {"Content-Length": str(len(answer.body) + answer.missing), **answer.headers}.items():
        handler.send_header(name, value)
    handler.end_headers()
    if answer.trickles:
        for byte in answer.body:
            script.pause(answer.trickles)
            handler.wfile.write(bytes([byte]))
    elif answer.stalls:
        handler.wfile.write(answer.body[:-1])
        handler.wfile.flush()
        script.pause(answer.stalls)
        handler.wfile.write(answer.body[-1:])
    else:
        handler.wfile.write(answer.body)
    if answer.missing:
        handler.close_connection = True
