"""HTTP/1.1 as uvicorn speaks it, with bounds on what a client may send before the application sees it."""

from __future__ import annotations

import json
import secrets

from uvicorn.protocols.http.httptools_impl import HttpToolsProtocol

LARGEST_HEAD = 128 * 1024
"""Bytes of a request's address and headers; a longer head is not read to its end."""


class BoundedProtocol(HttpToolsProtocol):
    """Refuses endless heads; answers what is not HTTP with a problem body."""

    _head = 0

    def on_message_begin(self) -> None:
        """Start to count."""
        self._head = 0
        super().on_message_begin()

    def on_url(self, url: bytes) -> None:
        """Take a piece of the address."""
        self._count(len(url))
        super().on_url(url)

    def on_header(self, name: bytes, value: bytes) -> None:
        """Take a header."""
        self._count(len(name) + len(value))
        super().on_header(name, value)

    def _count(self, size: int) -> None:
        self._head += size
        if self._head > LARGEST_HEAD:
            raise ValueError("the head of the request is too long")  # the parser turns it into its own error

    def send_400_response(self, msg: str) -> None:
        """Answer what can't be understood, and close."""
        body = {
            "type": "/problems/malformed-request",
            "title": "The request is not HTTP",
            "status": 400,
            "detail": msg,
            "instance": "/",
            "request_id": secrets.token_hex(8),
        }
        content = json.dumps(body).encode()
        head = (
            "HTTP/1.1 400 Bad Request\r\n"
            "content-type: application/problem+json\r\n"
            "cache-control: no-store\r\n"
            f"content-length: {len(content)}\r\n"
            "connection: close\r\n\r\n"
        )
        self.transport.write(head.encode() + content)
        self.transport.close()
