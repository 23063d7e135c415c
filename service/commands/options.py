"""Command lines: a command's own options, and every field of a frame in dotted form.

``--water.refraction-bias 0.2`` and ``--water.refraction-bias=0.2`` mean what ``water.refraction_bias=0.2`` means in a
URL: the same parser reads both. A value may begin with a minus sign.
"""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, field
from typing import Any

from renderer.errors import MillpondError
from renderer.query import RESERVED, parse_query
from service.fields import frame_fields


class Usage(MillpondError):
    """The command line can't be understood."""


class HelpWanted(Exception):
    """``--help`` was given."""


@dataclass(frozen=True)
class Option:
    """An option of a command."""

    name: str
    metavar: str
    """What its value is called; empty for a switch, which takes none."""
    text: str


@dataclass
class Arguments:
    """A command line, taken apart."""

    positional: list[str] = field(default_factory=list)
    own: dict[str, str] = field(default_factory=dict)
    """The command's own options; a switch that is given has an empty value."""
    fields: list[tuple[str, str]] = field(default_factory=list)
    """All other options, their names as a URL has them."""

    def number(self, name: str, default: int) -> int:
        """A whole number from 1 up."""
        text = self.own.get(name)
        if text is None:
            return default
        if not text.isdecimal() or int(text) < 1:
            raise Usage(f"--{name} takes a whole number from 1 up, not {text!r}")
        return int(text)

    def choice(self, name: str, choices: Sequence[str]) -> str:
        """One of the words, the first where nothing is said."""
        text = self.own.get(name, choices[0])
        if text not in choices:
            raise Usage(f"--{name} takes {', '.join(choices[:-1])} or {choices[-1]}, not {text!r}")
        return text

    def frame_fields(self) -> dict[str, Any]:
        """The frame's fields, nested as in JSON."""
        for name, _ in self.fields:
            if name in RESERVED:
                raise Usage(f"--{name} is no field of a frame")
        return parse_query(self.fields)

    def refuse_fields(self) -> None:
        """Refuse options that the command does not have."""
        if self.fields:
            raise Usage(f"there is no option --{self.fields[0][0]}")


def take_apart(arguments: Sequence[str], options: Sequence[Option]) -> Arguments:
    """Sort a command line into positionals, the command's own options, and fields.

    Raises ``Usage`` for a missing value or a repeated option, ``HelpWanted`` for ``--help``.
    """
    known = {option.name: option for option in options}
    found = Arguments()
    words = list(arguments)
    while words:
        word = words.pop(0)
        if word in {"-h", "--help"}:
            raise HelpWanted
        if not word.startswith("--"):
            found.positional.append(word)
            continue
        name, has_value, value = word[2:].partition("=")
        option = known.get(name)
        if option is not None and not option.metavar:
            if has_value:
                raise Usage(f"--{name} takes no value")
        elif not has_value:
            if not words:
                raise Usage(f"--{name} needs a value")
            value = words.pop(0)
        if option is None:
            found.fields.append((name.replace("-", "_"), value))
        elif name in found.own:
            raise Usage(f"--{name} is given twice")
        else:
            found.own[name] = value
    return found


def help_text(usage: str, summary: str, options: Sequence[Option], *, has_fields: bool) -> str:
    """The answer to ``--help``."""
    lines = [f"usage: {usage}", "", summary, "", "options:"]
    lines += [f"  --{option.name} {option.metavar}".rstrip().ljust(27) + f" {option.text}" for option in options]
    if has_fields:
        lines += [
            "",
            "fields of the frame (a name alone also stands for its defaults: --water luna, --sky gradient):",
        ]
        for facts in frame_fields():
            lines.append(f"  --{facts.path.replace('_', '-')}  [{facts.line()}]")
            if facts.description:
                lines.append(f"      {facts.description}")
    return "\n".join(lines)


def overlaid(below: Mapping[str, Any], above: Mapping[str, Any]) -> dict[str, Any]:
    """The fields ``above`` laid over those ``below``, objects field by field."""
    merged = dict(below)
    for name, value in above.items():
        beneath = merged.get(name)
        both = isinstance(value, Mapping) and isinstance(beneath, Mapping)
        merged[name] = overlaid(beneath, value) if both else value  # type: ignore[arg-type]  # both are mappings
    return merged
