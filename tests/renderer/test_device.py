"""The device: one thread, no leaks, no state left behind, and never a silent fall-back."""

from __future__ import annotations

import ctypes
import os
import subprocess
import sys
import threading
from collections.abc import Callable
from pathlib import Path
from typing import Any

import numpy as np
import pytest

from renderer.errors import DrawError, NoDevice, WrongThread
from renderer.gpu.target import Target
from renderer.passes import targets
from renderer.pipeline import Renderer
from renderer.request import FrameRequest
from tests.renderer.drawing import SIZE, asked, furthest
from tests.renderer.world import EMPTY, NAME, STILL

pytestmark = pytest.mark.usefixtures("world")

ROOT = Path(__file__).resolve().parents[2]


# ----------------------------------------------------------------------------------------------------------- one thread


def raised_in_a_thread(act: Callable[[], Any]) -> BaseException | None:
    caught: list[BaseException] = []

    def run() -> None:
        try:
            act()
        except Exception as error:  # noqa: BLE001 - whatever it is, the test wants to see it
            caught.append(error)

    thread = threading.Thread(target=run)
    thread.start()
    thread.join()
    return caught[0] if caught else None


@pytest.mark.parametrize(
    "act",
    [
        lambda r: r.render(asked()),
        lambda r: r.device.program("passes/screen.vert", "passes/accumulate.frag"),
        lambda r: Target(r.device, (4, 4)),
        lambda r: r.device.finish(),
        lambda r: r.close(),
    ],
    ids=["render", "program", "target", "finish", "close"],
)
def test_another_thread_is_refused_before_it_draws_black(renderer: Renderer, act: Callable[[Renderer], Any]) -> None:
    before = renderer.render(asked()).color

    assert isinstance(raised_in_a_thread(lambda: act(renderer)), WrongThread)
    assert furthest(renderer.render(asked()).color, before) == 0


def test_two_renderers_of_one_thread_do_not_draw_for_each_other(renderer: Renderer) -> None:
    expected = renderer.render(asked()).color
    with Renderer() as other:
        assert furthest(renderer.render(asked()).color, expected) == 0
        assert furthest(other.render(asked()).color, expected) == 0
        assert furthest(renderer.render(asked(time=3.0)).color, other.render(asked(time=3.0)).color) == 0
    assert furthest(renderer.render(asked()).color, expected) == 0


# ------------------------------------------------------------------------------------------------------------- no leaks

ROUND: list[dict[str, Any]] = [
    {
        "width": 60 + 7 * (i % 5),
        "height": 40 + 5 * (i % 3),
        "msaa": 1 + 3 * (i % 2),
        "samples": 1 + i % 3,
        "seed": i % 2,
    }
    for i in range(30)
]


def names(renderer: Renderer) -> tuple[int, ...]:
    """The names that OpenGL gives next to a buffer, a texture and a framebuffer."""
    context = renderer.device.context
    buffer, texture = context.buffer(reserve=4), context.texture((1, 1), 4)
    framebuffer = context.framebuffer([texture])
    free = (buffer.glo, texture.glo, framebuffer.glo)
    for owned in (framebuffer, texture, buffer):
        owned.release()
    return free


def made_between(before: tuple[int, ...], after: tuple[int, ...]) -> int:
    """How many objects were made since, where names are given in order; asking makes one of each kind itself."""
    rises = [b - a for a, b in zip(before, after, strict=True)]
    return sum(rises) - (3 if min(rises) > 0 else 0)


def draw_round(renderer: Renderer) -> None:
    for fields in ROUND:
        renderer.render(asked(**fields))
    renderer.render(asked())


def test_objects_do_not_multiply_while_frames_are_drawn() -> None:
    with Renderer() as renderer:
        draw_round(renderer)
        count, before = renderer.live_objects(), names(renderer)
        draw_round(renderer)

        assert count > 30
        assert renderer.live_objects() == count
        assert made_between(before, names(renderer)) == 0, "frames of known sizes make nothing at all"


def test_one_object_made_is_seen() -> None:
    with Renderer() as renderer:
        draw_round(renderer)
        before = names(renderer)
        kept = renderer.device.context.texture((1, 1), 4)

        assert made_between(before, names(renderer)) == 1
        kept.release()


def test_targets_of_sizes_that_come_no_more_are_freed(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(targets, "BUDGET", 400_000)
    with Renderer() as renderer:
        counts = []
        for side in range(40, 80, 2):
            renderer.render(asked(width=side, height=40, samples=2))
            counts.append(renderer.live_objects())

    assert max(counts[5:]) <= max(counts[:5]) + 4


def test_scenes_and_suns_come_and_go() -> None:
    with Renderer() as renderer:

        def draw_round() -> int:
            for name in (NAME, STILL, EMPTY):
                for azimuth in range(0, 300, 50):
                    renderer.render(asked(scene=name, sun={"azimuth": float(azimuth)}))
            return renderer.live_objects()

        draw_round()
        second = draw_round()

        assert draw_round() == second


# ------------------------------------------------------------------------------------------------- no state left behind

ENABLED = {
    "blend": 0x0BE2,
    "cull face": 0x0B44,
    "clip distance": 0x3000,
    "depth clamp": 0x864F,
    "polygon offset": 0x8037,
    "scissor": 0x0C11,
    "discard": 0x8C89,
}
INTEGERS = {
    "front face": 0x0B46,
    "depth function": 0x0B74,
    "clip origin": 0x935C,
    "clip depth": 0x935D,
    "depth mask": 0x0B72,
}
CLOCKWISE_NO_MORE, REVERSED = 0x0901, 0x0206


def state(renderer: Renderer) -> dict[str, int]:
    """What OpenGL itself says is set."""
    renderer.device.check_thread()
    egl = ctypes.CDLL("libEGL.so.1")
    egl.eglGetProcAddress.restype = ctypes.c_void_p
    is_enabled = ctypes.CFUNCTYPE(ctypes.c_ubyte, ctypes.c_uint)(egl.eglGetProcAddress(b"glIsEnabled"))
    integer = ctypes.CFUNCTYPE(None, ctypes.c_uint, ctypes.POINTER(ctypes.c_int))(
        egl.eglGetProcAddress(b"glGetIntegerv")
    )
    found = {name: int(is_enabled(number)) for name, number in ENABLED.items()}
    for name, number in INTEGERS.items():
        value = ctypes.c_int(0)
        integer(number, ctypes.byref(value))
        found[name] = value.value
    return found


REQUESTS: list[dict[str, Any]] = [
    {},
    {"sun": {"azimuth": 77.0, "elevation": 50.0}},
    {"samples": 3},
    {"layers": ["reflection_map"]},
    {"layers": ["water_mask"]},
    {"fog": {"density": 0.05}},
    {"camera": {"eye": [3.0, -1.0, 3.0], "target": [0.0, 1.0, 0.0]}},
    {"msaa": 4, "sun": None},
]


def test_every_frame_leaves_the_state_as_it_found_it(renderer: Renderer) -> None:
    renderer.render(asked())
    before = state(renderer)
    for fields in REQUESTS:
        renderer.render(asked(**fields))

        assert state(renderer) == before, fields
    assert before["front face"] == CLOCKWISE_NO_MORE
    assert before["depth function"] == REVERSED
    assert not before["clip distance"]
    assert not before["depth clamp"]
    assert not before["polygon offset"]


# --------------------------------------------------------------------------------------------- errors are not swallowed


def test_an_opengl_error_is_raised_with_its_place(renderer: Renderer) -> None:
    renderer.device.check_thread()
    renderer.device.opengl.call("glBindRenderbuffer", 1, 1)

    with pytest.raises(DrawError, match="GL_INVALID_ENUM in a test on"):
        renderer.device.check_errors("a test")
    renderer.device.check_errors("and then no more")


def test_a_picture_that_was_not_drawn_is_no_picture(renderer: Renderer, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(renderer._composite._screen, "draw", lambda *_: None)

    with pytest.raises(DrawError, match="undrawn"):
        renderer.render(asked())


# --------------------------------------------------------------------------------------------------- which device it is

ASK = """
import sys
from renderer.errors import NoDevice
from renderer.pipeline import Renderer
try:
    with Renderer(sys.argv[1]) as renderer:
        print("drew", renderer.is_software, renderer.driver)
except NoDevice as error:
    print("refused", error)
"""


def answer(require: str) -> str:
    """What a fresh process says to this demand."""
    run = subprocess.run(
        [sys.executable, "-c", ASK, require], cwd=ROOT, capture_output=True, text=True, check=True, timeout=120
    )
    return run.stdout


def test_a_demand_for_a_gpu_is_met_or_refused_with_the_doctors_text(renderer: Renderer) -> None:
    said = answer("gpu")
    if said.startswith("drew"):
        assert said.startswith("drew False"), "software must never stand in for a GPU"
        return

    assert "no EGL device meets require=gpu" in said
    assert "Millpond cannot draw here as demanded" in said
    assert "This mends it" in said
    assert renderer.is_software


def test_a_demand_for_a_cpu_is_never_met_by_a_gpu() -> None:
    said = answer("cpu")

    assert said.startswith("drew True") or "no EGL device meets require=cpu" in said


def test_no_device_at_all_is_told_with_every_attempt(monkeypatch: pytest.MonkeyPatch) -> None:
    def refuse(*_: object, **__: object) -> None:
        raise RuntimeError("the driver is on holiday")

    monkeypatch.setattr("renderer.gpu.device.moderngl.create_context", refuse)

    with pytest.raises(NoDevice, match="holiday"):
        Renderer()


def test_the_driver_is_named(renderer: Renderer) -> None:
    frame = renderer.render(FrameRequest.parse({"scene": NAME, "width": SIZE[0], "height": SIZE[1]}))

    assert frame.renderer == renderer.driver
    assert "/ 4." in renderer.driver
    assert len(renderer.fingerprint) == 16
    assert np.asarray(frame.color).std() > 10
    assert os.environ["LP_NUM_THREADS"].isdigit(), "settled before the first context"
