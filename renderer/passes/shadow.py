"""The sun's shadows: depth seen from the sun, kept while sun and scene stay."""

from __future__ import annotations

from dataclasses import dataclass

import moderngl
import numpy as np
from numpy.typing import NDArray

from renderer.camera import Camera, Lens, look_at
from renderer.gpu.device import Device
from renderer.gpu.geometry import Uniforms
from renderer.gpu.opengl import GL_DEPTH_CLAMP, GL_POLYGON_OFFSET_FILL
from renderer.gpu.texture import GpuTexture
from renderer.light import Sun
from renderer.passes.scene import Stage
from renderer.passes.view import Look

SIZE = 2048
"""Texels a side."""
RADIUS = 46.0
"""Metres round the scene's centre within which things cast and receive shadows."""
DEPTH = 150.0
"""Metres along the sun's rays, before and behind the centre."""
KEPT = 4
UNIT_FROM_NDC = np.array([[0.5, 0, 0, 0.5], [0, 0.5, 0, 0.5], [0, 0, 1.0, 0], [0, 0, 0, 1.0]])


class ShadowTexture:
    """A depth texture that compares."""

    def __init__(self, device: Device) -> None:
        self.texture = device.context.depth_texture((SIZE, SIZE))
        self.texture.compare_func = ">="
        self.texture.repeat_x = self.texture.repeat_y = False
        self.texture.filter = (moderngl.LINEAR, moderngl.LINEAR)
        self.framebuffer = device.context.framebuffer(depth_attachment=self.texture)
        self.device = device
        device.live += 2

    def bind(self, unit: int) -> None:
        """Put the texture on this unit."""
        self.texture.use(unit)

    def release(self) -> None:
        """Free texture and framebuffer."""
        self.framebuffer.release()
        self.texture.release()
        self.device.live -= 2


@dataclass(frozen=True, eq=False)
class Shadows:
    """The shadows of one sun."""

    texture: ShadowTexture | None
    shadow_from_world: NDArray[np.float64]

    @property
    def defines(self) -> tuple[str, ...]:
        """The names that choose the shadowed code."""
        return ("HAS_SHADOWS",) if self.texture else ()

    @property
    def textures(self) -> dict[str, GpuTexture | ShadowTexture]:
        """The sampler's texture."""
        return {"shadow_map": self.texture} if self.texture else {}


NO_SHADOWS = Shadows(None, np.eye(4))


class ShadowPass:
    """Draws shadow maps and keeps the last few."""

    def __init__(self, device: Device) -> None:
        self.device = device
        self._kept: dict[tuple[str, tuple[float, ...]], Shadows] = {}
        self._view: Uniforms | None = None

    def draw(self, stage: Stage, sun: Sun | None, centre: tuple[float, float, float]) -> Shadows:
        """The shadows of this sun; none below the horizon, or where none are wanted."""
        if sun is None or not sun.shadows or sun.towards[1] <= 0:
            return NO_SHADOWS
        key = (stage.name, tuple(float(v) for v in sun.towards))
        if key in self._kept:
            self._kept[key] = self._kept.pop(key)
            return self._kept[key]
        texture = self._oldest() if len(self._kept) >= KEPT else ShadowTexture(self.device)
        camera = sun_camera(sun.towards, centre)
        look = Look(camera)
        shadows = Shadows(texture, UNIT_FROM_NDC @ camera.clip_from_world)
        block = look.block(np.eye(4))
        if self._view is None:
            self._view = Uniforms(self.device, block)
        self._view.write(block)
        self._view.bind()
        texture.framebuffer.use()
        texture.framebuffer.viewport = (0, 0, SIZE, SIZE)
        texture.framebuffer.clear(depth=0.0)
        context = self.device.context
        context.enable_direct(GL_POLYGON_OFFSET_FILL)
        context.enable_direct(GL_DEPTH_CLAMP)
        context.polygon_offset = (-2.0, -2.0)  # away from the sun: depth is reversed
        stage.draw(
            look,
            fragment="passes/shadow.frag",
            in_map=True,
            keeps=lambda part: part.casts_shadow,
        )
        context.polygon_offset = (0.0, 0.0)
        context.disable_direct(GL_DEPTH_CLAMP)
        context.disable_direct(GL_POLYGON_OFFSET_FILL)
        self.device.check_errors("shadow pass")
        self._kept[key] = shadows
        return shadows

    def _oldest(self) -> ShadowTexture:
        shadows = self._kept.pop(next(iter(self._kept)))
        assert shadows.texture is not None  # only drawn shadows are kept
        return shadows.texture

    def forget(self, name: str) -> None:
        """Drop the shadows of a scene that leaves the device."""
        for key in [key for key in self._kept if key[0] == name]:
            texture = self._kept.pop(key).texture
            if texture:
                texture.release()


def sun_camera(towards: NDArray[np.float64], centre: tuple[float, float, float]) -> Camera:
    """The parallel camera that sees the scene as the sun does."""
    middle = np.array(centre)
    up = np.array([0.0, 0.0, 1.0]) if abs(towards[1]) > 0.9 else np.array([0.0, 1.0, 0.0])
    scale = SIZE / (2 * RADIUS)
    return Camera(
        look_at(middle + towards * DEPTH, middle, up),
        Lens(scale, scale, SIZE / 2, SIZE / 2, is_orthographic=True),
        SIZE,
        SIZE,
        near=1.0,
        far=2 * DEPTH,
    )
