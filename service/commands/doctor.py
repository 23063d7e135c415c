"""``millpond doctor``: what drawing needs, what of it is here, and the one command that mends what is not."""

from __future__ import annotations

from collections.abc import Sequence

from renderer import doctor

NO_DEVICE = 3


def help_page() -> str:
    """The answer to ``--help``."""
    return (
        "usage: millpond doctor [--json] [--require any|gpu|cpu]\n\n"
        "Says which libraries, drivers and devices were looked for and found, and the one command that mends what is "
        f"missing.\nExit code 0 where a frame can be drawn, {NO_DEVICE} where none can."
    )


def run(arguments: Sequence[str]) -> int:
    """Examine and report."""
    return NO_DEVICE if doctor.main(list(arguments)) else 0
