"""GLSL sources: includes spliced once, blocks generated, and a map back to the line that one wrote.

``#include "lib/fresnel.glsl"`` splices a file below ``shaders/``; ``#include <Luna>`` splices the std140
block of a declaration, or the file that a name stands for in this program (``<technique>``,
``<material>``). Each is spliced once. The driver's log then names ``water/luna.glsl:41``.
"""

from __future__ import annotations

import re
from collections.abc import Iterable, Mapping
from dataclasses import dataclass
from functools import cache

from renderer.blocks import Block
from renderer.errors import ShaderError
from renderer.source_digest import ROOT

SHADERS = ROOT / "shaders"
VERSION = "#version 450 core"
INCLUDE = re.compile(r'^\s*#\s*include\s+(?:"(?P<file>[^"]+)"|<(?P<name>\w+)>)\s*(?://.*)?$')
COMMENT = re.compile(r"//[^\n]*|/\*.*?\*/", re.DOTALL)
LOG_LINE = re.compile(r"\b(\d+):(\d+)(?=[(:])|\b\d+\((\d+)\)")
"""Where a driver's log names string and line: Mesa's ``0:15(22)``, NVIDIA's ``0(15)``."""


@dataclass(frozen=True)
class Source:
    """A program's text, and where each of its lines was written."""

    text: str
    origin: tuple[tuple[str, int], ...]

    def explain(self, log: str) -> str:
        """The driver's log with our files and lines in place of its numbers."""

        def place(match: re.Match[str]) -> str:
            line = int(match[2] or match[3])
            if not 1 <= line <= len(self.origin):
                return match[0]
            file, own = self.origin[line - 1]
            return f"{file}:{own}"

        return LOG_LINE.sub(place, log)


@cache
def _read(file: str) -> tuple[str, ...]:
    path = SHADERS / file
    if not path.resolve().is_relative_to(SHADERS) or not path.is_file():
        raise ShaderError(f"no shader file {file!r} below shaders/")
    text = path.read_text(encoding="utf-8")
    # Comments go, their line breaks stay: an include inside a comment is none, and lines keep their number.
    return tuple(COMMENT.sub(lambda m: "\n" * m[0].count("\n"), text).split("\n"))


def preprocess(
    file: str,
    *,
    defines: Iterable[str] = (),
    blocks: Iterable[type[Block]] = (),
    aliases: Mapping[str, str] | None = None,
) -> Source:
    """Splice a program's source.

    ``defines`` are ``NAME`` or ``NAME value``; ``blocks`` are what ``#include <Name>`` may name;
    ``aliases`` says which file a name stands for. Raises ``ShaderError`` for what cannot be found.
    """
    lines: list[str] = [VERSION, *(f"#define {define}" for define in defines)]
    origin: list[tuple[str, int]] = [("(generated)", 0)] * len(lines)
    known = {block.glsl_name(): block for block in blocks}
    names = dict(aliases or {})
    done: set[str] = set()

    def splice(current: str) -> None:
        if current in done:
            return
        done.add(current)
        for number, line in enumerate(_read(current), 1):
            match = INCLUDE.match(line)
            if match is None:
                lines.append(line)
                origin.append((current, number))
            elif match["file"]:
                splice(match["file"])
            elif match["name"] in names:
                splice(names[match["name"]])
            elif match["name"] in known:
                block(known[match["name"]])
            else:
                raise ShaderError(f"{current}:{number}: nothing is called <{match['name']}>")

    def block(declaration: type[Block]) -> None:
        name = declaration.glsl_name()
        if name in done:
            return
        done.add(name)
        text = declaration.glsl().split("\n")
        lines.extend(text)
        origin.extend((f"<{name}>", number) for number in range(1, len(text) + 1))

    splice(file)
    return Source("\n".join(lines), tuple(origin))
