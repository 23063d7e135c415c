"""From linear light to the bytes of the picture."""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from renderer.errors import DrawError
from renderer.gpu.device import Device
from renderer.gpu.geometry import Screen
from renderer.gpu.target import Target
from renderer.light import ToneMap


class CompositePass:
    """Averages sub-frames, maps tones, dithers, and reads the bytes back with the top row first."""

    def __init__(self, device: Device) -> None:
        self.device = device
        self._screen = Screen(device)
        self._query = device.context.query(samples=True)

    def accumulate(self, picture: Target, sum_target: Target, share: float, *, first: bool) -> None:
        """Add a sub-frame's share, in linear light and 32-bit floats."""
        sum_target.begin((0.0, 0.0, 0.0, 0.0) if first else None)
        program = self.device.program("passes/screen.vert", "passes/accumulate.frag")
        program.bind({"picture_map": picture.texture})
        program["share"] = share
        context = self.device.context
        context.enable_only(context.BLEND)
        context.blend_func = context.ONE, context.ONE
        self._screen.draw(program)
        context.disable(context.BLEND)

    def blank(self, target: Target, other: Target) -> None:
        """Make the colour black and keep the depth; ``other`` is any texture but the target's own."""
        target.begin(None)
        program = self.device.program("passes/screen.vert", "passes/accumulate.frag")
        program.bind({"picture_map": other.texture})
        program["share"] = 0.0
        self.device.context.enable_only(0)
        self._screen.draw(program)

    def encode(
        self,
        picture: Target,
        output: Target,
        tonemap: ToneMap,
        *,
        is_data: bool = False,
    ) -> NDArray[np.uint8]:
        """The picture as (height, width, 3) bytes; ``is_data`` keeps values as they are, 0..1 to 0..255."""
        output.begin()
        names = ["ENCODES_DATA" if is_data else f"TONEMAP_{tonemap.operator.upper()}"]
        if picture.size != output.size:
            names.append("HAS_OTHER_SIZE")
        program = self.device.program("passes/screen.vert", "passes/composite.frag", defines=names)
        program.bind({"picture_map": picture.texture})
        program["size"] = tuple(float(side) for side in output.size)
        program["exposure"] = 2.0**tonemap.exposure
        self.device.context.enable_only(0)
        with self._query:
            self._screen.draw(program)
        pixels = output.read().astype(np.uint8, copy=False)
        self.device.check_errors("composite pass")
        if self._query.samples < output.size[0] * output.size[1]:
            raise DrawError("the driver left pixels of the picture undrawn")
        return pixels
