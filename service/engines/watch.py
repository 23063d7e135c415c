"""The watch over one worker process: what it may not be doing, and its end, by its own pid only."""

from __future__ import annotations

from typing import Literal

import psutil

TICK = 0.25
"""Seconds between two looks."""
_STOPPED_LOOKS = 2
"""Looks at which a process must be found stopped: a terminal's stop of everything is no reason to kill."""
_IDLE_LOOKS = 8
"""Looks (2 s) without any CPU time, while it owns a frame, after which a process counts as hung."""
_LATE = 0.5
"""Seconds after a frame's deadline, which the process holds itself, at which it is held from outside."""
_LOST_LOOKS = 8
"""Looks (2 s) after its end at which no report about a process's frame is expected any more."""


class Watch:
    """Looks at a process every ``TICK`` seconds.

    It counts looks and not seconds, so that a pause of the whole machine or of this process harms nobody.
    ``watches_cpu`` is false where the drawing is done elsewhere, on a GPU.
    """

    def __init__(self, process: psutil.Process, *, watches_cpu: bool = True) -> None:
        self._process = process
        self._watches_cpu = watches_cpu
        self._deadline: float | None = None
        self._cpu_deadline: float | None = None
        self._limit = self._wall = 0.0
        self._cpu = -1.0
        self._stopped = self._idle = self._lost = 0
        self.sentence = ""
        """Why it was ended; empty while it was not ended here."""
        self.is_overdue = False
        """Whether it was ended for a frame's deadline."""

    def begin(self, limit: float, wall: float) -> None:
        """It was given a frame, to be drawn in ``limit`` seconds of its CPU time and ``wall`` seconds."""
        self._limit, self._wall = limit, wall
        self._deadline = self._cpu_deadline = None
        self._cpu, self._idle = -1.0, 0

    @property
    def complaint(self) -> str | None:
        """What is wrong with the process, or None."""
        if self.sentence:
            return self.sentence
        return "the process is stopped" if self._stopped else None

    def look(self, *, is_busy: bool, now: float) -> Literal["well", "lost"]:
        """Look once, and end the process if it must be; ``lost`` when it is gone for good.

        ``now`` is in monotonic seconds.
        """
        try:
            status = self._process.status()
            times = self._process.cpu_times()
        except psutil.NoSuchProcess:
            status = psutil.STATUS_DEAD
        if status in {psutil.STATUS_DEAD, psutil.STATUS_ZOMBIE}:
            self._lost += 1
            return "lost" if self._lost >= _LOST_LOOKS or not is_busy else "well"
        if self.sentence:  # ended, and not gone yet
            self._lost += 1
            return "lost" if self._lost >= 2 * _LOST_LOOKS else "well"
        self._stopped = self._stopped + 1 if status == psutil.STATUS_STOPPED else 0
        if self._stopped >= _STOPPED_LOOKS:
            self.kill("it was stopped")
        elif is_busy:
            self._look_at_frame(status, times.user + times.system, now)
        return "well"

    def kill(self, sentence: str = "it was told to end") -> None:
        """End the process; psutil makes sure that the pid still means the same one."""
        self.sentence = sentence
        try:
            self._process.kill()
        except psutil.NoSuchProcess:
            return

    def _look_at_frame(self, status: str, cpu: float, now: float) -> None:
        if self._deadline is None or self._cpu_deadline is None:
            self._deadline, self._cpu_deadline = now + self._wall + _LATE, cpu + self._limit
        is_overdue = now > self._deadline or (self._watches_cpu and cpu > self._cpu_deadline)
        if is_overdue:
            self.is_overdue = True
            self.kill("its frame was overdue")
            return
        # Running or waiting for a disk is no hang, even where others take all of the CPU.
        is_asleep = status == psutil.STATUS_SLEEPING and cpu == self._cpu
        self._idle = self._idle + 1 if is_asleep else 0
        self._cpu = cpu
        if self._watches_cpu and self._idle >= _IDLE_LOOKS:
            self.kill("it used no CPU for 2 s")
