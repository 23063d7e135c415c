"""``millpond image add FILE``: keep an image of the user's, so that requests may name it by its id."""

from __future__ import annotations

import sys
from collections.abc import Sequence
from pathlib import Path

from renderer.errors import InvalidRequest
from renderer.scene.image_files import KINDS
from renderer.scene.images import image_library
from service.commands.options import Option, Usage, help_text, take_apart

USAGE = "millpond image add FILE --kind KIND"
SUMMARY = (
    "Checks a PNG, JPEG or WebP image, copies it into this user's library and writes its id, by which frames drawn "
    "here, with or without a server, may name it: --water.normal-map ID. The same file of the same kind has the same "
    "id everywhere."
)
OPTIONS = (
    Option("kind", "KIND", f"what the image is for: {', '.join(KINDS)}"),
    Option("help", "", "this text"),
)


def help_page() -> str:
    """The answer to ``--help``."""
    return help_text(USAGE, SUMMARY, OPTIONS, has_fields=False)


def run(arguments: Sequence[str]) -> int:
    """Check, keep, say the id."""
    given = take_apart(arguments, OPTIONS)
    given.refuse_fields()
    if len(given.positional) != 2 or given.positional[0] != "add":
        raise Usage(f"one file is added at a time: {USAGE}")
    if "kind" not in given.own:
        raise Usage(f"--kind is needed: {', '.join(KINDS)}")
    path = Path(given.positional[1])
    try:
        data = path.read_bytes()
    except OSError as error:
        raise Usage(f"{path} can't be read: {error.strerror}") from error
    try:
        card = image_library().put(data, given.own["kind"])
    except InvalidRequest as error:
        raise Usage("\n".join(f"{path}: {problem}, allowed {problem.bound}" for problem in error.problems)) from None
    sys.stdout.write(f"{card.id}\n{card.kind}  {card.width}×{card.height}  {path}\n")
    return 0
