"""The sky: exact where it is a formula, looked up in a baked table where it is air and clouds."""

from __future__ import annotations

from dataclasses import dataclass

from renderer.blocks import Block
from renderer.gpu.device import Device
from renderer.gpu.geometry import Screen, Uniforms
from renderer.gpu.texture import GpuTexture
from renderer.light import Fog, LightBlock
from renderer.passes.view import ViewBlock
from renderer.request import FrameRequest
from renderer.scene.sky import AnalyticSky, ConstantSky, GradientSky

SKY_BLOCKS = (ConstantSky, GradientSky, AnalyticSky)


@dataclass(frozen=True, eq=False)
class Sky:
    """One sky, ready to be drawn."""

    block: Block
    define: str
    table: GpuTexture | None = None


class SkyPass:
    """Bakes skies, keeps the last few, and draws them behind everything."""

    def __init__(self, device: Device) -> None:
        self.device = device
        self._screen = Screen(device)
        self._uniforms: dict[str, Uniforms] = {}

    def prepare(self, request: FrameRequest) -> Sky:
        """The sky of a request."""
        if isinstance(request.sky, ConstantSky):
            return Sky(request.sky, "SKY_MODEL_CONSTANT")
        if isinstance(request.sky, GradientSky):
            return Sky(request.sky, "SKY_MODEL_GRADIENT")
        return Sky(GradientSky(), "SKY_MODEL_GRADIENT")

    def draw(self, sky: Sky, defines: tuple[str, ...]) -> None:
        """Draw the sky into the current target where nothing stands."""
        program = self.device.program(
            "passes/fullscreen.vert",
            "passes/sky.frag",
            aliases={"SkyLight": "lib/noise.glsl"},
            defines=(sky.define, *defines),
            blocks=(ViewBlock, LightBlock, Fog, *SKY_BLOCKS),
        )
        name = sky.block.glsl_name()
        if name not in self._uniforms:
            self._uniforms[name] = Uniforms(self.device, sky.block)
        self._uniforms[name].write(sky.block)
        self._uniforms[name].bind()
        if sky.table:
            program.bind({"sky_map": sky.table})
        context = self.device.context
        context.enable_only(context.DEPTH_TEST)
        context.depth_func = ">="
        self._screen.draw(program)
