"""The bed: how high what lies below the water stands, seen from above; kept while scene and water stay."""

from __future__ import annotations

import numpy as np

from renderer.camera import Camera, Lens, look_at
from renderer.gpu.device import Device
from renderer.gpu.geometry import Uniforms
from renderer.gpu.target import Target
from renderer.gpu.texture import GpuTexture
from renderer.passes.shadows import NO_SHADOWS
from renderer.passes.stage import Stage
from renderer.passes.view import Look
from renderer.scene.scene import SceneObject
from renderer.water.technique import Extents

SIZE = 512
"""Texels a side, over the water's rectangle."""
ABOVE, BELOW = 1e3, 2e4
"""Metres above and below the water that are looked through."""
NOWHERE = -1e4
"""Metres from the water's level where there is no bed."""
PROUD = 0.05
"""Metres past the water that things other than the ground are still taken for bed: their cut lies out of the water."""


class BedPass:
    """Draws the bed's height, and keeps the last one."""

    def __init__(self, device: Device) -> None:
        self.device = device
        self._target: Target | None = None
        self._view: Uniforms | None = None
        self._shown: tuple[str, float, Extents] | None = None

    def draw(self, stage: Stage, level: float, extents: Extents) -> GpuTexture:
        """The height of the bed under a rectangle of water, metres; v runs against z."""
        if self._target is None:
            self._target = Target(self.device, (SIZE, SIZE), kind="f4")
        if self._shown == (stage.name, level, extents):
            return self._target.texture
        camera = plan_camera(level, extents)
        self._target.begin((level + NOWHERE, 0.0, 0.0, 0.0))
        cut = (0.0, -1.0, 0.0, level + PROUD)
        for look, keeps in ((Look(camera), _is_ground), (Look(camera, cut), _is_solid)):
            block = look.block(NO_SHADOWS)
            if self._view is None:
                self._view = Uniforms(self.device, block)
            self._view.write(block)
            self._view.bind()
            stage.draw(
                look,
                fragment="passes/bed.frag",
                defines=("STANDS_STILL",),
                in_map=True,
                keeps=keeps,
            )
        self.device.check_errors("bed pass")
        self._shown = (stage.name, level, extents)
        return self._target.texture

    def forget(self, name: str) -> None:
        """Drop the bed of a scene that leaves the device."""
        if self._shown is not None and self._shown[0] == name:
            self._shown = None


def plan_camera(level: float, extents: Extents) -> Camera:
    """The parallel camera that sees a rectangle of water from above, x to the right and z downwards."""
    x0, x1, z0, z1 = extents
    middle = np.array([(x0 + x1) / 2, level, (z0 + z1) / 2])
    return Camera(
        look_at(middle + np.array([0.0, ABOVE, 0.0]), middle, np.array([0.0, 0.0, -1.0])),
        Lens(SIZE / (x1 - x0), SIZE / (z1 - z0), SIZE / 2, SIZE / 2, is_orthographic=True),
        SIZE,
        SIZE,
        near=1.0,
        far=ABOVE + BELOW,
    )


def _is_ground(part: SceneObject) -> bool:
    return part.material.shader == "terrain"


def _is_solid(part: SceneObject) -> bool:
    return part.material.shader == "surface" and part.material.alpha_cutoff == 0
