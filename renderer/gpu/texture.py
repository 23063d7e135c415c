"""Textures on the device: their mipmaps are made here, in linear light."""

from __future__ import annotations

from typing import TYPE_CHECKING

import moderngl
import numpy as np
from numpy.typing import NDArray

from renderer.scene.material import Texture
from renderer.units import linear_from_srgb

if TYPE_CHECKING:
    from renderer.gpu.device import Device

KINDS = {"uint8": "f1", "uint16": "nu2", "float16": "f2", "float32": "f4"}
LINEAR_OF_BYTE = np.array([linear_from_srgb(byte / 255) for byte in range(256)], np.float32)


class GpuTexture:
    """A texture of the device. Never anisotropic: that costs four times on a CPU."""

    def __init__(
        self,
        device: Device,
        texture: moderngl.Texture,
        *,
        wrap: str,
        is_mipmapped: bool,
        blends_mipmaps: bool = True,
    ) -> None:
        self.device, self.texture = device, texture
        texture.repeat_x = texture.repeat_y = wrap == "repeat"
        if wrap == "mirror":
            device.opengl.mirror_texture(texture)
        mipmapped = moderngl.LINEAR_MIPMAP_LINEAR if blends_mipmaps else moderngl.LINEAR_MIPMAP_NEAREST
        minify = mipmapped if is_mipmapped else moderngl.LINEAR
        texture.filter = (minify, moderngl.LINEAR)
        device.live += 1

    def bind(self, unit: int) -> None:
        """Put the texture on this unit."""
        self.texture.use(unit)

    def release(self) -> None:
        """Free the texture."""
        self.device.check_thread()
        self.texture.release()
        self.device.live -= 1


def upload(device: Device, source: Texture) -> GpuTexture:
    """The texture with its mipmaps on the device.

    Colours are stored as the root of the linear value (``lib/colour.glsl`` squares them): a multiplication
    is exact on every CPU, where the drivers' sRGB decoding is not.
    """
    device.check_thread()
    levels = mip_levels(source)
    height, width, components = levels[0].shape
    texture = device.context.texture(
        (width, height),
        components,
        levels[0].tobytes(),
        dtype=KINDS[str(levels[0].dtype)],
        alignment=1,
    )
    if len(levels) > 1:
        texture.build_mipmaps(0, len(levels) - 1)
        for number, level in enumerate(levels[1:], 1):
            texture.write(level.tobytes(), level=number, alignment=1)
    device.check_errors(f"texture {source.name}")
    return GpuTexture(device, texture, wrap=source.wrap, is_mipmapped=True, blends_mipmaps=source.blends_mipmaps)


def mip_levels(source: Texture) -> list[NDArray[np.generic]]:
    """The image and its halvings down to one texel, each the mean of four texels in linear light."""
    image = source.image
    if image.ndim == 2:
        image = image[..., None]
    if not source.is_srgb:
        linear = image.astype(np.float32) if image.dtype != np.float32 else image
        return [_stored(level, image.dtype) for level in _halvings(linear)]
    linear = np.empty(image.shape, np.float32)
    linear[..., :3] = LINEAR_OF_BYTE[image[..., :3]]
    linear[..., 3:] = image[..., 3:] / np.float32(255)
    levels = _halvings(linear)
    if source.mipmaps == "coverage":
        levels = _keep_coverage(levels)
    return [_rooted(level) for level in levels]


def _halvings(image: NDArray[np.float32]) -> list[NDArray[np.float32]]:
    levels = [image]
    while max(levels[-1].shape[:2]) > 1:
        last = levels[-1]
        height, width = (max(side // 2, 1) for side in last.shape[:2])
        rows = last[: height * 2 : 2] + last[1 : height * 2 : 2] if last.shape[0] > 1 else last * 2
        both = rows[:, : width * 2 : 2] + rows[:, 1 : width * 2 : 2] if last.shape[1] > 1 else rows * 2
        levels.append(both * np.float32(0.25))
    return levels


def _keep_coverage(levels: list[NDArray[np.float32]]) -> list[NDArray[np.float32]]:
    """Scale alpha in each level so that as many texels pass the cutoff of one half as in the first."""
    wanted = float(np.mean(levels[0][..., 3] >= 0.5))
    kept = [levels[0]]
    for level in levels[1:]:
        alpha = level[..., 3]
        threshold = float(np.quantile(alpha, 1 - wanted)) if 0 < wanted < 1 else 0.5
        scaled = level.copy()
        scaled[..., 3] = np.clip(alpha * (0.5 / max(threshold, 0.05)), 0, 1)
        kept.append(scaled)
    return kept


def _rooted(level: NDArray[np.float32]) -> NDArray[np.uint8]:
    stored = np.empty(level.shape, np.uint8)
    stored[..., :3] = np.rint(np.sqrt(level[..., :3]) * 255)
    stored[..., 3:] = np.rint(level[..., 3:] * 255)
    return stored


def _stored(level: NDArray[np.float32], dtype: np.dtype[np.generic]) -> NDArray[np.generic]:
    if dtype.kind == "u":
        return np.rint(level).astype(dtype)
    return level.astype(np.float16)
