"""Pond water after Luna 2006: two scrolling normal maps, biased power Fresnel, lit by material."""

from __future__ import annotations

from collections.abc import Mapping
from typing import Annotated, Any, ClassVar, Literal

from pydantic import BeforeValidator, Field

from renderer.blocks import Block
from renderer.scene.images import ImageReference
from renderer.scene.material import Texture
from renderer.units import Color, Length, Number, Unit, Vec2, Vec4, as_tuple
from renderer.water.image_maps import image_name, image_texture
from renderer.water.impurities import ColorLayer, NamedLayer
from renderer.water.normal_maps import ripple_heights, ripple_slopes
from renderer.water.scroll import Scroll
from renderer.water.technique import MapSpec, PublishedTechnique

RIPPLES = "ripples"
MOST_LAYERS = 2


def _as_layers(value: Any) -> Any:
    return (value,) if isinstance(value, str) else as_tuple(value)


class Luna(PublishedTechnique):
    """Pond water: two scrolling normal maps, biased power Fresnel (Luna 2006, sections 2-4).

    The document states no numbers; the defaults are those of its published demo.
    """

    shader: ClassVar = "water/luna.glsl"
    shape: ClassVar = "water/luna_shape.glsl"
    title: ClassVar = "Pond water (Luna)"
    source: ClassVar = "Luna 2006"

    technique: Literal["luna"] = "luna"
    normal_map: Annotated[str, image_name("normal_map", (RIPPLES,))] = RIPPLES
    """`ripples`: two random maps of small waves; or the id of an uploaded `normal_map`, which both layers then read
    (tangent space, green upwards, any size; its top is north)."""
    ripple_scale: Vec2 = (0.06, 0.03)
    """gRippleScale: shift of the map coordinates by the normal's x and z, along u and v (section 3)."""
    refraction_bias: Number = Field(0.1, ge=-1.0, le=1.0)
    """gRefractBias: added to the refraction weight; below 0 reflection wins before grazing (section 4)."""
    bias_map: Annotated[str, image_name("bias_map", ())] | None = None
    """Id of an uploaded `bias_map`: grey from 0 to 1 stretched over the water's extents, its top north, in place of
    `refraction_bias` (section 4). Brighter water shows more of its ground."""
    refraction_power: Number = Field(2.0, gt=0.0, le=64.0)
    """gRefractPower: exponent on the cosine of the view angle in the refraction weight (section 4)."""
    depth_fade: Number = Field(0.0, ge=0.0, le=1e3, json_schema_extra={"x-unit": "1/m"})
    """Rate at which the refraction weight falls with the depth of the water below, by exp(-rate * depth). The document
    asks for a fall and states no formula (section 4); 0 is none."""
    distance_fade: Number = Field(0.0, ge=0.0, le=1e3, json_schema_extra={"x-unit": "1/m"})
    """Rate at which the refraction weight falls with the distance from the viewer, in the same way."""
    color_layers: Annotated[tuple[NamedLayer, ...], BeforeValidator(_as_layers), Field(max_length=MOST_LAYERS)] = ()
    """Impurities: images over the refracted light, the first lowest (section 2.3). A name stands for a whole layer."""
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
    displacement: Number = Field(0.0, ge=0.0, le=8.0)
    """Factor on the height of the ripples in the surface (section 5: displacement): 1 lifts the geometry as its
    `ripples` tilt it, 0 leaves it plane. An uploaded `normal_map` has no heights, and leaves it plane."""
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
            "reflection": self.published(MapSpec(camera="mirror", clip="above", clear=(1.0, 1.0, 1.0, 0.0))),
            "refraction": self.published(MapSpec(camera="direct")),
        }

    def reach(self) -> tuple[float, float]:
        """The ripple scale: a unit normal has no longer component."""
        return abs(self.ripple_scale[0]), abs(self.ripple_scale[1])

    @property
    def needs_depth(self) -> bool:
        """Only the fade by depth reads it."""
        return self.depth_fade > 0

    @property
    def is_displaced(self) -> bool:
        """Where there are heights, and any height is asked for."""
        return self.displacement * self.ripple_height > 0 and self.normal_map == RIPPLES

    def images(self) -> Mapping[str, ImageReference]:
        """The normal map, the bias map and the layers that are users' images."""
        named = {"normal_map": self._normal_image(), "bias_map": self._bias_image()}
        named |= {f"color_layers.{number}.image": layer.reference() for number, layer in enumerate(self.color_layers)}
        return {path: reference for path, reference in named.items() if reference is not None}

    def blocks(self, time: float, period: float | None) -> tuple[Block, ...]:
        """Where the two normal maps and the layers stand."""
        first = Scroll.at(self.velocity_0, time, period)
        second = Scroll.at(self.velocity_1, time, period)
        block = LunaScroll(
            offset_0=first.offsets,
            offset_1=second.offsets,
            blend_0=first.blend,
            blend_1=second.blend,
        )
        layers: dict[str, Vec4] = {}
        for number, layer in enumerate(self._visible_layers()):
            scroll = Scroll.at(layer.velocity, time, period)
            layers |= {
                f"layer_offset_{number}": scroll.offsets,
                f"layer_look_{number}": (layer.tile, layer.opacity, scroll.blend, 0.0),
            }
        return (block.model_copy(update=layers),)

    def defines(self, period: float | None) -> tuple[str, ...]:
        """What the parameters ask for; two phases of each map are read where a period does."""
        layers = self._visible_layers()
        velocities = (self.velocity_0, self.velocity_1, *(layer.velocity for layer in layers))
        flags = {
            "TWO_PHASES": any(Scroll.needs_blend(velocity, period) for velocity in velocities),
            "HAS_BIAS_MAP": self.bias_map is not None,
            "NEEDS_DISTANCE": self.distance_fade > 0,
            "HAS_COLOR_LAYERS": len(layers) > 0,
            "HAS_TWO_COLOR_LAYERS": len(layers) > 1,
            "READS_LEAKS": self.as_published,
        }
        return tuple(name for name, is_set in flags.items() if is_set)

    def textures(self, seed: int) -> Mapping[str, Texture]:
        """The slopes of the two normal maps, and the images that are asked for. Raises ``MissingImage``."""
        normal, bias = self._normal_image(), self._bias_image()
        slopes = [ripple_slopes(seed * 2 + i) if normal is None else image_texture(normal) for i in range(2)]
        textures = {f"normal_map_{number}": texture for number, texture in enumerate(slopes)}
        if self.is_displaced:
            textures |= {f"height_map_{number}": ripple_heights(seed * 2 + number) for number in range(2)}
        if bias is not None:
            textures["bias_map"] = image_texture(bias)
        layers = enumerate(self._visible_layers())
        return textures | {f"color_layer_map_{number}": layer.texture(seed) for number, layer in layers}

    def _normal_image(self) -> ImageReference | None:
        return None if self.normal_map == RIPPLES else ImageReference(self.normal_map, "normal_map")

    def _bias_image(self) -> ImageReference | None:
        return None if self.bias_map is None else ImageReference(self.bias_map, "bias_map")

    def _visible_layers(self) -> tuple[ColorLayer, ...]:
        return tuple(layer for layer in self.color_layers if layer.opacity > 0)


class LunaScroll(Block):
    """Where Luna's normal maps and layers stand at one time."""

    offset_0: Vec4
    """Offset of the first map now (xy) and one period earlier (zw), tiles."""
    offset_1: Vec4
    """Offset of the second map now (xy) and one period earlier (zw), tiles."""
    blend_0: Unit
    """Weight of the first map's earlier phase."""
    blend_1: Unit
    """Weight of the second map's earlier phase."""
    layer_offset_0: Vec4 = (0.0, 0.0, 0.0, 0.0)
    """Offset of the lower colour layer, as the maps'."""
    layer_offset_1: Vec4 = (0.0, 0.0, 0.0, 0.0)
    """Offset of the upper colour layer, as the maps'."""
    layer_look_0: Vec4 = (1.0, 0.0, 0.0, 0.0)
    """Tile (m), opacity and weight of the earlier phase of the lower colour layer."""
    layer_look_1: Vec4 = (1.0, 0.0, 0.0, 0.0)
    """Tile (m), opacity and weight of the earlier phase of the upper colour layer."""
