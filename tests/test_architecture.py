"""The house keeps its rules, and each rule is seen to find a violation that was planted."""

from __future__ import annotations

import shutil
from collections.abc import Callable
from pathlib import Path

import pytest

from tests import house_rules as rules

ROOT = Path(__file__).resolve().parents[1]
OPENGL = {"moderngl", "glcontext"}
WEB = {"fastapi", "starlette", "uvicorn"}

Rule = Callable[[Path], list[str]]
RULES: tuple[Rule, ...] = (
    rules.long_files,
    rules.addresses_in_locks,
    rules.unlocked,
    rules.unexplained_dependencies,
    rules.unlisted_packages,
    rules.uncited,
    rules.bad_names,
    rules.unreasoned,
)

# What is planted, as "file: text that is added to it", and what the rule must then say.
PLANTED: tuple[tuple[Rule, str, str, str], ...] = (
    (rules.long_files, "renderer/camera.py", "\n" * 300, "renderer/camera.py: "),
    (rules.long_files, "shaders/lib/new.glsl", "// line\n" * 301, "shaders/lib/new.glsl: "),
    (rules.addresses_in_locks, "requirements.txt", "--index-url https://example.org/simple\n", "requirements.txt:"),
    (rules.addresses_in_locks, "requirements-dev.txt", "six @ file:/wheels/six.whl\n", "requirements-dev.txt:"),
    (rules.unlocked, "requirements.txt", "six==1.0\n", "six has no hash"),
    (rules.unlisted_packages, "renderer/attic/__init__.py", "", "renderer.attic"),
    (rules.uncited, "renderer/camera.py", '"""See Nobody & Noone 1999, section 2."""\n', "Nobody & Noone 1999"),
    (rules.uncited, "shaders/lib/new.glsl", "// Nobody et al.\n// 1999, equation 2\n", "Nobody et al. 1999"),
    (rules.uncited, "renderer/camera.py", "# Nobody n.d., section 3\n", "Nobody n.d."),
    (rules.bad_names, "service/utils.py", "", "service/utils.py: says nothing"),
    (rules.bad_names, "renderer/camera.py", "def get_eye(): ...\n", "get_eye"),
    (rules.unreasoned, "renderer/camera.py", "x = 1  # noqa: S101\n", "# noqa: S101"),
)

# Contract, file, import planted in it.
BROKEN: tuple[tuple[str, str, str], ...] = (
    ("houses", "renderer/camera.py", "import service.settings"),
    ("renderer-floors", "renderer/units.py", "import renderer.request"),
    ("renderer-floors", "renderer/attic.py", ""),
    ("passes", "renderer/passes/sky.py", "import renderer.passes.water"),
    ("techniques", "renderer/water/luna.py", "import renderer.water.catalogue"),
    ("service-floors", "service/settings.py", "import service.app"),
    ("service-floors", "service/attic.py", ""),
    ("circles", "renderer/scene/mesh.py", "import renderer.scene.catalogue"),
    ("opengl", "renderer/water/luna.py", "import moderngl"),
    ("http", "service/worker.py", "from starlette.responses import Response"),
    ("drawing", "service/frames.py", "import renderer.pipeline"),
    ("client", "service/client/__init__.py", "import renderer.camera"),
    ("client", "service/client/__init__.py", "from ..settings import Settings"),
    ("one-name", "service/app.py", "import service.client"),
)


def named(value: object) -> str | None:
    return getattr(value, "__name__", None)


@pytest.fixture
def copy(tmp_path: Path) -> Path:
    """A copy of all that the rules read, to plant something in."""
    unread = shutil.ignore_patterns("__pycache__", "golden", "*.png")
    for name in (*rules.HOUSES, "docs"):
        shutil.copytree(ROOT / name, tmp_path / name, ignore=unread)
    for path in (ROOT / "pyproject.toml", *ROOT.glob("requirements*.txt")):
        shutil.copy(path, tmp_path)
    return tmp_path


def plant(root: Path, place: str, text: str) -> None:
    path = root / place
    path.parent.mkdir(parents=True, exist_ok=True)
    path.write_text((path.read_text() if path.exists() else "") + "\n" + text)


@pytest.mark.parametrize("rule", RULES, ids=named)
def test_this_checkout_keeps_the_rule(rule: Rule) -> None:
    assert rule(ROOT) == []


@pytest.mark.parametrize(("rule", "place", "text", "finding"), PLANTED, ids=named)
def test_a_planted_violation_is_found(rule: Rule, place: str, text: str, finding: str, copy: Path) -> None:
    plant(copy, place, text)
    before = rule(ROOT)
    found = [line for line in rule(copy) if line not in before]

    assert len(found) == 1
    assert finding in found[0]


def test_a_dependency_without_a_pin_and_a_reason_is_found(copy: Path) -> None:
    path = copy / "pyproject.toml"
    path.write_text(path.read_text().replace('"alembic",', '"alembic", "six[all]>=1.16",'))

    assert rules.unlocked(copy) == ["six is not locked"]
    assert rules.unexplained_dependencies(copy) == ["six"]


def test_an_ignored_rule_without_a_reason_is_found(copy: Path) -> None:
    path = copy / "pyproject.toml"
    path.write_text(path.read_text().replace("ignore = [", 'ignore = [\n  "D100",', 1))

    assert '"D100",' in rules.unreasoned(copy)


def test_every_rule_has_a_planted_violation() -> None:
    planted = {rule for rule, *_ in PLANTED} | {rules.unexplained_dependencies}

    assert planted == set(RULES)


def test_imports_keep_their_contracts() -> None:
    assert rules.broken_contracts(ROOT) == ""


@pytest.mark.parametrize(("contract", "place", "line"), BROKEN)
def test_a_planted_import_breaks_its_contract(contract: str, place: str, line: str, copy: Path) -> None:
    plant(copy, place, line)

    assert "BROKEN" in rules.broken_contracts(copy, contract)


def test_every_contract_has_a_planted_violation() -> None:
    assert {contract for contract, *_ in BROKEN} == rules.contracts(ROOT)


def test_describing_a_frame_loads_no_opengl() -> None:
    assert rules.loaded_by(ROOT, "import renderer.request, renderer.query", OPENGL | WEB | {"service"}) == []


def test_the_client_loads_nothing_of_ours() -> None:
    assert rules.loaded_by(ROOT, "import millpond", OPENGL | WEB | {"renderer", "service", "pydantic"}) == []


def test_a_loaded_package_is_found(tmp_path: Path) -> None:
    (tmp_path / "describing.py").write_text("import colorsys")

    assert rules.loaded_by(tmp_path, "import describing", {"colorsys", "moderngl"}) == ["colorsys"]
    assert "No module" in rules.loaded_by(tmp_path, "import nothing_there", set())[0]
