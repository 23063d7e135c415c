"""The few OpenGL entry points that moderngl does not offer, found through EGL."""

from __future__ import annotations

import ctypes
import ctypes.util
from typing import Any

import moderngl

from renderer.errors import NoDevice

GL_FRAMEBUFFER = 0x8D40
GL_RENDERBUFFER = 0x8D41
GL_DEPTH_ATTACHMENT = 0x8D00
GL_DEPTH_COMPONENT32F = 0x8CAC
GL_LOWER_LEFT = 0x8CA1
GL_ZERO_TO_ONE = 0x935F
GL_CLIP_DISTANCE0 = 0x3000
GL_DEPTH_CLAMP = 0x864F
GL_POLYGON_OFFSET_FILL = 0x8037
GL_TEXTURE_2D = 0x0DE1
GL_TEXTURE_WRAP_S = 0x2802
GL_TEXTURE_WRAP_T = 0x2803
GL_MIRRORED_REPEAT = 0x8370

_Uint = ctypes.c_uint
_Names = ctypes.POINTER(ctypes.c_uint)
SIGNATURES: dict[str, tuple[Any, ...]] = {
    "glClipControl": (_Uint, _Uint),
    "glGenRenderbuffers": (ctypes.c_int, _Names),
    "glDeleteRenderbuffers": (ctypes.c_int, _Names),
    "glBindRenderbuffer": (_Uint, _Uint),
    "glRenderbufferStorageMultisample": (
        _Uint,
        ctypes.c_int,
        _Uint,
        ctypes.c_int,
        ctypes.c_int,
    ),
    "glBindFramebuffer": (_Uint, _Uint),
    "glFramebufferRenderbuffer": (_Uint, _Uint, _Uint, _Uint),
    "glFinish": (),
    "glTexParameteri": (_Uint, _Uint, ctypes.c_int),
}


class OpenGL:
    """Entry points of the current context, as callables by name."""

    def __init__(self) -> None:
        try:
            egl = ctypes.CDLL("libEGL.so.1")
        except OSError as error:
            raise NoDevice(f"libEGL.so.1 could not be loaded: {error}") from None
        egl.eglGetProcAddress.restype = ctypes.c_void_p
        self._calls: dict[str, Any] = {}
        for name, arguments in SIGNATURES.items():
            address = egl.eglGetProcAddress(name.encode())
            if address:
                self._calls[name] = ctypes.CFUNCTYPE(None, *arguments)(address)

    def has(self, name: str) -> bool:
        """Whether the driver offers this entry point."""
        return name in self._calls

    def call(self, name: str, *arguments: Any) -> None:
        """Call an entry point of ``SIGNATURES``."""
        self._calls[name](*arguments)

    def depth_renderbuffer(self, size: tuple[int, int], samples: int) -> int:
        """A new 32-bit float depth buffer; its name."""
        name = ctypes.c_uint(0)
        self.call("glGenRenderbuffers", 1, ctypes.byref(name))
        self.call("glBindRenderbuffer", GL_RENDERBUFFER, name.value)
        self.call(
            "glRenderbufferStorageMultisample",
            GL_RENDERBUFFER,
            samples if samples > 1 else 0,
            GL_DEPTH_COMPONENT32F,
            *size,
        )
        return int(name.value)

    def mirror_texture(self, texture: moderngl.Texture) -> None:
        """Let a texture be read past its edges as if it were mirrored there."""
        texture.use(0)
        for side in (GL_TEXTURE_WRAP_S, GL_TEXTURE_WRAP_T):
            self.call("glTexParameteri", GL_TEXTURE_2D, side, GL_MIRRORED_REPEAT)

    def attach_depth(self, framebuffer: int, renderbuffer: int) -> None:
        """Give a framebuffer this depth buffer."""
        self.call("glBindFramebuffer", GL_FRAMEBUFFER, framebuffer)
        self.call(
            "glFramebufferRenderbuffer",
            GL_FRAMEBUFFER,
            GL_DEPTH_ATTACHMENT,
            GL_RENDERBUFFER,
            renderbuffer,
        )

    def delete_renderbuffer(self, name: int) -> None:
        """Free a depth buffer."""
        self.call("glDeleteRenderbuffers", 1, ctypes.byref(ctypes.c_uint(name)))
