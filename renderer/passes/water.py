"""The pass that draws the water over the scene."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass

import numpy as np

from renderer.blocks import Block
from renderer.gpu.device import Device
from renderer.gpu.geometry import Screen, Uniforms
from renderer.gpu.program import Bindable
from renderer.gpu.texture import GpuTexture, upload
from renderer.light import LightBlock
from renderer.passes.mapping import DrawnMap, eye_side
from renderer.passes.shadows import Shadows
from renderer.passes.view import Look, ViewBlock, WaterPlane, flat
from renderer.scene.material import Texture
from renderer.water.technique import Technique

QUAD = 6
CELLS = 192
"""Into how many a displaced surface is divided, each way."""
STILL = "water/still.glsl"
KEPT_TEXTURES = 8


@dataclass(frozen=True)
class Moment:
    """When the water is drawn, and from which seed."""

    time: float
    period: float | None
    seed: int


class WaterPass:
    """Draws any technique's water, by the functions that ``water/interface.glsl`` names."""

    def __init__(self, device: Device) -> None:
        self.device = device
        self._screen = Screen(device)
        self._uniforms: dict[str, Uniforms] = {}
        self._textures: dict[str, GpuTexture] = {}

    def draw(
        self,
        water: Technique,
        moment: Moment,
        look: Look,
        maps: Mapping[str, DrawnMap],
        shadows: Shadows,
        *,
        bed: Bindable | None = None,
        shows: tuple[str, ...] = (),
    ) -> None:
        """Draw the water into the current target, behind what stands before it."""
        level, extents = water.level or 0.0, water.extents or (0.0, 0.0, 0.0, 0.0)
        plane = WaterPlane(
            reflection_from_world=flat(maps["reflection"].clip_from_world),
            refraction_from_world=flat(maps["refraction"].clip_from_world),
            extents=extents,
            reach=water.reach(),
            picture_size=(float(look.camera.width), float(look.camera.height)),
            level=level,
            side=eye_side(look.camera, level),
        )
        blocks: tuple[Block, ...] = (plane, water, *water.blocks(moment.time, moment.period))
        program = self.device.program(
            "passes/water.vert",
            "passes/water.frag",
            defines=(
                *water.defines(moment.period),
                *shadows.defines,
                *shows,
                *_aligned(maps, look, level),
                *(("NEEDS_DEPTH",) if bed else ()),
            ),
            blocks=(ViewBlock, LightBlock, *(type(block) for block in blocks)),
            aliases={"technique": water.shader, "shape": (water.shape if water.is_displaced else None) or STILL},
        )
        for block in blocks:
            self._bind(block)
        program.bind(
            {
                **{name: self._texture(source) for name, source in water.textures(moment.seed).items()},
                **{f"{name}_map": drawn.target.texture for name, drawn in maps.items()},
                **shadows.textures,
                **({"bed_map": bed} if bed else {}),
            },
        )
        cells = CELLS if water.is_displaced else 1
        program["cells"] = cells
        context = self.device.context
        context.enable_only(context.DEPTH_TEST | (context.BLEND if water.blends and not shows else 0))
        context.blend_func = context.SRC_ALPHA, context.ONE_MINUS_SRC_ALPHA
        context.depth_func = ">="
        self._screen.draw(program, QUAD * cells * cells)
        context.disable(context.BLEND)
        self.device.check_errors("water pass")

    def _bind(self, block: Block) -> None:
        name = block.glsl_name()
        if name not in self._uniforms:
            self._uniforms[name] = Uniforms(self.device, block)
        self._uniforms[name].write(block)
        self._uniforms[name].bind()

    def _texture(self, source: Texture) -> GpuTexture:
        if source.name not in self._textures:
            while len(self._textures) >= KEPT_TEXTURES:
                self._textures.pop(next(iter(self._textures))).release()
            self._textures[source.name] = upload(self.device, source)
        else:
            self._textures[source.name] = self._textures.pop(source.name)
        return self._textures[source.name]


def _aligned(maps: Mapping[str, DrawnMap], look: Look, level: float) -> tuple[str, ...]:
    """The maps in which each point of the plane lies where the picture shows it: no projection finds it as exactly."""
    camera = look.camera
    views = (camera.clip_from_world, camera.mirrored(level).clip_from_world)
    return tuple(
        f"{name.upper()}_IS_ALIGNED"
        for name, drawn in maps.items()
        if drawn.target.size == (camera.width, camera.height)
        and any(np.array_equal(drawn.clip_from_world, view) for view in views)
    )
