"""The scene on the device, and the pass that draws it."""

from __future__ import annotations

from collections.abc import Callable, Mapping
from dataclasses import dataclass, field

import numpy as np
from numpy.typing import NDArray

from renderer.gpu.device import Device
from renderer.gpu.geometry import Geometry, Uniforms
from renderer.gpu.opengl import GL_CLIP_DISTANCE0
from renderer.gpu.program import Bindable, Program
from renderer.gpu.texture import GpuTexture, upload
from renderer.light import Fog, LightBlock
from renderer.passes.view import NO_CLIP, Look, ViewBlock, Wind
from renderer.scene.material import Material, MaterialBlock
from renderer.scene.scene import Scene, SceneObject

BLOCKS = (ViewBlock, LightBlock, MaterialBlock, Wind, Fog)


@dataclass(eq=False)
class Part:
    """One object on the device."""

    source: SceneObject
    geometry: Geometry
    map_geometry: Geometry
    material: Uniforms
    textures: dict[str, GpuTexture]
    sways: bool
    programs: dict[tuple[str, tuple[str, ...]], Program] = field(default_factory=dict)

    def program(self, device: Device, fragment: str, defines: tuple[str, ...]) -> Program:
        """The program that draws this part; remembered, since a part is drawn twice a frame."""
        if (fragment, defines) not in self.programs:
            material: Material = self.source.material
            self.programs[fragment, defines] = device.program(
                "passes/scene.vert",
                fragment,
                defines=(*defines, *material.defines, *(("SWAYS",) if self.sways else ())),
                blocks=BLOCKS,
                aliases={"material": f"materials/{material.shader}.glsl"},
            )
        return self.programs[fragment, defines]


class Stage:
    """A scene on the device."""

    def __init__(self, device: Device, scene: Scene) -> None:
        self.device, self.name = device, scene.name
        self._textures = {name: upload(device, source) for name, source in scene.textures.items()}
        materials = {part.material for part in scene.objects}  # each once: what a dict drops is never released
        self._materials = {material: Uniforms(device, material.block) for material in materials}
        self.parts = [self._part(source) for source in scene.objects]
        self._bounds = {
            False: _stack([part.geometry for part in self.parts]),
            True: _stack([part.map_geometry for part in self.parts]),
        }

    def _part(self, source: SceneObject) -> Part:
        names = {"albedo_map": source.material.albedo_map, "detail_map": source.material.detail_map}
        geometry = Geometry(self.device, source.mesh)
        return Part(
            source,
            geometry,
            geometry if source.map_mesh is None else Geometry(self.device, source.map_mesh),
            self._materials[source.material],
            {sampler: self._textures[name] for sampler, name in names.items() if name},
            bool((source.mesh.color[:, 3] > 0).any()),
        )

    def tagged(self, tags: frozenset[str] | None) -> frozenset[str] | None:
        """These tags, or None where nothing in the scene carries any: a scene that makes no choice shows all."""
        is_chosen = tags is not None and any(tags & part.source.tags for part in self.parts)
        return tags if is_chosen else None

    def draw(
        self,
        look: Look,
        *,
        fragment: str,
        defines: tuple[str, ...] = (),
        in_map: bool = False,
        keeps: Callable[[SceneObject], bool] = lambda _: True,
        textures: Mapping[str, Bindable] | None = None,
    ) -> int:
        """Draw what is seen, near before far and solid before leafy; the number of triangles."""
        context = self.device.context
        low, high = self._bounds[in_map]
        seen = np.flatnonzero(look.sees(low, high))
        distance = look.distance_to(low, high)
        order = sorted(
            (int(i) for i in seen if keeps(self.parts[i].source)),
            key=lambda i: (self.parts[i].source.material.alpha_cutoff > 0, distance[i]),
        )
        clips = look.clip_plane != NO_CLIP
        context.enable_only(context.DEPTH_TEST)
        context.depth_func = ">="
        context.front_face = "cw" if look.camera.is_mirrored else "ccw"
        names = (*defines, "CLIPS") if clips else defines
        if clips:
            context.enable_direct(GL_CLIP_DISTANCE0)
        triangles = 0
        for i in order:
            part = self.parts[i]
            program = part.program(self.device, fragment, names)
            program.bind({**(textures or {}), **part.textures})
            part.material.bind()
            if part.source.material.is_two_sided:
                context.disable(context.CULL_FACE)
            else:
                context.enable(context.CULL_FACE)
            is_far = distance[i] > part.source.detail_distance
            geometry = part.map_geometry if in_map or is_far else part.geometry
            geometry.draw(program)
            triangles += geometry.triangles
        if clips:
            context.disable_direct(GL_CLIP_DISTANCE0)
        context.disable(context.CULL_FACE)
        context.front_face = "ccw"
        return triangles

    def release(self) -> None:
        """Free everything."""
        for part in self.parts:
            part.geometry.release()
            if part.map_geometry is not part.geometry:
                part.map_geometry.release()
        for uniforms in self._materials.values():
            uniforms.release()
        for texture in self._textures.values():
            texture.release()


def _stack(geometries: list[Geometry]) -> tuple[NDArray[np.float32], NDArray[np.float32]]:
    if not geometries:
        return np.zeros((0, 3), np.float32), np.zeros((0, 3), np.float32)
    return np.stack([g.low for g in geometries]), np.stack([g.high for g in geometries])
