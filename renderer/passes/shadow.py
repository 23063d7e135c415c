"""The sun's shadows: depth seen from the sun, kept while sun and scene stay."""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from renderer.camera import Camera, Lens, look_at
from renderer.gpu.device import Device
from renderer.gpu.geometry import Uniforms
from renderer.gpu.opengl import GL_DEPTH_CLAMP, GL_POLYGON_OFFSET_FILL
from renderer.gpu.target import DepthTexture
from renderer.light import Sun
from renderer.passes.shadows import NO_SHADOWS, Shadows
from renderer.passes.stage import Stage
from renderer.passes.view import Look

SIZE = 2048
"""Texels a side."""
DEPTH = 3.25
"""How far along the sun's rays things are seen before and behind the centre, in radii."""
OFFSET = 0.9
"""Texels that a surface is moved along its normal before it asks whether it is lit, so as not to shadow itself."""
KEPT = 4
UNIT_FROM_NDC = np.array([[0.5, 0, 0, 0.5], [0, 0.5, 0, 0.5], [0, 0, 1.0, 0], [0, 0, 0, 1.0]])


class ShadowPass:
    """Draws shadow maps and keeps the last few."""

    def __init__(self, device: Device) -> None:
        self.device = device
        self._kept: dict[tuple[str, tuple[float, ...]], Shadows] = {}
        self._view: Uniforms | None = None

    def draw(self, stage: Stage, sun: Sun | None, centre: tuple[float, float, float], radius: float) -> Shadows:
        """The shadows of this sun within a radius, metres; none below the horizon, or where none are wanted."""
        if sun is None or not sun.shadows or sun.towards[1] <= 0:
            return NO_SHADOWS
        key = (stage.name, tuple(float(v) for v in sun.towards))
        if key in self._kept:
            self._kept[key] = self._kept.pop(key)
            return self._kept[key]
        texture = self._oldest() if len(self._kept) >= KEPT else DepthTexture(self.device, SIZE)
        camera = sun_camera(sun.towards, centre, radius)
        look = Look(camera)
        shadows = Shadows(texture, UNIT_FROM_NDC @ camera.clip_from_world, OFFSET * 2 * radius / SIZE)
        block = look.block(NO_SHADOWS)
        if self._view is None:
            self._view = Uniforms(self.device, block)
        self._view.write(block)
        self._view.bind()
        texture.begin()
        context = self.device.context
        context.enable_direct(GL_POLYGON_OFFSET_FILL)
        context.enable_direct(GL_DEPTH_CLAMP)
        context.polygon_offset = (-2.0, -2.0)  # away from the sun: depth is reversed
        stage.draw(
            look,
            fragment="passes/shadow.frag",
            defines=("STANDS_STILL",),  # kept over time, so no frame may leave its wind in it
            in_map=True,
            keeps=lambda part: part.casts_shadow,
        )
        context.polygon_offset = (0.0, 0.0)
        context.disable_direct(GL_DEPTH_CLAMP)
        context.disable_direct(GL_POLYGON_OFFSET_FILL)
        self.device.check_errors("shadow pass")
        self._kept[key] = shadows
        return shadows

    def _oldest(self) -> DepthTexture:
        return self._kept.pop(next(iter(self._kept))).texture or DepthTexture(self.device, SIZE)

    def forget(self, name: str) -> None:
        """Drop the shadows of a scene that leaves the device."""
        for key in [key for key in self._kept if key[0] == name]:
            texture = self._kept.pop(key).texture
            if texture:
                texture.release()


def sun_camera(towards: NDArray[np.float64], centre: tuple[float, float, float], radius: float) -> Camera:
    """The parallel camera that sees the scene as the sun does."""
    middle = np.array(centre)
    up = np.array([0.0, 0.0, 1.0]) if abs(towards[1]) > 0.9 else np.array([0.0, 1.0, 0.0])
    scale = SIZE / (2 * radius)
    return Camera(
        look_at(middle + towards * DEPTH * radius, middle, up),
        Lens(scale, scale, SIZE / 2, SIZE / 2, is_orthographic=True),
        SIZE,
        SIZE,
        near=1.0,
        far=2 * DEPTH * radius,
    )
