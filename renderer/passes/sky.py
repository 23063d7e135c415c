"""The sky: exact where it is a formula, looked up in a baked table where it is air and clouds."""

from __future__ import annotations

from dataclasses import dataclass

from renderer.blocks import Block
from renderer.gpu.device import Device
from renderer.gpu.geometry import Screen, Uniforms
from renderer.gpu.program import Bindable
from renderer.gpu.target import Target
from renderer.light import Fog, LightBlock
from renderer.passes.view import ViewBlock
from renderer.request import FrameRequest
from renderer.scene.sky import (
    DEFINES,
    MULTIPLE_SIZE,
    SCATTERING_SIZE,
    TABLE_SIZE,
    AnalyticSky,
    ConstantSky,
    GradientSky,
    SkyLight,
    sky_light,
)

SKY_BLOCKS = (ConstantSky, GradientSky, AnalyticSky, SkyLight)
KEPT = 3
"""Tables that stay: 7 MB each."""


@dataclass(frozen=True, eq=False)
class Sky:
    """One sky, ready to be drawn."""

    blocks: tuple[Block, ...]
    define: str
    table: Bindable | None = None


class SkyPass:
    """Bakes skies, keeps the last few, and draws them behind everything."""

    def __init__(self, device: Device) -> None:
        self.device = device
        self._screen = Screen(device)
        self._uniforms: dict[str, Uniforms] = {}
        self._kept: dict[tuple[Block, ...], Target] = {}
        self._multiple: Target | None = None
        self._scattering: Target | None = None

    def prepare(self, request: FrameRequest) -> Sky:
        """The sky of a request; an analytic one is baked, or found where it was baked before."""
        sky, sun = request.sky, request.sun
        if isinstance(sky, ConstantSky):
            return Sky((sky,), "SKY_MODEL_CONSTANT")
        if not isinstance(sky, AnalyticSky):
            return Sky((sky,), "SKY_MODEL_GRADIENT")
        light = sky_light(
            sky,
            sun_direction=None if sun is None else sun.towards,
            sun_radiance=(0.0, 0.0, 0.0) if sun is None else sun.radiance,
            ambient=request.ambient,
            seed=request.seed,
        )
        return Sky((sky, light), "SKY_MODEL_ANALYTIC", self._table((sky, light)).texture)

    def draw(self, sky: Sky, defines: tuple[str, ...]) -> None:
        """Draw the sky into the current target where nothing stands."""
        program = self.device.program(
            "passes/fullscreen.vert",
            "passes/sky.frag",
            defines=(sky.define, *defines),
            blocks=(ViewBlock, LightBlock, Fog, *SKY_BLOCKS),
        )
        self._bind(sky.blocks)
        if sky.table:
            program.bind({"sky_map": sky.table})
        context = self.device.context
        context.enable_only(context.DEPTH_TEST)
        context.depth_func = ">="
        self._screen.draw(program)

    def _table(self, blocks: tuple[Block, ...]) -> Target:
        """The table of an analytic sky."""
        if blocks in self._kept:
            self._kept[blocks] = self._kept.pop(blocks)
            return self._kept[blocks]
        if self._multiple is None or self._scattering is None:
            self._multiple = Target(self.device, MULTIPLE_SIZE, kind="f4", has_depth=False)
            columns, rows = SCATTERING_SIZE
            self._scattering = Target(self.device, (columns, 3 * rows), kind="f4", has_depth=False)
        if len(self._kept) < KEPT:
            table = Target(self.device, (TABLE_SIZE, TABLE_SIZE), has_depth=False)
        else:
            table = self._kept.pop(next(iter(self._kept)))
        self._bind(blocks)
        tables = {"multiple_map": self._multiple.texture, "scattering_map": self._scattering.texture}
        for target, file in (
            (self._multiple, "passes/sky_multiple.frag"),
            (self._scattering, "passes/sky_scattering.frag"),
            (table, "passes/sky_bake.frag"),
        ):
            target.begin()
            program = self.device.program("passes/screen.vert", file, defines=DEFINES, blocks=SKY_BLOCKS)
            program.bind({name: map_ for name, map_ in tables.items() if map_ is not target.texture})
            self.device.context.enable_only(0)
            self._screen.draw(program)
        self.device.check_errors("sky bake")
        self._kept[blocks] = table
        return table

    def _bind(self, blocks: tuple[Block, ...]) -> None:
        for block in blocks:
            name = block.glsl_name()
            if name not in self._uniforms:
                self._uniforms[name] = Uniforms(self.device, block)
            self._uniforms[name].write(block)
            self._uniforms[name].bind()
