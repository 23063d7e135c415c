"""The page on the documents is whole: each of its rows is there, and what it names in code and tests exists."""

from __future__ import annotations

import ast
import re
from collections.abc import Iterator
from functools import cache
from pathlib import Path
from typing import NamedTuple

import pytest

ROOT = Path(__file__).resolve().parents[1]
PAGE = ROOT / "docs" / "documents.md"
SECTIONS = {"L": 18, "K": 24, "E": 10, "R": 18}
"""How many rows each document has: Luna's, the lake's, its edges', Rastertek's."""
EXPECTED = [f"{letter}{number}" for letter, count in SECTIONS.items() for number in range(1, count + 1)]
SOURCES = {".py", ".glsl", ".vert", ".frag"}
ROW = re.compile(r"^\| *(?P<row>[A-Z]\d+) *\|(?P<cells>.*)\|$", re.MULTILINE)
QUOTED = re.compile(r"`([^`]+)`")


class Row(NamedTuple):
    """One row of the page."""

    name: str
    says: str
    places: list[str]
    tests: list[str]


def rows(text: str) -> list[Row]:
    """The rows of the page's tables, in their order."""
    found = []
    for match in ROW.finditer(text):
        says, where, test = (cell.strip() for cell in match["cells"].split("|"))
        found.append(Row(match["row"], says, QUOTED.findall(where), QUOTED.findall(test)))
    return found


@cache
def names(path: Path) -> frozenset[str]:
    """What a Python file defines: functions, classes, and constants, and ``Class.member``."""
    return frozenset(_defined(ast.parse(path.read_text(encoding="utf-8")).body, ""))


def _defined(body: list[ast.stmt], prefix: str) -> Iterator[str]:
    for node in body:
        if isinstance(node, ast.FunctionDef | ast.AsyncFunctionDef | ast.ClassDef):
            yield prefix + node.name
        if isinstance(node, ast.ClassDef):
            yield from _defined(node.body, f"{prefix}{node.name}.")
        targets = (
            node.targets if isinstance(node, ast.Assign) else [node.target] if isinstance(node, ast.AnnAssign) else []
        )
        yield from (prefix + target.id for target in targets if isinstance(target, ast.Name))


def exists(place: str) -> bool:
    """Whether ``file:name`` or ``file`` is in the checkout: names of Python as defined, of shaders as words."""
    file, _, name = place.partition(":")
    path = ROOT / file
    if not path.is_file() or path.suffix not in SOURCES:
        return False
    if path.suffix == ".py":
        return not name or name in names(path)
    return bool(re.search(rf"\b{re.escape(name)}\b", path.read_text(encoding="utf-8")))


def is_test(reference: str) -> bool:
    """Whether ``file::name`` is a test of the checkout."""
    file, _, name = reference.partition("::")
    path = ROOT / file
    return path.is_file() and name.startswith("test_") and name in names(path)


TABLE = {row.name: row for row in rows(PAGE.read_text(encoding="utf-8"))}


def test_every_row_of_every_document_stands_once_and_in_order() -> None:
    assert [row.name for row in rows(PAGE.read_text(encoding="utf-8"))] == EXPECTED


@pytest.mark.parametrize("name", EXPECTED)
def test_a_row_says_something_and_names_code_and_tests_that_exist(name: str) -> None:
    row = TABLE[name]

    assert len(row.says) > 30, "says what the document says"
    assert row.places, "names code"
    assert row.tests, "names a test"
    assert [place for place in row.places if not exists(place)] == []
    assert [test for test in row.tests if not is_test(test)] == []


@pytest.mark.parametrize(
    ("place", "is_there"),
    [
        ("renderer/water/luna.py:Luna.maps", True),
        ("renderer/water/luna.py:Luna.ripple_scale", True),
        ("renderer/water/luna.py:maps", False),
        ("renderer/water/luna.py:Moon", False),
        ("renderer/water/moon.py:Luna", False),
        ("shaders/water/luna.glsl:shade_water", True),
        ("shaders/water/luna.glsl:shade_wat", False),
        ("docs/documents.md:L1", False),
    ],
)
def test_a_place_is_found_where_it_is_and_only_there(place: str, is_there: bool) -> None:
    assert exists(place) == is_there


@pytest.mark.parametrize(
    ("reference", "is_there"),
    [
        ("tests/test_documents.py::test_a_place_is_found_where_it_is_and_only_there", True),
        ("tests/test_documents.py::test_nothing", False),
        ("tests/test_documents.py::exists", False),
        ("tests/test_nothing.py::test_nothing", False),
    ],
)
def test_a_test_is_found_where_it_is_and_only_there(reference: str, is_there: bool) -> None:
    assert is_test(reference) == is_there
