"""The state machine of jobs: the table itself, and the store against a model under every order of events."""

from __future__ import annotations

import itertools
import tempfile
from pathlib import Path
from typing import ClassVar

import pytest
from hypothesis import Phase, settings
from hypothesis import strategies as st
from hypothesis.stateful import RuleBasedStateMachine, initialize, invariant, precondition, rule

from service.errors import JobExpired, TransitionRefused
from service.jobs.job import (
    ENDED,
    IDEMPOTENT,
    TRANSITIONS,
    Action,
    Done,
    Failed,
    JobState,
    Lease,
    Released,
    Report,
    after,
)
from service.jobs.leases import Leases
from service.jobs.store import JobStore, Submission

EVERY = list(itertools.product(Action, JobState))


def test_nothing_follows_expired() -> None:
    assert all(JobState.EXPIRED not in table for table in TRANSITIONS.values())


def test_every_state_can_be_reached_and_every_ended_one_expires() -> None:
    reached = {JobState.QUEUED} | {state for table in TRANSITIONS.values() for state in table.values()}

    assert reached == set(JobState)
    assert set(TRANSITIONS[Action.EXPIRE]) == ENDED - {JobState.EXPIRED}


@pytest.mark.parametrize(("action", "state"), EVERY)
def test_what_is_not_in_the_table_can_not_happen(action: Action, state: JobState) -> None:
    if state in TRANSITIONS[action]:
        assert after(state, action) is TRANSITIONS[action][state]
    elif state in IDEMPOTENT.get(action, ()):
        assert after(state, action) is state
    else:
        with pytest.raises(TransitionRefused) as refusal:
            after(state, action, "j1")
        assert (refusal.value.action, refusal.value.state, refusal.value.job_id) == (action, state, "j1")


class Life(RuleBasedStateMachine):
    """One job of four frames, two dispatchers, a caller: whatever they do in whatever order, nothing is lost."""

    FRAMES: ClassVar[int] = 4

    def __init__(self) -> None:
        super().__init__()
        self.folder = tempfile.TemporaryDirectory()
        self.store = JobStore(f"sqlite:///{Path(self.folder.name) / 'jobs.sqlite3'}")
        self.dispatchers = [Leases(self.store, "a"), Leases(self.store, "b")]
        self.job_id = ""
        self.live: dict[int, Lease] = {}
        """Leases that hold, by frame."""
        self.stale: list[Lease] = []
        self.done: dict[int, str] = {}
        self.serial = itertools.count()

    def teardown(self) -> None:
        self.store.close()
        self.folder.cleanup()

    @initialize()
    def submit(self) -> None:
        frames = [(f"{index:064x}", b"{}") for index in range(self.FRAMES)]
        self.job_id = self.store.submit(Submission("turntable", {"outputs": []}, frames, "digest")).id

    @property
    def state(self) -> JobState:
        return self.store.job(self.job_id)[0].state

    @rule(who=st.integers(0, 1), want=st.integers(0, 3))
    def claim(self, who: int, want: int) -> None:
        before = self.state
        claimed = self.dispatchers[who].exchange([], want).claimed
        for lease in claimed:
            assert before in {JobState.QUEUED, JobState.RUNNING}
            assert lease.index not in self.live
            assert lease.index not in self.done
            self.live[lease.index] = lease
        # A resumed job is queued until a frame of it is claimed anew, though some may still be out from before.
        if claimed and before is JobState.QUEUED:
            assert self.state is JobState.RUNNING

    def _drop(self, index: int) -> Lease:
        lease = self.live.pop(index)
        self.stale.append(lease)
        return lease

    @precondition(lambda self: self.live)
    @rule(who=st.integers(0, 1), data=st.data())
    def finish(self, who: int, data: st.DataObject) -> None:
        lease = self._drop(data.draw(st.sampled_from(sorted(self.live))))
        digest = f"{next(self.serial):064x}"
        self.done[lease.index] = digest
        self.dispatchers[who].exchange([Done(lease, lease.key, digest, 1, "f")], 0)

    @precondition(lambda self: self.live)
    @rule(data=st.data(), may_retry=st.booleans())
    def fail(self, data: st.DataObject, *, may_retry: bool) -> None:
        lease = self._drop(data.draw(st.sampled_from(sorted(self.live))))
        self.dispatchers[0].exchange([Failed(lease, "render-failed", "broken", may_retry)], 0)

    @precondition(lambda self: self.live)
    @rule(data=st.data())
    def release(self, data: st.DataObject) -> None:
        lease = self._drop(data.draw(st.sampled_from(sorted(self.live))))
        self.dispatchers[0].exchange([Released(lease)], 0)

    @precondition(lambda self: self.stale)
    @rule(data=st.data(), kind=st.sampled_from(["done", "failed", "released"]))
    def report_late(self, data: st.DataObject, kind: str) -> None:
        """Whatever comes without its lease changes nothing."""
        lease = data.draw(st.sampled_from(self.stale))
        if self.live.get(lease.index) == lease:
            return
        before = (self.state, self.store.frames(self.job_id))
        reports: dict[str, Report] = {
            "done": Done(lease, lease.key, "f" * 64, 1, "late"),
            "failed": Failed(lease, "late", "late", may_retry=False),
            "released": Released(lease),
        }
        self.dispatchers[1].exchange([reports[kind]], 0)
        assert (self.state, self.store.frames(self.job_id)) == before

    @rule()
    def restart(self) -> None:
        """The service dies and comes back: its leases are void."""
        for index in list(self.live):
            self._drop(index)
        self.dispatchers[0].reclaim(everything=True)

    @rule(action=st.sampled_from([Action.CANCEL, Action.PAUSE, Action.RESUME, Action.RETRY]))
    def act(self, action: Action) -> None:
        before = self.state
        try:
            expected = after(before, action)
        except TransitionRefused:
            with pytest.raises(TransitionRefused):
                self.store.act(self.job_id, action)
            assert self.state is before
            return
        if action is Action.CANCEL and before is not JobState.CANCELLED:
            for index in list(self.live):
                self._drop(index)
        assert self.store.act(self.job_id, action).state is expected

    @invariant()
    def frames_are_where_they_should_be(self) -> None:
        if not self.job_id:
            return
        frames = self.store.frames(self.job_id)
        assert len(frames) == self.FRAMES
        assert {f.index: f.digest for f in frames if f.state == "done"} == self.done
        assert {f.index for f in frames if f.state == "leased"} == set(self.live)
        state, left = self.state, [f for f in frames if f.state in {"pending", "leased"}]
        assert (state is JobState.SUCCEEDED) == (len(self.done) == self.FRAMES)
        if state in {JobState.RUNNING, JobState.QUEUED, JobState.PAUSED}:
            assert left
        if state is JobState.FAILED:
            assert not left
            assert any(f.state == "failed" for f in frames)


Life.TestCase.settings = settings(
    max_examples=40, stateful_step_count=25, deadline=None, phases=[Phase.explicit, Phase.reuse, Phase.generate]
)
test_nothing_is_lost_in_any_order_of_events = Life.TestCase


def test_an_expired_job_has_forgotten_its_frames(tmp_path: Path) -> None:
    store = JobStore(f"sqlite:///{tmp_path / 'jobs.sqlite3'}")
    job = store.submit(Submission("turntable", {}, [("0" * 64, b"{}")], "digest"))
    lease = Leases(store, "a").exchange([], 1).claimed[0]

    assert store.expire(before=float("inf")) == 0  # it has not ended
    Leases(store, "a").exchange([Done(lease, lease.key, "d" * 64, 1, "f")], 0)
    assert len(store.pinned()) == 1
    assert store.expire(before=0.0) == 0
    assert store.expire(before=float("inf")) == 1
    with pytest.raises(JobExpired):
        store.job(job.id)
    with pytest.raises(JobExpired):
        store.act(job.id, Action.RETRY)
    assert store.pinned() == frozenset()
    Leases(store, "a").exchange([Done(lease, lease.key, "d" * 64, 1, "f")], 1)
    store.close()
