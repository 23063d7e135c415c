"""``millpond serve``: the service, until it is told to stop."""

from __future__ import annotations

import json
import logging
import signal
import socket
import sys
import tempfile
from collections.abc import Sequence
from pathlib import Path
from types import FrameType
from typing import Any

import uvicorn
from pydantic import ValidationError

from service.commands.options import Option, Usage, help_text, take_apart
from service.logs import configure
from service.settings import PREFIX, Settings, unknown_variables

USAGE = "millpond serve [options]"
SUMMARY = (
    "Serves frames, turntables and jobs over HTTP until SIGTERM or Ctrl-C; then it takes nothing new, finishes the "
    f"answers under way and exits with 0. Every option is also a variable, as {PREFIX}PORT, and a line of the file "
    f"(TOML) that {PREFIX}CONFIG names."
)
LOG = logging.getLogger("millpond.service")
KEEP_ALIVE_SECONDS = 75
"""Longer than clients keep idle connections, so that none is closed under a request."""


def _options() -> tuple[Option, ...]:
    found = []
    for name, field in Settings.model_fields.items():
        if name == "limits":
            found += [
                Option(f"limits.{cap.replace('_', '-')}", "N", _sentence(facts.description))
                for cap, facts in type(field.default).model_fields.items()
            ]
        else:
            found.append(Option(name.replace("_", "-"), "VALUE", _sentence(field.description)))
    return (*found, Option("help", "", "this text"))


def _sentence(text: str | None) -> str:
    return " ".join((text or "").split())


def help_page() -> str:
    """The answer to ``--help``."""
    return help_text(USAGE, SUMMARY, _options(), has_fields=False)


def run(arguments: Sequence[str]) -> int:
    """Serve until told to stop."""
    settings = _settings(arguments)
    configure(settings.log_format, settings.log_level)
    for name in unknown_variables():
        LOG.warning("there is no such setting", extra={"variable": name})
    listener = _bind(settings)
    port = listener.getsockname()[1]
    from service.app import close, create_app, put_together  # noqa: PLC0415 -- a wrong option is told before half a second of imports
    from service.protocol import BoundedProtocol  # noqa: PLC0415 -- as above

    _make_folder(settings.data_dir)
    parts = put_together(settings)
    server = uvicorn.Server(
        uvicorn.Config(
            create_app(parts),
            http=BoundedProtocol,
            loop="uvloop",
            ws="none",
            lifespan="on",
            log_config=None,
            access_log=False,
            server_header=False,
            proxy_headers=False,
            timeout_keep_alive=KEEP_ALIVE_SECONDS,
            timeout_graceful_shutdown=max(1, round(settings.grace_seconds)),
        )
    )
    # uvicorn ends its own loop on a signal, and then raises the signal once more, which must not count as a crash
    for number in (signal.SIGTERM, signal.SIGINT):
        signal.signal(number, _heard)
    sys.stdout.write(f"Millpond: http://{_printable(settings.host)}:{port}/\n")
    sys.stdout.flush()
    try:
        server.run(sockets=[listener])
    finally:
        if not server.started:
            close(parts)
    return 0


def _heard(_number: int, _frame: FrameType | None) -> None:
    """The signal has done its work already."""


def _settings(arguments: Sequence[str]) -> Settings:
    given = take_apart(arguments, ())
    if given.positional:
        raise Usage(f"no arguments are taken: {USAGE}")
    try:
        return Settings(**_nested(given.fields))
    except ValidationError as error:
        raise Usage(_complaints(error)) from None


def _nested(fields: list[tuple[str, str]]) -> dict[str, Any]:
    """The options as settings: ``limits.pixels`` nested, lists read as JSON, all else left to the schema."""
    overrides: dict[str, Any] = {}
    for name, text in fields:
        outer, _, inner = name.partition(".")
        value: Any = text
        if outer in {"allowed_hosts", "allowed_origins", "api_keys"}:
            value = _list(outer, text)
        if inner:
            overrides.setdefault(outer, {})[inner] = value
        else:
            overrides[outer] = value
    return overrides


def _list(name: str, text: str) -> Any:
    if not text.startswith("["):
        return text.split(",")
    try:
        return json.loads(text)
    except ValueError as error:
        raise Usage(f"--{name.replace('_', '-')} is no JSON list: {error}") from None


def _complaints(error: ValidationError) -> str:
    """The mistakes, a line each; never the values, among which may be keys."""
    lines = []
    for details in error.errors(include_input=False, include_url=False):
        path = ".".join(str(part) for part in details["loc"]).replace("_", "-")
        unknown = details["type"] == "extra_forbidden"
        message = "there is no such setting" if unknown else details["msg"].removeprefix("Value error, ")
        lines.append(f"--{path}: {message}" if path else message)
    return "\n".join(lines)


def _bind(settings: Settings) -> socket.socket:
    try:
        family = socket.getaddrinfo(settings.host, settings.port, type=socket.SOCK_STREAM)[0][0]
        return socket.create_server((settings.host, settings.port), family=family, backlog=2048)
    except OSError as error:
        raise Usage(f"{settings.host}:{settings.port} can't be bound: {error.strerror or error}") from error


def _make_folder(path: Path) -> None:
    try:
        path.mkdir(parents=True, exist_ok=True)
        with tempfile.TemporaryFile(dir=path):
            pass
    except OSError as error:
        raise Usage(f"{path} can't be written: {error.strerror}") from error


def _printable(host: str) -> str:
    return f"[{host}]" if ":" in host else host
