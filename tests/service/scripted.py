"""A drawer that does what a frame's seed says, without OpenGL: for tests of what happens around a renderer.

It is imported by worker processes, by this name.
"""

from __future__ import annotations

import faulthandler
import hashlib
import json
import os
import signal
import time
from collections.abc import Callable
from enum import IntEnum
from pathlib import Path

import numpy as np

from renderer.encode.image import encode_png
from renderer.errors import Cancelled, EncodeError, NoDevice
from service.artifacts import LocalArtifacts, artifact_name
from service.worker import FrameReport, FrameTask, WorkerConfig, WorkerFacts

FINGERPRINT = "scripted"
DRIVER = "pencil and paper"


class Seed(IntEnum):
    """What a frame does to its worker."""

    DRAW = 0
    DIE = 1
    DIE_ONCE = 2
    STOP_ONCE = 3
    SLEEP = 4
    """Hang without using the CPU."""
    SPIN = 5
    """Hang with it, deaf to cancelling."""
    RAISE = 6
    WAIT = 7
    """Draw once the gate is open, or stop when cancelled."""
    FAIL_ODDLY = 8
    """Raise what can't be pickled."""
    DRAW_SLOWLY = 9
    SPIN_UNGUARDED = 10
    """Hang with the CPU, without the deadline that the process holds itself."""


class Scripted:
    """Draws one colour, decided by the frame's time."""

    def __init__(self, config: WorkerConfig) -> None:
        self._room = config.artifacts.parent
        self._artifacts = LocalArtifacts(config.artifacts)
        self.facts = WorkerFacts(os.getpid(), DRIVER, True, FINGERPRINT, "c0ffee", 0.0)

    def render(self, task: FrameTask, is_cancelled: Callable[[], bool]) -> FrameReport:
        note(self._room, task.key)
        request = json.loads(task.request)
        _behave(Seed(request["seed"]), self._room, task.key, is_cancelled)
        data = picture(request["width"], request["height"], request["time"])
        artifact = self._artifacts.put(artifact_name(task.key, FINGERPRINT), data)
        timings = {"render": 0.01, "encode": 0.001}
        return FrameReport(
            task.key, FINGERPRINT, artifact.digest, artifact.size, DRIVER, timings, rss=1, pid=os.getpid()
        )

    def close(self) -> None:
        """Nothing to give back."""


def scripted(config: WorkerConfig) -> Scripted:
    return Scripted(config)


def no_device(config: WorkerConfig) -> Scripted:
    raise NoDevice("Looked for libEGL.so.1; found nothing.")


def picture(width: int, height: int, moment: float) -> bytes:
    color = np.frombuffer(hashlib.sha256(repr(float(moment)).encode()).digest()[:3], np.uint8)
    return encode_png(np.broadcast_to(color, (height, width, 3)).copy(), {})


def note(room: Path, key: str) -> None:
    """Write down that a frame was begun, in one write, whoever dies next."""
    with (room / "begun").open("ab", buffering=0) as log:
        log.write(f"{key} {os.getpid()}\n".encode())


def begun(room: Path) -> list[str]:
    """Keys of the frames that were begun, in that order."""
    log = room / "begun"
    return [line.split()[0] for line in log.read_text().splitlines()] if log.exists() else []


def open_gate(room: Path) -> None:
    (room / "gate").touch()


def _behave(seed: Seed, room: Path, key: str, is_cancelled: Callable[[], bool]) -> None:
    if seed is Seed.DIE:
        os.kill(os.getpid(), signal.SIGKILL)
    elif seed is Seed.DIE_ONCE:
        _once(room, key, signal.SIGKILL)
    elif seed is Seed.STOP_ONCE:
        _once(room, key, signal.SIGSTOP)
    elif seed is Seed.RAISE:
        raise EncodeError("the pencil broke")
    elif seed is Seed.FAIL_ODDLY:
        raise type("Local", (Exception,), {})("odd")
    else:
        _take_time(seed, room, is_cancelled)


def _take_time(seed: Seed, room: Path, is_cancelled: Callable[[], bool]) -> None:
    if seed is Seed.SLEEP:
        time.sleep(60)
    elif seed in {Seed.SPIN, Seed.SPIN_UNGUARDED}:
        if seed is Seed.SPIN_UNGUARDED:
            faulthandler.cancel_dump_traceback_later()
        end = time.monotonic() + 60
        while time.monotonic() < end:
            pass
    elif seed is Seed.DRAW_SLOWLY:
        _spin(0.1, lambda: False)
    elif seed is Seed.WAIT:
        _spin(30, lambda: (room / "gate").exists() or is_cancelled())
        if is_cancelled():
            raise Cancelled


def _once(room: Path, key: str, number: signal.Signals) -> None:
    mark = room / f"once-{key[:16]}"
    if not mark.exists():
        mark.touch()
        os.kill(os.getpid(), number)


def _spin(seconds: float, is_over: Callable[[], bool]) -> None:
    """Pass time with a little work, so that it does not look like a hang."""
    end = time.monotonic() + seconds
    while time.monotonic() < end and not is_over():
        hashlib.sha256(bytes(2_000_000)).digest()
        time.sleep(0.01)
