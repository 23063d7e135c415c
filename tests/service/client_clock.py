"""A clock and a hand for scripts: carries them out with given answers, in no time."""

from __future__ import annotations

import json
from typing import Any, TypeVar

from millpond.exchange import Policy, Reply, Script, Send, Sleep

T = TypeVar("T")


class Clock:
    """Time that passes when a script sleeps, and by ``cost`` for each call."""

    def __init__(self, cost: float = 0.0) -> None:
        self.now = 1000.0
        self.cost = cost
        self.slept: list[float] = []
        self.sent: list[Send] = []

    def policy(self, timeout: float = 60.0, retries: int = 5, jitter: float = 1.0) -> Policy:
        return Policy(timeout, retries, lambda: self.now, lambda: jitter)

    def play(self, script: Script[T], *answers: Reply | Exception) -> T:
        """Carry a script out with these answers; the last is repeated for ever."""
        left: list[Reply | Exception] = list(answers)
        given: Reply | Exception | None = None
        while True:
            try:
                step = script.throw(given) if isinstance(given, Exception) else script.send(given)
            except StopIteration as stop:
                result: T = stop.value
                return result
            if isinstance(step, Sleep):
                self.slept.append(step.seconds)
                self.now += step.seconds
                given = None
            else:
                self.sent.append(step)
                self.now += self.cost
                given = left.pop(0) if len(left) > 1 else left[0]


def refusal(status: int, **headers: str) -> Reply:
    return Reply(status, {name.replace("_", "-"): value for name, value in headers.items()}, b"{}")


def job(state: str, done: int = 0, **facts: Any) -> Reply:
    counts = {"total": 4, "done": done, "failed": 0, "pending": 4 - done, "leased": 0}
    return Reply(
        200, {}, json.dumps({"id": "a", "kind": "turntable", "state": state, "counts": counts, **facts}).encode()
    )


OK = Reply(200, {}, b'{"fine": true}')
