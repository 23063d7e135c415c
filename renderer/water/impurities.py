"""What is suspended in the water, as colour layers: users' images, and two that are made here.

The made ones are random fields on a torus, so that they tile: noise whose spectrum falls with a power of the wave
number within a band (as Tessendorf 2001, section 3.2, makes heights), cut into patches by thresholds.
"""

from __future__ import annotations

from collections.abc import Callable, Mapping
from functools import lru_cache
from typing import Annotated, Any

import numpy as np
from numpy.typing import NDArray
from pydantic import BeforeValidator, Field

from renderer.blocks import Declaration
from renderer.scene.images import ImageReference
from renderer.scene.material import Texture
from renderer.units import Length, Number, Vec2
from renderer.water.image_maps import image_name, image_texture, premultiplied

Floats = NDArray[np.float64]
SIZE = 512
"""Texels a side of the layers that are made here."""


def _algae(rng: np.random.Generator) -> Floats:
    """Green scum in patches with frayed rims, and single specks between them."""
    patch, fray, grain = _field(rng, 2, 24, 1.7), _field(rng, 16, 96, 1.0), _field(rng, 48, 200, 0.6)
    cover = _smooth(0.1, 1.3, patch + 0.45 * fray)
    specks = _smooth(2.0, 2.6, grain + 0.35 * patch)
    alpha = np.clip(cover * (0.8 + 0.12 * np.clip(grain, -2, 2)) + 0.6 * specks * (1 - cover), 0, 1)
    shade = np.clip(0.5 + 0.22 * fray + 0.14 * grain, 0, 1)[..., None]
    color = np.array([58, 74, 24]) * (1 - shade) + np.array([132, 142, 56]) * shade
    return np.concatenate([color, 255 * alpha[..., None]], axis=-1)


def _silt(rng: np.random.Generator) -> Floats:
    """Brown clouds of mud, nowhere quite clear."""
    plume, wisp = _field(rng, 2, 40, 1.9), _field(rng, 6, 120, 1.5)
    alpha = 0.2 + 0.65 * _smooth(-1.6, 1.9, plume + 0.35 * wisp)
    shade = np.clip(0.5 + 0.25 * wisp, 0, 1)[..., None]
    color = np.array([104, 84, 56]) * (1 - shade) + np.array([142, 118, 82]) * shade
    return np.concatenate([color, 255 * alpha[..., None]], axis=-1)


BUILT_IN: Mapping[str, Callable[[np.random.Generator], Floats]] = {"algae": _algae, "silt": _silt}
"""The layers that are made here: sRGB and straight alpha, 0..255, from a generator."""


def _by_name(value: Any) -> Any:
    return {"image": value} if isinstance(value, str) else value


class ColorLayer(Declaration):
    """Impurities that float in the water: an image over the refracted light (Luna 2006, section 2.3)."""

    image: Annotated[str, image_name("color_layer", tuple(BUILT_IN))]
    """`algae`, `silt`, or the id of an uploaded `color_layer`; its alpha says where the water is clear."""
    opacity: Number = Field(1.0, ge=0.0, le=1.0)
    """Factor on the image's alpha; 0 leaves the layer out."""
    tile: Length = Field(8.0, ge=1e-3, le=1e4)
    """Side of one tile of the image; its top is north (−z)."""
    velocity: Vec2 = (0.0, 0.0)
    """Drift along x and z, tiles per second."""

    def reference(self) -> ImageReference | None:
        """The user's image, if it is one."""
        return None if self.image in BUILT_IN else ImageReference(self.image, "color_layer")

    def texture(self, seed: int) -> Texture:
        """The image: linear colour times alpha, and alpha."""
        reference = self.reference()
        return _made(self.image, seed) if reference is None else image_texture(reference)


NamedLayer = Annotated[ColorLayer, BeforeValidator(_by_name)]
"""A layer, or its image's name alone."""


@lru_cache(maxsize=4)
def _made(name: str, seed: int) -> Texture:
    rng = np.random.Generator(np.random.PCG64([0x6C617965, seed, *name.encode()]))
    drawn = np.rint(np.clip(BUILT_IN[name](rng), 0, 255)).astype(np.uint8)
    return Texture(f"{name} {seed}", premultiplied(drawn))


def _field(rng: np.random.Generator, lowest: float, highest: float, fall: float) -> Floats:
    """Tiling noise of mean 0 and deviation 1 between two wave numbers a tile, its amplitude falling with a power."""
    k = np.fft.fftfreq(SIZE, 1 / SIZE)
    number = np.hypot(*np.meshgrid(k, k))
    band = (number >= lowest) & (number <= highest)
    amplitude = np.where(band, np.maximum(number, 1.0) ** -fall, 0.0)
    noise = rng.standard_normal((SIZE, SIZE)) + 1j * rng.standard_normal((SIZE, SIZE))
    field = np.fft.ifft2(noise * amplitude).real
    return np.asarray(field / field.std())


def _smooth(low: float, high: float, x: Floats) -> Floats:
    t = np.clip((x - low) / (high - low), 0, 1)
    return np.asarray(t * t * (3 - 2 * t))
