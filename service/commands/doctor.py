"""``millpond doctor``: what drawing needs, what of it is here, and the one command that mends what is not."""

from __future__ import annotations

import json
import sys
from collections.abc import Sequence
from typing import cast

from renderer.doctor import Demand, examine
from service.commands.options import Option, Usage, help_text, take_apart

NO_DEVICE = 3
USAGE = "millpond doctor [options]"
SUMMARY = (
    "Says which libraries, drivers and devices were looked for and found, and the one command that mends what is "
    f"missing. Exit code 0 where a frame can be drawn, {NO_DEVICE} where none can."
)
OPTIONS = (
    Option("require", "KIND", "the kind of device that must work: any, gpu or cpu"),
    Option("json", "", "write the report as JSON"),
    Option("help", "", "this text"),
)


def help_page() -> str:
    """The answer to ``--help``."""
    return help_text(USAGE, SUMMARY, OPTIONS, has_fields=False)


def run(arguments: Sequence[str]) -> int:
    """Examine and report."""
    given = take_apart(arguments, OPTIONS)
    given.refuse_fields()
    if given.positional:
        raise Usage(f"no arguments are taken: {USAGE}")
    report = examine(cast("Demand", given.choice("require", ("any", "gpu", "cpu"))))
    text = json.dumps(report.to_dict(), indent=2) if "json" in given.own else report.text()
    sys.stdout.write(text + "\n")
    return 0 if report.is_healthy else NO_DEVICE
