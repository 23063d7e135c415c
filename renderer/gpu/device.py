"""The EGL device: one context, one thread, for life.

Measured on Mesa's software driver: a context used from another thread draws an all-black frame
without an error. Every entry into this room therefore checks its thread.
"""

from __future__ import annotations

import re
import threading
from collections.abc import Iterable, Mapping
from typing import Any, Literal

import moderngl

from renderer.blocks import Block
from renderer.errors import DrawError, NoDevice, ShaderError, WrongThread
from renderer.gpu.opengl import GL_LOWER_LEFT, GL_ZERO_TO_ONE, OpenGL
from renderer.gpu.probe import device_settings
from renderer.gpu.program import Program
from renderer.gpu.source import Source, preprocess

Require = Literal["any", "gpu", "cpu"]
SOFTWARE = re.compile(r"llvmpipe|softpipe|swrast|swiftshader|software", re.IGNORECASE)
OPENGL = 450
MAX_DEVICES = 16
_THREAD = threading.local()
"""Holds, in ``device``, the device whose context is this thread's current one."""


class Device:
    """An OpenGL 4.5 context without a display, and what is made in it."""

    def __init__(self, require: Require = "any") -> None:
        self._owner = threading.get_ident()
        self.context = _open(require)
        self._make_current()
        self.opengl = OpenGL()
        self.live = 0
        """How many buffers, textures and framebuffers exist: flat while frames are drawn."""
        self._nothing: moderngl.Framebuffer | None = None
        self._programs: dict[Any, Program] = {}
        self._bindings: dict[str, int] = {}
        # Nothing is collected behind our back: what is made here is released here.
        if not self.opengl.has("glClipControl"):
            raise NoDevice(f"{self.driver} offers no glClipControl (OpenGL 4.5)")
        # Reversed depth in a 0..1 clip range: a float then resolves a shoreline from 1 cm to 60 km.
        self.opengl.call("glClipControl", GL_LOWER_LEFT, GL_ZERO_TO_ONE)

    @property
    def driver(self) -> str:
        """The driver's own name with its OpenGL version."""
        info = self.context.info
        return f"{info['GL_RENDERER']} / {info['GL_VERSION']}"

    @property
    def is_software(self) -> bool:
        """Whether the device is a CPU."""
        return bool(SOFTWARE.search(str(self.context.info["GL_RENDERER"])))

    def check_thread(self) -> None:
        """Raise ``WrongThread`` in any thread but the context's own; there, make the context the current one."""
        if threading.get_ident() != self._owner:
            raise WrongThread
        if _THREAD.device is not self:
            self._make_current()

    def _make_current(self) -> None:
        # Whoever made a context last holds the thread: without this a second device would draw for the first.
        self.context.__enter__()  # type: ignore[no-untyped-call]  # moderngl types all else
        _THREAD.device = self

    def rest(self) -> None:
        """Draw into nothing: a framebuffer may only be released while another one is bound."""
        if self._nothing is None:
            self._nothing = self.context.framebuffer([self.context.renderbuffer((1, 1))])
        self._nothing.use()

    def check_errors(self, where: str) -> None:
        """Raise ``DrawError`` where OpenGL has an error to report."""
        error = self.context.error
        if error != "GL_NO_ERROR":
            raise DrawError(f"{error} in {where} on {self.driver}")

    def finish(self) -> None:
        """Wait until all that was asked for is drawn."""
        self.check_thread()
        self.opengl.call("glFinish")

    def binding(self, block: str) -> int:
        """The binding point of a uniform block: one for each name, in every program."""
        return self._bindings.setdefault(block, len(self._bindings))

    def program(
        self,
        vertex: str,
        fragment: str | None,
        *,
        defines: Iterable[str] = (),
        blocks: Iterable[type[Block]] = (),
        aliases: Mapping[str, str] | None = None,
        varyings: tuple[str, ...] = (),
    ) -> Program:
        """The program of these files, compiled once."""
        self.check_thread()
        defines, blocks = tuple(sorted(defines)), tuple(blocks)
        key = (vertex, fragment, defines, blocks, tuple(sorted((aliases or {}).items())), varyings)
        if key not in self._programs:
            stages = {
                stage: preprocess(file, defines=defines, blocks=blocks, aliases=aliases)
                for stage, file in (("vertex", vertex), ("fragment", fragment))
                if file
            }
            self._programs[key] = Program(self.binding, self._link(stages, varyings))
        return self._programs[key]

    def _link(self, stages: Mapping[str, Source], varyings: tuple[str, ...]) -> moderngl.Program:
        try:
            return self.context.program(
                vertex_shader=stages["vertex"].text,
                fragment_shader=stages["fragment"].text if "fragment" in stages else None,
                varyings=varyings,
            )
        except moderngl.Error as error:
            log = str(error)
            stage = "fragment" if "fragment_shader" in log and "fragment" in stages else "vertex"
            raise ShaderError(stages[stage].explain(log)) from None

    def close(self) -> None:
        """Release the context and all that was made in it."""
        self.check_thread()
        self.context.release()
        _THREAD.device = None


def _open(require: Require) -> moderngl.Context:
    """The best device that meets the demand: every one is tried, hardware before software."""
    failures: list[str] = []
    software: moderngl.Context | None = None
    _THREAD.device = None  # each context takes the thread as it is made, also one that is then refused
    for index in range(MAX_DEVICES):
        try:
            context = moderngl.create_context(OPENGL, standalone=True, **device_settings(index))
        except Exception as error:  # noqa: BLE001 - moderngl raises bare Exceptions for every failure
            failures.append(f"device {index}: {error}")
            if "requested device index" in str(error) or "not loaded" in str(error):
                break
            continue
        if not SOFTWARE.search(str(context.info["GL_RENDERER"])):
            if require != "cpu":
                if software is not None:
                    software.release()
                return context
            failures.append(f"device {index}: {context.info['GL_RENDERER']} is no CPU")
            context.release()
        elif software is None:
            software = context
        else:
            context.release()
    if software is not None and require != "gpu":
        return software
    if software is not None:
        failures.append(f"{software.info['GL_RENDERER']} is no GPU")
        software.release()
    raise NoDevice(f"no EGL device meets require={require}: " + "; ".join(failures))
