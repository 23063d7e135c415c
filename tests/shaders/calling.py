"""Calling one GLSL function on arrays: transform feedback brings its results back bit by bit."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from contextlib import ExitStack
from functools import cache
from typing import Any

import moderngl
import numpy as np
from numpy.typing import NDArray

from renderer.blocks import Block
from renderer.gpu.device import Device
from renderer.gpu.geometry import Uniforms
from renderer.gpu.program import Bindable, Program
from renderer.gpu.source import preprocess
from renderer.gpu.target import Target
from tests.renderer.drawing import shared_renderer

RESULTS: dict[str, tuple[str, int]] = {
    "float": ("f4", 1),
    "vec2": ("f4", 2),
    "vec3": ("f4", 3),
    "vec4": ("f4", 4),
    "uint": ("u4", 1),
    "int": ("i4", 1),
}


def call(
    file: str,
    expression: str,
    result: str = "float",
    *,
    defines: Sequence[str] = (),
    blocks: Sequence[Block] = (),
    textures: Mapping[str, Bindable] | None = None,
    aliases: Mapping[str, str] | None = None,
    **arguments: Any,
) -> NDArray[Any]:
    """The values of a GLSL expression over a shader library, one for each row of the arguments.

    ``arguments`` are the names that the expression uses: numbers, (n,) or (n, 2..4) arrays; floats become 32-bit
    floats, unsigned integers ``uint``. ``blocks`` hold the uniform blocks that the library includes. Returns (n,) or
    (n, k).
    """
    device = shared_renderer().device
    device.check_thread()
    arrays = {name: _as_attribute(value) for name, value in arguments.items()}
    count = max(len(array) for array in arrays.values())
    arrays = {name: np.ascontiguousarray(np.broadcast_to(a, (count, a.shape[1]))) for name, a in arrays.items()}
    library = preprocess(file, defines=defines, blocks=[type(block) for block in blocks], aliases=aliases)
    lines = [f"in {_type(array)} {name};" for name, array in arrays.items()]
    lines += [f"out {result} call_result;", "void main()", "{", f"    call_result = {expression};", "}"]
    source = "\n".join([library.text, *lines])
    dtype, width = RESULTS[result]
    with ExitStack() as owned:
        raw = device.context.program(vertex_shader=source, varyings=("call_result",))
        owned.callback(raw.release)
        program = Program(device.binding, raw)
        program.bind(textures or {})
        for block in blocks:
            uniforms = Uniforms(device, block)
            owned.callback(uniforms.release)
            uniforms.bind()
        data = _run(device, raw, arrays, 4 * width * count)
    values = np.frombuffer(data, f"<{dtype}").reshape(count, width)
    return values[:, 0] if width == 1 else values


def _run(device: Device, program: moderngl.Program, arrays: Mapping[str, NDArray[Any]], size: int) -> bytes:
    context = device.context
    used = [name for name in arrays if name in program]  # what the expression doesn't need, the compiler drops
    count = len(next(iter(arrays.values())))
    with ExitStack() as owned:
        feedback_target(device).begin()
        content = []
        for name in used:
            buffer = context.buffer(arrays[name].tobytes())
            owned.callback(buffer.release)
            content.append((buffer, f"{arrays[name].shape[1]}{arrays[name].dtype.str[1:]}", name))
        output = context.buffer(reserve=size)
        owned.callback(output.release)
        array = context.vertex_array(program, content)
        owned.callback(array.release)
        array.transform(output, moderngl.POINTS, vertices=count)
        device.check_errors("transform feedback")
        return bytes(output.read())


@cache
def feedback_target(device: Device) -> Target:
    """What is bound while feedback runs: without a framebuffer Mesa feeds nothing back."""
    return Target(device, (1, 1), has_depth=False)


def _as_attribute(value: Any) -> NDArray[Any]:
    array = np.asarray(value)
    array = array.astype(
        np.float32 if array.dtype.kind == "f" else np.uint32 if array.dtype.kind == "u" else np.float32
    )
    return array.reshape(1, 1) if array.ndim == 0 else array.reshape(len(array), -1)


def _type(array: NDArray[Any]) -> str:
    is_unsigned, width = array.dtype.kind == "u", array.shape[1]
    if width == 1:
        return "uint" if is_unsigned else "float"
    return f"{'u' if is_unsigned else ''}vec{width}"
