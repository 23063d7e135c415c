"""Meshes and uniform blocks on the device."""

from __future__ import annotations

from typing import TYPE_CHECKING

import moderngl

from renderer.blocks import Block
from renderer.scene.mesh import VERTEX, Mesh

if TYPE_CHECKING:
    from renderer.gpu.device import Device
    from renderer.gpu.program import Program

FORMATS = {"position": "3f4", "normal": "3f4", "uv": "2f4", "color": "4f2"}


class Geometry:
    """A mesh on the device; its vertex arrays are made once for each program."""

    def __init__(self, device: Device, mesh: Mesh) -> None:
        device.check_thread()
        self.device = device
        self.low, self.high = mesh.bounds
        self.triangles = len(mesh.index)
        self._vertices = device.context.buffer(mesh.vertices().tobytes() or b"\0" * VERTEX.itemsize)
        self._indices = device.context.buffer(mesh.index.tobytes() or b"\0" * 12)
        self._arrays: dict[int, moderngl.VertexArray] = {}
        device.live += 2

    def draw(self, program: Program) -> None:
        """Draw all triangles."""
        if not self.triangles:
            return
        key = id(program)
        if key not in self._arrays:
            used = program.attributes()
            layout = " ".join(
                form if name in used else f"{int(form[0]) * int(form[-1])}x" for name, form in FORMATS.items()
            )
            names = [name for name in FORMATS if name in used]
            self._arrays[key] = self.device.context.vertex_array(
                program.program,
                [(self._vertices, layout, *names)],
                index_buffer=self._indices,
            )
        self._arrays[key].render(moderngl.TRIANGLES, vertices=3 * self.triangles)

    def release(self) -> None:
        """Free the buffers."""
        for array in self._arrays.values():
            array.release()
        self._vertices.release()
        self._indices.release()
        self.device.live -= 2


class Screen:
    """A triangle that covers the target; the vertex stage makes its corners from their numbers."""

    def __init__(self, device: Device) -> None:
        self.device = device
        self._arrays: dict[int, moderngl.VertexArray] = {}

    def draw(self, program: Program, vertices: int = 3) -> None:
        """Run the program with this many vertices and no attributes."""
        array = self._arrays.get(id(program))
        if array is None:
            array = self._arrays[id(program)] = self.device.context.vertex_array(program.program, [])
        array.render(moderngl.TRIANGLES, vertices=vertices)


class Uniforms:
    """A uniform block on the device."""

    def __init__(self, device: Device, block: Block) -> None:
        device.check_thread()
        self.device = device
        self._name = block.glsl_name()
        self._buffer = device.context.buffer(block.pack())
        device.live += 1

    def write(self, block: Block) -> None:
        """Replace the values: always, so that no frame rests on what an earlier one is believed to have written."""
        self._buffer.orphan()
        self._buffer.write(block.pack())

    def bind(self) -> None:
        """Let every program read these values under the block's name."""
        self._buffer.bind_to_uniform_block(self.device.binding(self._name))

    def release(self) -> None:
        """Free the buffer."""
        self._buffer.release()
        self.device.live -= 1
