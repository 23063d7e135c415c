"""The client for asyncio: the same calls, awaited."""

from __future__ import annotations

import os
from collections.abc import Mapping, Sequence
from pathlib import Path
from types import TracebackType
from typing import Any, Literal, Self, TypeVar, Unpack, overload

import httpx

from . import operations
from .connection import DAY, DEFAULT_RETRIES, DEFAULT_TIMEOUT, DEFAULT_URL, Connection, JobView, checked_seconds
from .errors import MillpondError
from .exchange import Policy, Script
from .picture import Frame, Movie, Picture
from .progress import JobProgress
from .shapes import FrameFacts, FrameRequest, ImageFacts, ImageKind, JobFacts, JobRequest, Product, Turntable
from .transport import run_async
from .uploads import ImageSource

T = TypeVar("T")
Target = str | os.PathLike[str]


class AsyncMillpond:
    """A Millpond service, for asyncio programs. See ``Millpond``: every method is its twin.

    Belongs to one event loop. Close it, or use it in an ``async with`` block.
    """

    def __init__(
        self,
        base_url: str = DEFAULT_URL,
        api_key: str | None = None,
        timeout: float = DEFAULT_TIMEOUT,
        retries: int = DEFAULT_RETRIES,
    ) -> None:
        self._connection = Connection.to(base_url, api_key, timeout, retries)
        self._http = httpx.AsyncClient(**self._connection.arguments())

    @property
    def policy(self) -> Policy:
        """How long and how often it tries."""
        return self._connection.policy

    async def run(self, script: Script[T]) -> T:
        """Carry out a script of ``millpond.operations``."""
        return await run_async(script, self._http)

    async def frame(
        self, request: FrameRequest | Mapping[str, Any] | None = None, /, **fields: Unpack[FrameRequest]
    ) -> Frame:
        """A frame. ``fields`` are laid over ``request``: ``client.frame(water="luna", time=2, width=640)``."""
        return Frame.of(await self.run(operations.frame(self.policy, request, fields)))

    @overload
    async def turntable(
        self,
        frame: FrameRequest | Mapping[str, Any] | None = None,
        *,
        format: Product = "mp4",
        path: None = None,
        **settings: Unpack[Turntable],
    ) -> Movie: ...

    @overload
    async def turntable(
        self,
        frame: FrameRequest | Mapping[str, Any] | None = None,
        *,
        format: Product = "mp4",
        path: Target,
        **settings: Unpack[Turntable],
    ) -> Path: ...

    async def turntable(
        self,
        frame: FrameRequest | Mapping[str, Any] | None = None,
        *,
        format: Product = "mp4",  # noqa: A002 -- the word of the API
        path: Target | None = None,
        **settings: Unpack[Turntable],
    ) -> Movie | Path:
        """A short turntable in one answer, as ``mp4`` or ``zip``; streamed to ``path`` where one is given.

        ``settings`` are those of ``Turntable``: ``frames``, ``fps``, ``sweep``, ``pivot``, ``loop``,
        ``maps_every``. A longer one is a job: ``turntable_job``.
        """
        to = None if path is None else Path(path)
        reply = await self.run(operations.turntable(self.policy, frame, settings, format, to))
        return Movie.of(reply) if to is None else to

    async def turntable_job(
        self,
        frame: FrameRequest | Mapping[str, Any] | None = None,
        *,
        outputs: Sequence[Product] = (),
        priority: int | None = None,
        order: Literal["sequential", "coarse_to_fine"] | None = None,
        idempotency_key: str | None = None,
        **settings: Unpack[Turntable],
    ) -> AsyncJob:
        """Submit a turntable as a job; it is durable before this returns. ``settings`` as for ``turntable``."""
        body = operations.turntable_body(frame, settings, outputs, {"priority": priority, "order": order})
        return await self.submit(body, idempotency_key=idempotency_key)

    async def submit(self, job: JobRequest | Mapping[str, Any], *, idempotency_key: str | None = None) -> AsyncJob:
        """Submit a job. The same ``idempotency_key`` again gives the same job; without one, each call is a new job."""
        return AsyncJob(self, await self.run(operations.submit(self.policy, job, idempotency_key)))

    async def job(self, job_id: str) -> AsyncJob:
        """A job that was submitted before. Raises NotFound, and Gone for one that has expired."""
        return AsyncJob(self, await self.run(operations.job(self.policy, job_id)))

    async def upload_image(self, source: ImageSource, kind: ImageKind) -> ImageFacts:
        """Keep an image at the service; its ``id`` is what water names: ``water={"bias_map": image["id"]}``.

        ``source`` is a path, a file's bytes, a PIL image, or an array: uint8 or uint16, (h, w) or (h, w, 1 to 4). What
        is no file yet goes as PNG, uint16 with its 16 bits. The same image of the same kind has the same id.
        """
        return await self.run(operations.upload_image(self.policy, source, kind))

    async def info(self) -> dict[str, Any]:
        """Versions, driver, whether it draws in software, workers and caps."""
        return await self.run(operations.info(self.policy))

    async def ready(self) -> bool:
        """Whether the service can draw now; a service that cannot be reached is not ready."""
        return await self.run(operations.ready(self.policy))

    async def wait_ready(self, timeout: float = 60.0) -> None:  # noqa: ASYNC109 -- as its twin
        """Return once the service can draw. Raises TimedOut that says why it cannot."""
        await self.run(operations.wait_ready(self.policy, checked_seconds(timeout)))

    async def close(self) -> None:
        """Close the connections."""
        await self._http.aclose()

    async def __aenter__(self) -> Self:
        return self

    async def __aexit__(
        self, kind: type[BaseException] | None, error: BaseException | None, trace: TracebackType | None
    ) -> None:
        await self.close()


class AsyncJob(JobView):
    """A job of a service. In an ``async with`` block it is cancelled where an exception leaves the block."""

    def __init__(self, client: AsyncMillpond, facts: JobFacts) -> None:
        super().__init__(facts)
        self._client = client

    async def refresh(self) -> Self:
        """Ask how it stands."""
        self.facts = await self._client.run(operations.job(self._client.policy, self.id))
        return self

    async def wait(self, progress: bool = True, timeout: float = DAY) -> Self:  # noqa: FBT001, FBT002, ASYNC109 -- as its twin
        """Return once it has succeeded, showing a progress bar on a terminal.

        Raises JobFailed where it ends otherwise, and TimedOut after ``timeout`` seconds.
        """
        with JobProgress(is_wanted=progress) as bar:

            def show(facts: JobFacts) -> None:
                self.facts = facts
                bar(facts)

            script = operations.wait(self._client.policy, self.id, checked_seconds(timeout), show)
            self.facts = await self._client.run(script)
        return self

    async def frames(self) -> list[FrameFacts]:
        """What is known of each frame: index, state, key, digest, URL."""
        return await self._client.run(operations.frames(self._client.policy, self.id))

    async def frame(self, index: int, suffix: str = "png") -> Frame:
        """One frame, once it is drawn; ``suffix`` is that of the format that the job asked for."""
        name = operations.frame_name(index, suffix)
        return Frame.of(await self._client.run(operations.job_file(self._client.policy, self.id, name)))

    @overload
    async def result(self, product: Product = "mp4", path: None = None) -> bytes: ...

    @overload
    async def result(self, product: Product, path: Target) -> Path: ...

    async def result(self, product: Product = "mp4", path: Target | None = None) -> bytes | Path:
        """The product of all frames, streamed to ``path`` where one is given. Raises Conflict before the last frame."""
        to = None if path is None else Path(path)
        reply = await self._client.run(operations.job_file(self._client.policy, self.id, f"result.{product}", to))
        return reply.body if to is None else to

    @overload
    async def contact_sheet(self, path: None = None) -> Picture: ...

    @overload
    async def contact_sheet(self, path: Target) -> Path: ...

    async def contact_sheet(self, path: Target | None = None) -> Picture | Path:
        """The job at a glance, written to ``path`` where one is given."""
        to = None if path is None else Path(path)
        reply = await self._client.run(operations.job_file(self._client.policy, self.id, "contact-sheet.png", to))
        return Picture(reply.body) if to is None else to

    async def cancel(self) -> Self:
        """End it; what is drawn stays. Cancelling it again changes nothing."""
        self.facts = await self._client.run(operations.cancel(self._client.policy, self.id))
        return self

    async def __aenter__(self) -> Self:
        return self

    async def __aexit__(
        self, kind: type[BaseException] | None, error: BaseException | None, trace: TracebackType | None
    ) -> None:
        if kind is not None and not self.is_over:
            try:
                await self.cancel()
            except MillpondError as failure:
                if error is not None:
                    error.add_note(f"job {self.id} could not be cancelled: {failure}")
