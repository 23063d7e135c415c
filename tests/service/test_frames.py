from __future__ import annotations

import asyncio
import hashlib
from collections.abc import AsyncIterator, Callable, Iterator
from contextlib import suppress
from pathlib import Path

import pytest

from renderer.errors import EncodeError
from service.artifacts import artifact_name
from service.engines.base import Lane
from service.errors import ArtifactMissing, EngineUnavailable, FramePoisoned
from service.flights import Ticket
from service.frames import FrameCache, StoredFrame
from service.worker import FrameReport
from tests.service.core import cache_on, eventually, frame, make_inline, make_local
from tests.service.puppet import Puppet
from tests.service.scripted import DRIVER, FINGERPRINT, Seed, begun, open_gate, picture

pytestmark = pytest.mark.anyio


@pytest.fixture
def anyio_backend() -> str:
    return "asyncio"


@pytest.fixture
def cache(tmp_path: Path) -> Iterator[FrameCache]:
    with cache_on(make_inline(tmp_path), tmp_path) as ready:
        yield ready


async def _until(holds: Callable[[], object], seconds: float = 20.0) -> None:
    await asyncio.to_thread(eventually, holds, seconds)


async def test_a_frame_is_drawn_once_and_then_read(cache: FrameCache, tmp_path: Path) -> None:
    drawn = await cache.frame(frame(1.0))
    read = await cache.frame(frame(1.0))

    assert (drawn.hit, read.hit) == (False, True)
    assert drawn.data == read.data == picture(64, 36, 1.0)
    assert drawn.digest == hashlib.sha256(drawn.data).hexdigest()
    assert (drawn.key, drawn.fingerprint, drawn.driver) == (frame(1.0).key(), FINGERPRINT, DRIVER)
    assert drawn.media_type == "image/png"
    assert set(drawn.timings) == {"queue", "render", "encode"}
    assert read.timings == {}
    assert begun(tmp_path) == [frame(1.0).key()]
    assert cache.hits == 1


async def test_the_entity_tag_is_known_before_anything_is_drawn(cache: FrameCache, tmp_path: Path) -> None:
    tag = cache.etag(frame())

    assert tag == f'"{artifact_name(frame().key(), FINGERPRINT)}"'
    assert not cache.find(frame())
    assert begun(tmp_path) == []
    await cache.frame(frame())
    assert cache.find(frame())


async def test_many_askers_of_one_frame_are_one_render(cache: FrameCache, tmp_path: Path) -> None:
    asked = [asyncio.create_task(cache.frame(frame(seed=Seed.WAIT))) for _ in range(10)]
    await _until(lambda: begun(tmp_path))
    open_gate(tmp_path)
    frames = await asyncio.gather(*asked)

    assert len({stored.digest for stored in frames}) == 1
    assert len(begun(tmp_path)) == 1


async def test_a_client_that_leaves_takes_its_frame_out_of_the_queue(cache: FrameCache, tmp_path: Path) -> None:
    blocker = asyncio.create_task(cache.frame(frame(seed=Seed.WAIT)))
    await _until(lambda: begun(tmp_path))
    leaver = asyncio.create_task(cache.frame(frame(1.0)))
    await asyncio.sleep(0.1)
    leaver.cancel()
    with suppress(asyncio.CancelledError):
        await leaver
    open_gate(tmp_path)
    await blocker
    await cache.frame(frame(2.0))

    assert frame(1.0).key() not in begun(tmp_path)


async def test_a_running_frame_stops_when_its_last_client_leaves(cache: FrameCache, tmp_path: Path) -> None:
    leavers = [asyncio.create_task(cache.frame(frame(seed=Seed.WAIT))) for _ in range(2)]
    await _until(lambda: begun(tmp_path))
    for leaver in leavers:
        leaver.cancel()
    await asyncio.gather(*leavers, return_exceptions=True)

    assert (await asyncio.wait_for(cache.frame(frame(1.0)), 10)).data
    assert not cache.find(frame(seed=Seed.WAIT))


async def test_errors_of_the_renderer_arrive_and_are_not_kept(cache: FrameCache, tmp_path: Path) -> None:
    for _ in range(2):
        with pytest.raises(EncodeError):
            await cache.frame(frame(seed=Seed.RAISE))

    assert len(begun(tmp_path)) == 2


async def test_a_damaged_frame_is_drawn_again(cache: FrameCache, tmp_path: Path) -> None:
    cold = FrameCache(cache.engine, cache.artifacts, memory=0)
    first = await cold.frame(frame())
    artifact = cold.artifacts.find(artifact_name(frame().key(), FINGERPRINT))
    assert artifact is not None
    artifact.path.write_bytes(first.data[:-1])
    second = await cold.frame(frame())

    assert not second.hit
    assert second.data == first.data
    assert len(begun(tmp_path)) == 2


async def test_a_frame_at_hand_needs_no_disk(cache: FrameCache) -> None:
    first = await cache.frame(frame())
    cache.artifacts.remove(artifact_name(frame().key(), FINGERPRINT))

    assert (await cache.frame(frame())).data == first.data


async def test_what_is_at_hand_is_bounded(tmp_path: Path) -> None:
    size = len(picture(64, 36, 0.0))
    with cache_on(make_inline(tmp_path), tmp_path, memory=2 * size + size // 2) as cache:
        for moment in (0.0, 1.0, 2.0):
            await cache.frame(frame(moment))
        for moment in (0.0, 1.0, 2.0):
            cache.artifacts.remove(artifact_name(frame(moment).key(), FINGERPRINT))
        kept = [(await cache.frame(frame(moment))).hit for moment in (2.0, 1.0, 0.0)]

    assert kept == [True, True, False]


async def test_a_frame_that_vanishes_twice_is_an_error_and_no_endless_loop(
    cache: FrameCache, monkeypatch: pytest.MonkeyPatch
) -> None:
    def vanish(*_: object) -> None:
        raise ArtifactMissing("gone")

    monkeypatch.setattr(cache.artifacts, "read_fresh", vanish)
    monkeypatch.setattr(cache.artifacts, "read", vanish)
    with pytest.raises(ArtifactMissing):
        await asyncio.wait_for(cache.frame(frame()), 20)


async def test_a_sequence_comes_in_order_and_is_drawn_ahead(cache: FrameCache, tmp_path: Path) -> None:
    wanted = [frame(float(i)) for i in range(8)]
    seen: list[StoredFrame] = []
    async for stored in cache.sequence(wanted):
        seen.append(stored)
        assert len(begun(tmp_path)) <= len(seen) + cache.engine.capacity + 1

    assert [stored.key for stored in seen] == [request.key() for request in wanted]


async def test_a_sequence_that_is_closed_draws_no_more(cache: FrameCache, tmp_path: Path) -> None:
    frames = cache.sequence([frame(float(i)) for i in range(20)])
    await anext(frames)
    await frames.aclose()
    await asyncio.sleep(0.3)

    assert len(begun(tmp_path)) < 5
    assert cache.flights.waiting_seconds == 0


async def test_a_sequence_ends_with_the_error_of_its_frame(cache: FrameCache) -> None:
    async def drain(frames: AsyncIterator[StoredFrame]) -> int:
        return len([stored async for stored in frames])

    with pytest.raises(EncodeError):
        await drain(cache.sequence([frame(), frame(seed=Seed.RAISE), frame(2.0)]))


async def test_frames_wait_for_the_first_worker(tmp_path: Path) -> None:
    engine = make_inline(tmp_path)
    cache = FrameCache(engine, Puppet(tmp_path).artifacts, ready_seconds=0.2)
    with pytest.raises(EngineUnavailable):
        await cache.frame(frame())
    engine.start()
    try:
        assert (await cache.frame(frame())).data
    finally:
        engine.close()


async def test_a_frame_that_kills_is_retried_alone_and_then_set_aside(tmp_path: Path) -> None:
    with cache_on(make_local(tmp_path, workers=2, interactive=False), tmp_path) as cache:
        neighbours = [asyncio.create_task(cache.frame(frame(float(i), Seed.DRAW_SLOWLY))) for i in range(8)]
        once = asyncio.create_task(cache.frame(frame(seed=Seed.DIE_ONCE)))
        with pytest.raises(FramePoisoned, match="SIGKILL"):
            await cache.frame(frame(seed=Seed.DIE))

        assert (await once).data == picture(64, 36, 0.0)
        assert all(stored.data for stored in await asyncio.gather(*neighbours))
        assert begun(tmp_path).count(frame(seed=Seed.DIE).key()) == 2
        with pytest.raises(FramePoisoned):
            await cache.frame(frame(seed=Seed.DIE))
        assert begun(tmp_path).count(frame(seed=Seed.DIE).key()) == 2


def test_the_dispatcher_is_given_reports_of_stored_frames_and_tickets_for_others(tmp_path: Path) -> None:
    puppet = Puppet(tmp_path)
    cache = FrameCache(puppet, puppet.artifacts)
    ticket = cache.draw(frame(), Lane.BATCH)
    assert isinstance(ticket, Ticket)
    puppet.finish()
    ticket.future.result(1)
    report = cache.draw(frame(), Lane.BATCH)

    assert isinstance(report, FrameReport)
    assert report.timings == {}
    assert len(puppet.submitted) == 1
