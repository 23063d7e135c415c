"""Every engine by its name in the settings."""

from __future__ import annotations

from collections.abc import Callable

from service.engines.base import Engine
from service.engines.inline import InlineEngine
from service.engines.local import LocalEngine

ENGINES: dict[str, Callable[..., Engine]] = {"local": LocalEngine, "inline": InlineEngine}
