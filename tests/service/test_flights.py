from __future__ import annotations

from pathlib import Path
from typing import Any

import pytest

from renderer.errors import EncodeError
from service import poison
from service.cost import CostModel
from service.engines.base import Lane
from service.errors import EngineUnavailable, FramePoisoned, FrameTimedOut, QueueFull, WorkerDied
from service.flights import Deadlines, Flights, Ticket
from tests.service.core import frame
from tests.service.puppet import Puppet


@pytest.fixture
def puppet(tmp_path: Path) -> Puppet:
    return Puppet(tmp_path)


@pytest.fixture
def flights(puppet: Puppet) -> Flights:
    return Flights(puppet, CostModel(), Deadlines(), 10.0, lambda *_: None)


def _join(flights: Flights, moment: float = 0.0, lane: Lane = Lane.INTERACTIVE, **fields: Any) -> Ticket:
    request = frame(moment, **fields)
    return flights.join(request, request.key(), lane)


def test_one_key_is_sent_off_once_however_many_wait(flights: Flights, puppet: Puppet) -> None:
    tickets = [_join(flights) for _ in range(5)]
    report = puppet.finish()

    assert len(puppet.submitted) == 1
    assert [ticket.future.result(1) for ticket in tickets] == [report] * 5
    assert flights.counts.joined == 4


def test_a_finished_key_is_sent_off_anew(flights: Flights, puppet: Puppet) -> None:
    _join(flights)
    puppet.finish()
    _join(flights)

    assert len(puppet.submitted) == 2


def test_a_batch_frame_that_somebody_looks_at_is_promoted_and_joined(flights: Flights, puppet: Puppet) -> None:
    batch = _join(flights, lane=Lane.BATCH)
    screen = _join(flights, lane=Lane.INTERACTIVE)
    report = puppet.finish()

    assert len(puppet.submitted) == len(puppet.promoted) == 1
    assert batch.future.result(1) == screen.future.result(1) == report


def test_an_interactive_frame_that_batch_joins_stays_interactive(flights: Flights, puppet: Puppet) -> None:
    _join(flights, lane=Lane.INTERACTIVE)
    _join(flights, lane=Lane.BATCH)

    assert puppet.promoted == []


def test_the_last_waiter_that_leaves_cancels_the_frame(flights: Flights, puppet: Puppet) -> None:
    first, second = _join(flights), _join(flights)
    first.leave()
    early = list(puppet.cancelled)
    second.leave()
    second.leave()

    assert early == []
    assert len(puppet.cancelled) == 1
    assert flights.counts.cancelled == 1


def test_a_job_that_waits_keeps_the_frame_of_a_client_that_leaves(flights: Flights, puppet: Puppet) -> None:
    batch = _join(flights, lane=Lane.BATCH)
    _join(flights, lane=Lane.INTERACTIVE).leave()
    puppet.finish()

    assert puppet.cancelled == []
    assert batch.future.result(1).size > 0


def test_who_comes_after_a_cancel_gets_a_frame_of_his_own(flights: Flights, puppet: Puppet) -> None:
    _join(flights).leave()
    late = _join(flights)
    report = puppet.finish()

    assert len(puppet.submitted) == 2
    assert late.future.result(1) == report


def test_leaving_after_the_end_changes_nothing(flights: Flights, puppet: Puppet) -> None:
    ticket = _join(flights)
    puppet.finish()
    ticket.leave()

    assert puppet.cancelled == []


def test_a_frame_whose_worker_died_is_sent_off_once_more(flights: Flights, puppet: Puppet) -> None:
    ticket = _join(flights, lane=Lane.BATCH)
    puppet.fail(WorkerDied(exit_code=-9))
    report = puppet.finish()

    assert puppet.submitted[0] == puppet.submitted[1]
    assert ticket.future.result(1) == report
    assert flights.counts.deaths == 1


def test_a_second_death_sets_the_key_aside_with_its_reason(flights: Flights, puppet: Puppet) -> None:
    ticket = _join(flights)
    puppet.fail(WorkerDied(exit_code=-9))
    puppet.fail(WorkerDied(exit_code=-11))

    with pytest.raises(FramePoisoned, match="SIGSEGV") as poisoned:
        ticket.future.result(1)
    assert poisoned.value.key == frame().key()
    with pytest.raises(FramePoisoned, match="SIGSEGV") as again:
        _join(flights)
    assert 0 < again.value.retry_after <= poison.SET_ASIDE
    assert len(puppet.submitted) == 2
    _join(flights, 1.0)


def test_a_key_is_set_aside_for_a_while_only(flights: Flights, puppet: Puppet, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(poison, "SET_ASIDE", -1.0)
    _join(flights)
    puppet.fail(WorkerDied(exit_code=-9))
    puppet.finish()

    _join(flights)


def test_a_frame_that_was_drawn_is_forgiven(flights: Flights, puppet: Puppet) -> None:
    for _ in range(3):
        ticket = _join(flights)
        puppet.fail(WorkerDied(exit_code=-9))
        puppet.finish()

        assert ticket.future.result(1).size > 0


def test_a_frame_that_timed_out_is_told_at_once_and_poison_the_second_time(flights: Flights, puppet: Puppet) -> None:
    for _ in range(2):
        ticket = _join(flights)
        puppet.fail(FrameTimedOut(10.0))
        with pytest.raises(FrameTimedOut):
            ticket.future.result(1)

    with pytest.raises(FramePoisoned):
        _join(flights)
    assert len(puppet.submitted) == 2


def test_what_the_renderer_raises_goes_to_everybody_and_is_not_tried_again(flights: Flights, puppet: Puppet) -> None:
    tickets = [_join(flights), _join(flights)]
    puppet.fail(EncodeError("broken"))

    for ticket in tickets:
        with pytest.raises(EncodeError):
            ticket.future.result(1)
    assert len(puppet.submitted) == 1


def test_an_engine_that_refuses_the_second_try_is_told(flights: Flights, puppet: Puppet) -> None:
    ticket = _join(flights)
    puppet.refusal = EngineUnavailable("closed")
    puppet.fail(WorkerDied(exit_code=-9))

    with pytest.raises(EngineUnavailable):
        ticket.future.result(1)
    puppet.refusal = None
    _join(flights)


def test_an_engine_that_refuses_leaves_no_trace(flights: Flights, puppet: Puppet) -> None:
    puppet.refusal = EngineUnavailable("closed")
    with pytest.raises(EngineUnavailable):
        _join(flights)
    puppet.refusal = None
    ticket = _join(flights)
    puppet.finish()

    assert ticket.future.result(1).size > 0


def test_more_predicted_work_than_may_wait_is_refused_at_once(flights: Flights, puppet: Puppet) -> None:
    big: dict[str, Any] = {"width": 2048, "height": 2048}  # 2.9 s each, as long as nothing was measured
    for moment in range(3):
        _join(flights, float(moment), **big)
    with pytest.raises(QueueFull) as full:
        _join(flights, 9.0, **big)

    assert full.value.waiting > full.value.bound == 10.0
    assert full.value.retry_after >= 1
    assert flights.counts.refused == 1
    _join(flights, 1.0, **big)  # joining costs nothing
    _join(flights, 9.0, lane=Lane.BATCH, **big)  # batch is bounded by its window
    puppet.finish(0)
    _join(flights, 9.5, **big)


def test_a_single_frame_longer_than_the_bound_is_still_drawn(flights: Flights, puppet: Puppet) -> None:
    _join(flights, width=4096, height=4096, samples=16)

    assert len(puppet.submitted) == 1


def test_a_deadline_is_eight_estimates_and_ten_seconds_at_least(flights: Flights, puppet: Puppet) -> None:
    _join(flights)
    _join(flights, 1.0, lane=Lane.BATCH, width=4096, height=4096, samples=16)
    small, large = (task.limit for task, _ in puppet.submitted)

    assert small == 10.0
    assert large == pytest.approx(8 * CostModel().estimate(frame(width=4096, height=4096, samples=16)))
    assert large > 100


def test_the_cost_model_learns_what_a_kind_of_frame_takes() -> None:
    model = CostModel()
    request = frame(width=1000, height=1000, msaa=1)
    for _ in range(50):
        model.learn(request, 2.0)

    assert model.estimate(request) == pytest.approx(2.0, rel=0.01)
    assert model.estimate(frame(width=2000, height=1000, msaa=1)) == pytest.approx(4.0, rel=0.02)
    assert model.estimate(frame(width=1000, height=1000, msaa=1, samples=4)) == pytest.approx(8.0, rel=0.02)
