"""The rules of the house as functions: each takes a checkout's root and returns what breaks the rule, in words.

`test_architecture.py` asks them of this checkout, where they must find nothing, and of planted violations, which they
must find. Who may import whom is import-linter's part (pyproject.toml); what it cannot see is here.
"""

from __future__ import annotations

import ast
import os
import re
import subprocess
import sys
import tomllib
import unicodedata
from collections.abc import Iterator
from pathlib import Path
from typing import Any

CEILING = 300
"""Lines of one file; past it a file is probably two rooms."""

HOUSES = ("renderer", "service", "shaders", "tests")
CODE = {".py", ".vert", ".frag", ".comp", ".glsl", ".js", ".css", ".html"}
SHADERS = {".vert", ".frag", ".comp", ".glsl"}
FORBIDDEN_NAMES = {"utils", "util", "helpers", "helper", "common", "misc"}
FORBIDDEN_PREFIXES = ("get_", "do_")

ADDRESS = re.compile(r"://|\bfile:|--(?:extra-)?index-url|--find-links|--trusted-host|\s@\s")
NOQA = re.compile(r"#\s*noqa:\s*[A-Z]+[0-9]+(?:,\s*[A-Z]+[0-9]+)*(?P<reason>.*)")

# "Luna 2006", "Bruneton & Neyret 2008", "Evans, Kirkpatrick and Townsend 2001", "Wyman et al. 2013", "Rastertek n.d."
NAME = r"[A-ZÅÄÖØÉ][A-Za-zÀ-ÿ'-]+"
CITATION = re.compile(
    rf"(?<![\w.-])(?P<first>{NAME})(?:(?:,|,? &|,? and) {NAME})*(?: et al\.)?,? "
    r"\(?(?P<year>(?:19|20)\d\d[a-z]?|n\.d\.)(?!\w)"
)
ENTRY = re.compile(rf"^- \*\*{CITATION.pattern}.*?\*\*", re.MULTILINE)
NOT_AUTHORS = re.compile(
    "January|February|March|April|May|June|July|August|September|October|November|December"
    "|In|Since|Until|Copyright|SIGGRAPH|Debian|Mesa|Python|Version"
)


def files(root: Path, suffixes: set[str]) -> Iterator[Path]:
    """The house's own files of these kinds."""
    for house in HOUSES:
        yield from sorted(path for path in (root / house).rglob("*") if path.suffix in suffixes and path.is_file())


def long_files(root: Path) -> list[str]:
    """Files over the ceiling."""
    lengths = {path: len(path.read_text().splitlines()) for path in files(root, CODE)}
    return [f"{path.relative_to(root)}: {length} lines" for path, length in lengths.items() if length > CEILING]


def loaded_by(root: Path, statement: str, packages: set[str]) -> list[str]:
    """Which of `packages` a fresh interpreter has loaded after `statement`."""
    program = f"{statement}; import sys; print(*sorted({packages!r} & {{name.split('.')[0] for name in sys.modules}}))"
    done = subprocess.run(
        [sys.executable, "-c", program],
        cwd=root,
        env={**os.environ, "PYTHONPATH": str(root), "PYTHONDONTWRITEBYTECODE": "1"},
        capture_output=True,
        text=True,
        check=False,
    )
    return done.stdout.split() if done.returncode == 0 else [done.stderr]


def broken_contracts(root: Path, *only: str) -> str:
    """import-linter's verdict on the contracts of pyproject.toml, "" where all hold."""
    command = [sys.executable, "-c", "from importlinter.cli import lint_imports_command as check; check()", "--no-logo"]
    named = [argument for contract in only for argument in ("--contract", contract)]
    done = subprocess.run([*command, "--no-cache", *named], cwd=root, capture_output=True, text=True, check=False)
    return "" if done.returncode == 0 else done.stdout + done.stderr


def contracts(root: Path) -> set[str]:
    """The ids of all contracts."""
    return {contract["id"] for contract in project(root)["tool"]["importlinter"]["contracts"]}


def addresses_in_locks(root: Path) -> list[str]:
    """Lines of the locks that say where packages come from."""
    return [
        f"{lock.name}:{number}: {line.strip()}"
        for lock in sorted(root.glob("requirements*.txt"))
        for number, line in enumerate(lock.read_text().splitlines(), 1)
        if ADDRESS.search(line)
    ]


def unlocked(root: Path) -> list[str]:
    """Dependencies of pyproject.toml without a pinned and hashed line in the lock, and pins without a hash."""
    lock = (root / "requirements.txt").read_text()
    pins = dict(re.findall(r"^([a-z0-9-]+)==\S+( \\\n\s+--hash=sha256:[0-9a-f]{64})?", lock, re.MULTILINE))
    missing = [f"{name} is not locked" for name in dependencies(root) if name not in pins]
    return missing + [f"{name} has no hash" for name, digest in pins.items() if not digest]


def unexplained_dependencies(root: Path) -> list[str]:
    """Runtime dependencies of which docs/decisions.md does not tell why."""
    text = (root / "docs" / "decisions.md").read_text()
    return [name for name in dependencies(root) if f"`{name}`" not in text]


def dependencies(root: Path) -> list[str]:
    """The names of the runtime dependencies, without extras and versions."""
    return [re.split(r"[\[<>=!~ ]", line)[0] for line in project(root)["project"]["dependencies"]]


def unlisted_packages(root: Path) -> list[str]:
    """Folders of Python that pyproject.toml does not install, and names there without a folder."""
    sources = [*(root / "renderer").rglob("*.py"), *(root / "service").rglob("*.py")]
    folders = {path.parent.relative_to(root) for path in sources}
    names = {".".join(folder.parts) for folder in folders if "migrations" not in folder.parts}
    names = {re.sub(r"^service\.client", "millpond", name) for name in names} | {"shaders"}
    return sorted(names ^ set(project(root)["tool"]["setuptools"]["packages"]))


def uncited(root: Path) -> list[str]:
    """Citations in code whose entry is not in docs/references.md, compared by first author and year."""
    entries = {key(match) for match in ENTRY.finditer((root / "docs" / "references.md").read_text())}
    return [
        f"{path.relative_to(root)}: {match[0]}"
        for path in files(root, {".py"} | SHADERS)
        for match in CITATION.finditer(prose(path))
        if not NOT_AUTHORS.fullmatch(match["first"]) and key(match) not in entries
    ]


def key(citation: re.Match[str]) -> tuple[str, str]:
    """First author, without accents, and year."""
    plain = unicodedata.normalize("NFKD", citation["first"]).encode("ascii", "ignore").decode()
    return plain, citation["year"]


def prose(path: Path) -> str:
    """A file's docstrings and comments as running text: a citation may be broken over two lines."""
    text = path.read_text()
    if path.suffix in SHADERS:
        return " ".join(re.sub(r"^\s*(?://+|/?\*+/?)\s?", "", line).strip() for line in text.splitlines())
    docstrings = [
        node.value.value
        for node in ast.walk(ast.parse(text))
        if isinstance(node, ast.Expr) and isinstance(node.value, ast.Constant) and isinstance(node.value.value, str)
    ]
    comments = re.findall(r"(?:^|\s)#\s?(.*)$", text, re.MULTILINE)
    return " ".join(" ".join([*docstrings, *comments]).split())


def bad_names(root: Path) -> list[str]:
    """Files named after no subject, and functions named after no thing."""
    found = []
    for path in files(root, CODE):
        place = path.relative_to(root)
        if FORBIDDEN_NAMES & {part.split(".")[0] for part in place.parts}:
            found.append(f"{place}: says nothing")
        if path.suffix == ".py" and place.parts[0] != "tests":
            nodes = ast.walk(ast.parse(path.read_text()))
            functions = [node for node in nodes if isinstance(node, ast.FunctionDef | ast.AsyncFunctionDef)]
            found += [f"{place}:{f.lineno}: {f.name}" for f in functions if f.name.startswith(FORBIDDEN_PREFIXES)]
    return found


def unreasoned(root: Path) -> list[str]:
    """Exceptions from the linter without a reason beside them, in the code and in pyproject.toml."""
    found = [
        f"{path.relative_to(root)}:{number}: {match[0]}"
        for path in files(root, {".py"})
        for number, line in enumerate(path.read_text().splitlines(), 1)
        if (match := NOQA.search(line)) and not re.search(r"\w{2,}", match["reason"])
    ]
    ruff = (root / "pyproject.toml").read_text().split("[tool.ruff.lint]")[-1].split("[tool.mypy]")[0]
    return found + [line.strip() for line in ruff.splitlines() if re.match(r'\s+"[A-Z]+[0-9]*",?\s*$', line)]


def project(root: Path) -> dict[str, Any]:
    """pyproject.toml as data."""
    return tomllib.loads((root / "pyproject.toml").read_text())
