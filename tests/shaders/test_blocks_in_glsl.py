"""What Python packs is what a shader reads: every block that exists, and blocks that nobody would think of."""

from __future__ import annotations

import importlib
import pkgutil
from collections.abc import Iterator
from typing import Annotated, Any

import moderngl
import numpy as np
import pytest
from hypothesis import HealthCheck, given, settings
from hypothesis import strategies as st
from numpy.typing import NDArray
from pydantic import create_model

import renderer
from renderer.blocks import Block, Member
from renderer.gpu.geometry import Uniforms
from renderer.gpu.program import Program
from renderer.gpu.source import VERSION
from renderer.units import Glsl
from tests.renderer.drawing import shared_renderer
from tests.shaders.calling import feedback_target

WIDTH = {"float": 1, "int": 1, "vec2": 2, "vec3": 3, "vec4": 4, "mat4": 16}
COMPONENTS = 60
"""How many a driver surely feeds back at once."""


def read_back(block: Block) -> tuple[int, dict[str, NDArray[Any]]]:
    """The driver's size of the block, and each member's value as a shader reads it; matrices column by column."""
    values: dict[str, NDArray[Any]] = {}
    size = 0
    for members in _portions(block.members()):
        size, data = _run(block, members)
        for member in members:
            kind = "<i4" if member.glsl.type == "int" else "<f4"
            values[member.name] = np.frombuffer(data[: 4 * WIDTH[member.glsl.type]], kind)
            data = data[4 * WIDTH[member.glsl.type] :]
    return size, values


def _portions(members: tuple[Member, ...]) -> Iterator[list[Member]]:
    portion: list[Member] = []
    for member in members:
        if sum(WIDTH[m.glsl.type] for m in [*portion, member]) > COMPONENTS:
            yield portion
            portion = []
        portion.append(member)
    yield portion


def _run(block: Block, members: list[Member]) -> tuple[int, bytes]:
    device = shared_renderer().device
    feedback_target(device).begin()
    declared = [f"out {member.glsl.type} read_{member.name};" for member in members]
    copied = [f"    read_{member.name} = {block.instance_name()}.{member.name};" for member in members]
    source = "\n".join([VERSION, block.glsl(), *declared, "void main()", "{", *copied, "}"])
    raw = device.context.program(vertex_shader=source, varyings=tuple(f"read_{member.name}" for member in members))
    Program(device.binding, raw)
    uniforms = Uniforms(device, block)
    uniforms.bind()
    output = device.context.buffer(reserve=sum(4 * WIDTH[member.glsl.type] for member in members))
    array = device.context.vertex_array(raw, [])
    array.transform(output, moderngl.POINTS, vertices=1)
    data, told = bytes(output.read()), raw[block.glsl_name()]
    assert isinstance(told, moderngl.UniformBlock)
    size = told.size
    for owned in (array, output, raw, uniforms):
        owned.release()
    device.check_errors("block")
    return size, data


def check(block: Block) -> None:
    """Sizes agree, and every member is bit for bit what was declared."""
    size, values = read_back(block)

    assert size == block.size() == len(block.pack())
    for member in block.members():
        declared = np.asarray(getattr(block, member.name), np.float64) * member.glsl.scale
        if member.glsl.type == "mat4":
            declared = declared.reshape(4, 4).T
        expected = declared.astype("<i4" if member.glsl.type == "int" else "<f4").ravel()
        assert values[member.name].tobytes() == expected.tobytes(), member.name


def existing() -> list[type[Block]]:
    """Every block of the renderer that has members."""
    for module in pkgutil.walk_packages(renderer.__path__, "renderer."):
        if not module.name.endswith("__main__"):
            importlib.import_module(module.name)
    found: list[type[Block]] = []
    queue = [Block]
    while queue:
        for block in queue.pop().__subclasses__():
            queue.append(block)
            if block.__module__.startswith("renderer.") and block.members():
                found.append(block)
    return sorted(set(found), key=lambda block: block.__name__)


def filled(block: type[Block], seed: int) -> Block:
    """A block whose members all differ; validation is left out, layout is what counts."""
    rng = np.random.default_rng(seed)
    values: dict[str, Any] = {}
    for member in block.members():
        count = WIDTH[member.glsl.type]
        drawn = rng.uniform(-1e3, 1e3, count)
        flat = tuple(float(v) for v in drawn)
        values[member.name] = int(drawn[0]) if member.glsl.type == "int" else flat[0] if count == 1 else flat
    return block.model_construct(**values)


@pytest.mark.parametrize("block", existing(), ids=lambda block: block.__name__)
def test_a_shader_reads_what_the_declaration_says(block: type[Block]) -> None:
    check(filled(block, seed=3))


def test_there_are_blocks_to_check() -> None:
    assert {"ViewBlock", "LightBlock", "Luna", "WaterPlane", "Fog", "MaterialBlock"} <= {b.__name__ for b in existing()}


finite = st.floats(width=32, allow_nan=False, allow_infinity=False, allow_subnormal=False)
kinds = st.sampled_from(["float", "int", "vec2", "vec3", "vec4", "mat4"])


@st.composite
def blocks(draw: st.DrawFn) -> Block:
    """A block of members in any order, some of them angles, with any values."""
    fields: dict[str, Any] = {}
    values: dict[str, Any] = {}
    for number, kind in enumerate(draw(st.lists(kinds, min_size=1, max_size=9))):
        name, count = f"member_{number}", WIDTH[kind]
        if kind == "int":
            fields[name] = (Annotated[int, Glsl("int")], ...)
            values[name] = draw(st.integers(-(2**31), 2**31 - 1))
        elif kind == "float":
            fields[name] = (Annotated[float, Glsl("float", draw(st.sampled_from([1.0, np.pi / 180])))], ...)
            values[name] = draw(finite)
        else:
            fields[name] = (Annotated[tuple[float, ...], Glsl(kind)], ...)
            values[name] = tuple(draw(st.lists(finite, min_size=count, max_size=count)))
    made: type[Block] = create_model("Drawn", __base__=Block, **fields)
    return made(**values)


@settings(max_examples=60, suppress_health_check=[HealthCheck.too_slow])
@given(block=blocks())
def test_any_block_reads_back_bit_for_bit(block: Block) -> None:
    check(block)


class _Packed(Block):
    """A block whose author thought that members lie side by side."""

    first: Annotated[float, Glsl("float")]
    second: Annotated[tuple[float, float, float], Glsl("vec3")]

    def pack(self) -> bytes:
        return np.array([self.first, *self.second, 0, 0, 0, 0], "<f4").tobytes()


def test_a_block_packed_without_padding_is_caught() -> None:
    with pytest.raises(AssertionError, match="second"):
        check(_Packed(first=1.0, second=(2.0, 3.0, 4.0)))
