"""What one draws into: colour textures with a 32-bit float depth buffer."""

from __future__ import annotations

import math
from typing import TYPE_CHECKING

import moderngl
import numpy as np
from numpy.typing import NDArray

from renderer.gpu.texture import GpuTexture

if TYPE_CHECKING:
    from renderer.gpu.device import Device

DTYPES = {"f1": np.uint8, "f2": np.float16, "f4": np.float32}


class Target:
    """A framebuffer: one colour attachment, and if wanted depth.

    ``kind`` is a moderngl type (``f1`` bytes, ``f2`` half floats, ``f4`` floats). With ``samples`` above 1
    the colour is a renderbuffer that ``resolve`` copies out; otherwise ``color`` is a texture.
    """

    def __init__(
        self,
        device: Device,
        size: tuple[int, int],
        *,
        kind: str = "f2",
        components: int = 4,
        samples: int = 1,
        has_depth: bool = True,
        wrap: str = "clamp",
    ) -> None:
        device.check_thread()
        self.device, self.size, self.kind, self.components = device, size, kind, components
        self.samples = samples
        context = device.context
        self.color: GpuTexture | None = None
        attachment: moderngl.Texture | moderngl.Renderbuffer
        if samples > 1:
            attachment = context.renderbuffer(size, components, samples=samples, dtype=kind)
        else:
            attachment = context.texture(size, components, dtype=kind)
            self.color = GpuTexture(device, attachment, wrap=wrap, is_mipmapped=False)
        self._attachment = attachment
        self.framebuffer = context.framebuffer(color_attachments=[attachment])
        self._depth = 0
        if has_depth:
            self._depth = device.opengl.depth_renderbuffer(size, samples)
            device.opengl.attach_depth(self.framebuffer.glo, self._depth)
            self.framebuffer.depth_mask = True
        device.live += 1
        device.check_errors("target")

    def begin(
        self,
        clear: tuple[float, float, float, float] | None = (0.0, 0.0, 0.0, 0.0),
        window: tuple[float, float, float, float] = (-1.0, 1.0, -1.0, 1.0),
    ) -> None:
        """Draw into the target from now on, cleared to this colour and to the farthest depth.

        Only the pixels of ``window`` (left, right, bottom, top, in normalised device coordinates) are touched.
        """
        self.device.check_thread()
        self.framebuffer.use()
        self.framebuffer.viewport = (0, 0, *self.size)
        self.framebuffer.scissor = self._pixels(window)
        if clear is not None:
            self.framebuffer.clear(*clear, depth=0.0)

    def _pixels(self, window: tuple[float, float, float, float]) -> tuple[int, int, int, int]:
        left, right, bottom, top = window
        width, height = self.size
        x0, x1 = math.floor((left + 1) / 2 * width), math.ceil((right + 1) / 2 * width)
        y0, y1 = math.floor((bottom + 1) / 2 * height), math.ceil((top + 1) / 2 * height)
        return x0, y0, x1 - x0, y1 - y0

    def copy_to(self, other: Target) -> None:
        """Copy the colour, resolving several samples into one."""
        self.device.check_thread()
        self.device.context.copy_framebuffer(other.framebuffer, self.framebuffer)

    def read(self) -> NDArray[np.generic]:
        """The pixels, (height, width, components), in the order of the framebuffer's rows."""
        self.device.check_thread()
        dtype = DTYPES[self.kind]
        pixels = np.empty((self.size[1], self.size[0], self.components), dtype)
        self.framebuffer.read_into(
            pixels.data.cast("B"),
            components=self.components,
            dtype=self.kind,
            alignment=1,
        )
        return pixels

    def release(self) -> None:
        """Free the target."""
        self.device.check_thread()
        self.device.rest()
        self.framebuffer.release()
        if self.color is not None:
            self.color.release()
        else:
            self._attachment.release()
        if self._depth:
            self.device.opengl.delete_renderbuffer(self._depth)
        self.device.live -= 1

    @property
    def texture(self) -> GpuTexture:
        """The colour as a texture; only of a target with one sample."""
        if self.color is None:
            raise TypeError("a multisampled target has no texture; copy it to one that has")
        return self.color


class DepthTexture:
    """A depth buffer that shaders read by comparison: what a shadow map is."""

    def __init__(self, device: Device, side: int) -> None:
        device.check_thread()
        self.device, self.side = device, side
        self.texture = device.context.depth_texture((side, side))
        self.texture.compare_func = ">="
        self.texture.repeat_x = self.texture.repeat_y = False
        self.texture.filter = (moderngl.LINEAR, moderngl.LINEAR)
        self.framebuffer = device.context.framebuffer(depth_attachment=self.texture)
        device.live += 2

    def begin(self) -> None:
        """Draw into the buffer from now on, cleared to the farthest depth."""
        self.device.check_thread()
        self.framebuffer.use()
        self.framebuffer.viewport = (0, 0, self.side, self.side)
        self.framebuffer.clear(depth=0.0)

    def bind(self, unit: int) -> None:
        """Put the texture on this unit."""
        self.texture.use(unit)

    def release(self) -> None:
        """Free texture and framebuffer."""
        self.device.check_thread()
        self.device.rest()
        self.framebuffer.release()
        self.texture.release()
        self.device.live -= 2
