"""Pond water after Luna 2006: two scrolling normal maps, biased power Fresnel, lit by material."""

from __future__ import annotations

from collections.abc import Mapping
from typing import ClassVar, Literal

from pydantic import Field

from renderer.blocks import Block
from renderer.scene.material import Texture
from renderer.units import Color, Length, Number, Unit, Vec2, Vec4
from renderer.water.normal_maps import ripple_slopes
from renderer.water.scroll import Scroll
from renderer.water.technique import MapSpec, Technique


class Luna(Technique):
    """Pond water: two scrolling normal maps, biased power Fresnel (Luna 2006, sections 2-4).

    The document states no numbers; the defaults are those of its published demo.
    """

    shader: ClassVar = "water/luna.glsl"
    title: ClassVar = "Pond water (Luna)"
    source: ClassVar = "Luna 2006"

    technique: Literal["luna"] = "luna"
    ripple_scale: Vec2 = (0.06, 0.03)
    """gRippleScale: shift of the map coordinates by the normal's x and z, along u and v (section 3)."""
    refraction_bias: Number = Field(0.1, ge=-1.0, le=1.0)
    """gRefractBias: added to the refraction weight; below 0 reflection wins before grazing (section 4)."""
    refraction_power: Number = Field(2.0, gt=0.0, le=64.0)
    """gRefractPower: exponent on the cosine of the view angle in the refraction weight (section 4)."""
    tile_0: Length = Field(12.8, ge=1e-3, le=1e4)
    """Side of one tile of the first normal map (section 2.3: different frequencies)."""
    tile_1: Length = Field(12.8, ge=1e-3, le=1e4)
    """Side of one tile of the second normal map."""
    velocity_0: Vec2 = (0.09, 0.06)
    """Scroll of the first normal map along x and z, tiles per second (section 5: different velocities)."""
    velocity_1: Vec2 = (-0.05, 0.08)
    """Scroll of the second normal map along x and z, tiles per second."""
    ripple_height: Number = Field(1.0, ge=0.0, le=8.0)
    """Factor on the slopes of both normal maps; 0 is flat."""
    material_ambient: Color = (0.4, 0.4, 0.4)
    """gMtrl.ambient: what the ambient light is multiplied by, with the blended maps (section 4)."""
    material_diffuse: Color = (1.0, 1.0, 1.0)
    """gMtrl.diffuse: what the diffuse light is multiplied by, with the blended maps."""
    material_specular: Color = (0.6, 0.6, 0.6)
    """gMtrl.specular: colour of the sun's glint, added to the blend."""
    specular_power: Number = Field(200.0, ge=1.0, le=1e4)
    """Exponent of the sun's glint (Phong)."""
    light_ambient: Color = (0.8, 0.8, 0.8)
    """Ambient light on the water."""
    light_diffuse: Color = (1.0, 1.0, 1.0)
    """Diffuse light on the water, from the sun's direction; none without a sun."""
    light_specular: Color = (1.0, 1.0, 1.0)
    """Light of the sun's glint; none without a sun or in shadow."""

    def maps(self) -> Mapping[str, MapSpec]:
        """The mirrored scene above the water, and the whole scene seen through it (sections 2.1, 2.2)."""
        return {
            "reflection": MapSpec(camera="mirror", clip="above", clear=(1.0, 1.0, 1.0, 0.0)),
            "refraction": MapSpec(camera="direct"),
        }

    def reach(self) -> tuple[float, float]:
        """The ripple scale: a unit normal has no longer component."""
        return abs(self.ripple_scale[0]), abs(self.ripple_scale[1])

    def blocks(self, time: float, period: float | None) -> tuple[Block, ...]:
        """Where the two normal maps stand."""
        first = Scroll.at(self.velocity_0, time, period)
        second = Scroll.at(self.velocity_1, time, period)
        return (
            LunaScroll(
                offset_0=first.offsets,
                offset_1=second.offsets,
                blend_0=first.blend,
                blend_1=second.blend,
            ),
        )

    def defines(self, period: float | None) -> tuple[str, ...]:
        """Two phases of each map are read where a period asks for it."""
        needs_blend = any(Scroll.needs_blend(velocity, period) for velocity in (self.velocity_0, self.velocity_1))
        return ("TWO_PHASES",) if needs_blend else ()

    def textures(self, seed: int) -> Mapping[str, Texture]:
        """The slopes of the two normal maps."""
        return {
            "normal_map_0": ripple_slopes(seed * 2),
            "normal_map_1": ripple_slopes(seed * 2 + 1),
        }


class LunaScroll(Block):
    """Where Luna's normal maps stand at one time."""

    offset_0: Vec4
    """Offset of the first map now (xy) and one period earlier (zw), tiles."""
    offset_1: Vec4
    """Offset of the second map now (xy) and one period earlier (zw), tiles."""
    blend_0: Unit
    """Weight of the first map's earlier phase."""
    blend_1: Unit
    """Weight of the second map's earlier phase."""
