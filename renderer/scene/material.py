"""How a surface looks: its textures, factors and shader."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Any, ClassVar, Literal

from numpy.typing import NDArray

from renderer.blocks import Block
from renderer.units import Color, Length, Unit


class MaterialBlock(Block):
    """What a material's shader reads besides its textures."""

    block_name: ClassVar = "Material"

    albedo: Color = (1.0, 1.0, 1.0)
    """Linear factor on the colour."""
    detail_tile: Length = 1.0
    """Side of one tile of the detail map."""
    alpha_cutoff: Unit = 0.0
    """Coverage below which a pixel is left out; 0 draws everything."""
    translucency: Unit = 0.0
    """Share of the sun's light that comes through from behind."""


@dataclass(frozen=True)
class Material:
    """One look, shared by any number of objects."""

    name: str
    shader: Literal["surface", "terrain", "foliage"] = "surface"
    albedo: tuple[float, float, float] = (1.0, 1.0, 1.0)
    albedo_map: str | None = None
    """Name of a texture of the scene: sRGB, alpha is coverage."""
    detail_map: str | None = None
    """Name of a texture of the scene: linear; normal xy in rg, luminance detail in b (0.5 is neutral)."""
    detail_tile: float = 1.0
    alpha_cutoff: float = 0.0
    is_two_sided: bool = False
    translucency: float = 0.0

    @property
    def block(self) -> MaterialBlock:
        """The material's uniform block."""
        return MaterialBlock(
            albedo=self.albedo,
            detail_tile=self.detail_tile,
            alpha_cutoff=self.alpha_cutoff,
            translucency=self.translucency,
        )

    @property
    def defines(self) -> tuple[str, ...]:
        """The preprocessor names that choose this material's code."""
        flags = {
            "HAS_ALBEDO_MAP": self.albedo_map is not None,
            "HAS_DETAIL_MAP": self.detail_map is not None,
            "HAS_ALPHA_CUTOFF": self.alpha_cutoff > 0,
            "TURNS_BACK_FACES": self.is_two_sided and self.shader != "foliage",
            "HAS_TRANSLUCENCY": self.translucency > 0,
            "SHADOWS_BY_VERTEX": self.shader == "foliage",
        }
        return tuple(name for name, is_set in flags.items() if is_set)


@dataclass(frozen=True, eq=False)
class Texture:
    """An image that a material reads.

    ``image`` is (h, w, c) with c = 1, 2 or 4: uint8, uint16 (both normalised) or float32 (stored as
    half floats), first row at v = 0.
    """

    name: str
    image: NDArray[Any]
    is_srgb: bool = False
    wrap: Literal["repeat", "clamp", "mirror"] = "repeat"
    mipmaps: Literal["box", "coverage"] = "box"
    """``coverage`` rescales alpha in each level so that foliage keeps its area."""
    blends_mipmaps: bool = True
    """Whether two levels are mixed; one alone costs a CPU a third less, where no step between levels shows."""
