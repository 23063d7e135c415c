from __future__ import annotations

from collections.abc import Callable, Iterator
from pathlib import Path

import pytest

from renderer.blocks import Block
from renderer.errors import ShaderError
from renderer.gpu import source
from renderer.gpu.source import SHADERS, VERSION, preprocess
from renderer.units import Number
from tests.renderer.drawing import shared_renderer

Write = Callable[[dict[str, str]], None]


class Ripple(Block):
    """A block to include."""

    height: Number = 1.0
    """How high."""


@pytest.fixture
def write(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> Iterator[Write]:
    """Puts files where shaders are looked for."""
    monkeypatch.setattr(source, "SHADERS", tmp_path)
    source._read.cache_clear()

    def put(files: dict[str, str]) -> None:
        for name, text in files.items():
            (tmp_path / name).parent.mkdir(parents=True, exist_ok=True)
            (tmp_path / name).write_text(text)

    yield put
    source._read.cache_clear()


def code(text: str) -> list[str]:
    return [line for line in text.split("\n")[1:] if line.strip()]


def test_includes_nest_and_are_spliced_once(write: Write) -> None:
    write(
        {
            "main.vert": '#include "lib/a.glsl"\n#include "lib/b.glsl"\nvoid main() {}\n',
            "lib/a.glsl": '#include "lib/b.glsl"\nfloat a() { return b(); }',
            "lib/b.glsl": '#include "lib/c.glsl"\nfloat b() { return c(); }',
            "lib/c.glsl": "float c() { return 1.0; }",
        }
    )

    assert code(preprocess("main.vert").text) == [
        "float c() { return 1.0; }",
        "float b() { return c(); }",
        "float a() { return b(); }",
        "void main() {}",
    ]


def test_files_that_include_each_other_end(write: Write) -> None:
    write({"a.glsl": '#include "b.glsl"\nint a;', "b.glsl": '#include "a.glsl"\nint b;'})

    assert code(preprocess("a.glsl").text) == ["int b;", "int a;"]


def test_an_include_in_a_comment_is_none(write: Write) -> None:
    write(
        {"main.vert": '// #include "gone.glsl"\n/* #include <None>\n#include "gone.glsl" */ int kept; // e\nint next;'}
    )
    spliced = preprocess("main.vert")

    assert code(spliced.text) == [" int kept; ", "int next;"]
    assert spliced.origin[-1] == ("main.vert", 4), "comments keep the lines' numbers"


def test_an_include_may_carry_a_comment_and_spaces(write: Write) -> None:
    write({"main.vert": '  #  include   "a.glsl"   // why\n', "a.glsl": "int a;"})

    assert code(preprocess("main.vert").text) == ["int a;"]


def test_names_stand_for_blocks_and_files(write: Write) -> None:
    write({"main.vert": "#include <Ripple>\n#include <technique>\n#include <Ripple>\n", "water/sea.glsl": "int sea;"})
    spliced = preprocess("main.vert", blocks=[Ripple], aliases={"technique": "water/sea.glsl"})

    assert code(spliced.text) == [*Ripple.glsl().split("\n"), "int sea;"]
    assert ("<Ripple>", 3) in spliced.origin


def test_defines_stand_before_everything(write: Write) -> None:
    write({"main.vert": "int a;"})

    assert preprocess("main.vert", defines=["HAS_FOG", "STEPS 3"]).text.split("\n")[:3] == [
        VERSION,
        "#define HAS_FOG",
        "#define STEPS 3",
    ]


def test_a_name_that_stands_for_nothing_is_an_error_with_its_line(write: Write) -> None:
    write({"main.vert": "int a;\n#include <Riple>\n"})

    with pytest.raises(ShaderError, match=r"main\.vert:2: nothing is called <Riple>"):
        preprocess("main.vert", blocks=[Ripple])


@pytest.mark.parametrize("name", ["gone.glsl", "../pyproject.toml", "/etc/hostname", "lib"])
def test_files_that_are_no_shaders_are_refused(write: Write, name: str) -> None:
    write({"main.vert": f'#include "{name}"\n', "lib/a.glsl": "int a;"})

    with pytest.raises(ShaderError, match="no shader file"):
        preprocess("main.vert")


@pytest.mark.parametrize(
    ("log", "explained"),
    [
        ("0:4(22): error: `x' undeclared", "water/bad.glsl:2(22): error: `x' undeclared"),
        ("0(4) : error C1503: undefined variable", "water/bad.glsl:2 : error C1503: undefined variable"),
        ("ERROR: 0:4: 'x' : undeclared identifier", "ERROR: water/bad.glsl:2: 'x' : undeclared identifier"),
        ("0:999(1): error: past the end", "0:999(1): error: past the end"),
    ],
)
def test_every_drivers_line_numbers_become_ours(write: Write, log: str, explained: str) -> None:
    write({"main.vert": '#include "water/bad.glsl"\n', "water/bad.glsl": "int a;\nint b = x;\n"})

    assert preprocess("main.vert", defines=["ONE"]).explain(log) == explained


def test_the_drivers_complaint_names_file_and_line(write: Write) -> None:
    write(
        {
            "passes/bad.vert": '#include "lib/good.glsl"\n#include "water/bad.glsl"\nvoid main(){gl_Position = bad();}',
            "lib/good.glsl": "// Fine.\nfloat good(float x)\n{\n    return x;\n}\n",
            "water/bad.glsl": '#include "lib/good.glsl"\nvec4 bad() { return vec4(missing); }\n',
        }
    )
    device = shared_renderer().device

    with pytest.raises(ShaderError, match=r"water/bad\.glsl:2\b.*missing"):
        device.program("passes/bad.vert", None, varyings=("gl_Position",))


def test_a_fragment_shaders_error_is_told_with_its_own_lines(write: Write) -> None:
    write(
        {
            "passes/a.vert": "\n\n\nvoid main() { gl_Position = vec4(0.0); }\n",
            "passes/a.frag": "out vec4 color;\nvoid main()\n{\n    color = nowhere;\n}\n",
        }
    )
    device = shared_renderer().device

    with pytest.raises(ShaderError, match=r"passes/a\.frag:4\b.*nowhere"):
        device.program("passes/a.vert", "passes/a.frag")


def test_no_include_hides_behind_a_condition_that_another_needs() -> None:
    """A file is spliced once, where it is asked for first: inside `#if` that may be nowhere."""
    for path in SHADERS.rglob("*.*"):
        if path.suffix not in {".glsl", ".vert", ".frag", ".comp"}:
            continue
        depth, hidden = 0, set()
        for number, line in enumerate(path.read_text().split("\n"), 1):
            word = line.strip().removeprefix("#").strip()
            depth += line.startswith("#") and word.startswith("if")
            depth -= line.startswith("#") and word.startswith("endif")
            if match := source.INCLUDE.match(line):
                asked = match["file"] or match["name"]
                assert depth or asked not in hidden, f"{path.name}:{number}: {asked} was first asked for inside #if"
                hidden |= {asked} if depth else set()
