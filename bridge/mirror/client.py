"""A front's end of the link: an image that follows that of the bus process."""

from __future__ import annotations

import asyncio
import logging
import time
from collections import Counter
from collections.abc import Callable
from dataclasses import replace
from functools import partial
from typing import Final, TypeVar

from bridge.base.errors import OperationFailed
from bridge.base.guard import Guard
from bridge.base.quietlog import log_source
from bridge.command import Code, Event, Identity, Outcome, Rejection, Reply, Request
from bridge.image import Image, Quality
from bridge.mirror import protocol
from bridge.mirror.endpoint import LEASE_MS
from bridge.mirror.protocol import Answered, Changed, Connected, Counted, Delta, Malformed, Snapshot
from bridge.mirror.rejections import Rejections
from bridge.text import Text
from bridge.zenohlink import GetReply, Sample, ZenohLink, zenoh_config

_log = logging.getLogger(__name__)

SILENCE_S: Final = 1.0
"""After this long out of step the bus process counts as gone."""
_LOOK_EVERY_S: Final = 0.1
_MOST_BEHIND_S: Final = SILENCE_S + 2 * _LOOK_EVERY_S
"""Longest wait for the deltas that an outcome names: those that are missed are known to be by then."""
_SNAPSHOT_TIMEOUT_S: Final = 2.0
_RENEW_S: Final = 4.0
"""Out of step for this long, a front connects anew under another identity. When its peer was stopped for
about as long as a connection may be silent, zenoh can leave a session half open: it is told of everything
that the peer declares, and no query of it is ever answered."""
_MOST_PENDING: Final = 2000
"""Deltas kept while a snapshot is on its way."""
UNREACHABLE: Final = Text.of("link.unreachable")

_Told = TypeVar("_Told")


class PointsChanged(OperationFailed):
    """The bus process runs another site now: this front has to restart."""


class MirrorClient:
    """The plant as ``front`` sees it; satisfies ``bridge.northbound.view.View``.

    Times in the image and in events are seconds since 1970 UTC, as ``wall_clock`` tells; ``clock`` is the
    machine's monotonic clock, which is that of the bus process, too.
    """

    def __init__(
        self,
        endpoint: str,
        clock: Callable[[], float] = time.monotonic,
        front: str = "front",
        wall_clock: Callable[[], float] = time.time,
    ) -> None:
        self.gaps = 0
        """Deltas that were missed."""
        self.malformed = 0
        self._clock, self._wall_clock = clock, wall_clock
        self._endpoint = endpoint
        self._request_key = protocol.key_of(protocol.REQUESTS, front)
        self._connection_key = protocol.key_of(protocol.CONNECTIONS, front)
        self._is_hurried = False
        self._link = self._new_link()
        self._image: Image | None = None
        self._instance = 0
        self._sequence = 0
        self._in_step = False
        self._pending: list[Delta] = []
        self._waiting: dict[asyncio.Future[None], Answered] = {}
        """Outcomes that the image does not show yet."""
        self._last_in_step = float("-inf")
        self._connected_at = float("-inf")
        self._is_dead = False
        self._points_changed = False
        self._listeners: list[Callable[[Event], None]] = []
        self._asking = set[asyncio.Task[Outcome]]()
        self._telling = set[asyncio.Task[list[GetReply]]]()
        self._rejections = Rejections()
        self._counts = Counter[str]()
        self._guard = Guard("mirror")

    # what a northbound sees

    @property
    def image(self) -> Image:
        """Raises RuntimeError before ``open`` has returned."""
        if self._image is None:
            raise RuntimeError("there is no image before the first snapshot")
        return self._image

    def epoch_ns(self, time: float) -> int:
        """``Reading.time`` is already wall clock here; a double is good for a quarter of a µs."""
        return round(time * 1e9)

    def look(self, drive: str) -> None:
        """Do nothing: the latest readings received are all that is known here."""

    def hurry(self, *, is_wanted: bool) -> None:
        if is_wanted is self._is_hurried:
            return
        self._is_hurried = is_wanted
        if is_wanted:
            self._follow_promptly(self._link)
        else:
            self._link.drop_subscriber(protocol.PROMPT)

    def _follow_promptly(self, link: ZenohLink) -> None:
        link.declare_subscriber(protocol.PROMPT, self._on_told)

    def on_event(self, listener: Callable[[Event], None]) -> None:
        self._listeners.append(listener)

    def forget(self, listener: Callable[[Event], None]) -> None:
        if listener in self._listeners:
            self._listeners.remove(listener)

    def submit(self, request: Request, reply: Reply) -> None:
        asking = asyncio.get_running_loop().create_task(self.request(request))
        self._asking.add(asking)
        asking.add_done_callback(partial(self._on_answer, reply))

    def _on_answer(self, reply: Reply, asking: asyncio.Task[Outcome]) -> None:
        self._asking.discard(asking)
        with self._guard:
            reply(Outcome(Code.CANCELLED, Text.of("link.closed")) if asking.cancelled() else asking.result())

    async def request(self, request: Request, timeout_s: float = 5.0) -> Outcome:
        """Send ``request`` to the bus process; any number may be under way at once.

        A request without a time has arrived now; its wait from here on counts. When the outcome is returned,
        the image shows what the request has changed, or its points are dead.
        """
        if request.received_at is None:
            request = replace(request, received_at=self._clock())
        try:
            payload = protocol.encode_request(request, self._clock() + timeout_s)
        except Malformed as error:
            said = Text.of("link.not_passed_on", error=str(error))
            return Outcome(Code.NOT_VALID, said, forwarded=False)
        answers = await self._link.get(self._request_key, payload, timeout_s=timeout_s)
        for answer in answers:
            if answer.ok and (answered := self._read(partial(protocol.decode, Answered), answer.message)):
                await self._follow_to(answered)
                return answered.outcome
        # The deltas may still come where nothing is answered: a snapshot will tell.
        self._in_step = False
        return Outcome(Code.TIMED_OUT, Text.of("link.no_answer"), forwarded=False)

    async def _follow_to(self, answered: Answered) -> None:
        """Wait until the image shows what ``answered`` is about. Where that takes too long, no value may
        look current."""
        if self._shows(answered):
            return
        shown: asyncio.Future[None] = asyncio.get_running_loop().create_future()
        self._waiting[shown] = answered
        try:
            await asyncio.wait((shown,), timeout=_MOST_BEHIND_S)
        finally:
            del self._waiting[shown]
        if not shown.done():
            self._mark_dead()

    def _shows(self, answered: Answered) -> bool:
        is_applied = answered.instance == self._instance and answered.sequence <= self._sequence
        return is_applied or self._is_dead

    def _tell_waiting(self) -> None:
        for shown, answered in self._waiting.items():
            if self._shows(answered) and not shown.done():
                shown.set_result(None)

    def rejected(self, rejection: Rejection) -> None:
        """Told to the bus process within 0.1 s. While that is away nobody keeps a log, and it is lost."""
        self._rejections.add(rejection, self._clock())

    def count(self, leaf: str, by: int = 1) -> None:
        """Told to the bus process within 0.1 s."""
        self._counts[leaf] += by

    def on_connection(self, identity: Identity, *, is_there: bool, has_others: bool = False) -> None:
        """Told to the bus process before whatever is submitted afterwards. While that is away nobody is told:
        the owner's time decides."""
        told = protocol.encode(Connected(identity, is_there, has_others))
        telling = asyncio.get_running_loop().create_task(self._link.get(self._connection_key, told))
        self._telling.add(telling)
        telling.add_done_callback(self._telling.discard)

    def _tell_rejections(self) -> None:
        for rejected in self._rejections.take():
            with self._guard:
                self._link.send(Sample(protocol.REJECTED, protocol.encode(rejected)))
        counts, self._counts = self._counts, Counter[str]()
        for leaf, by in counts.items():
            self._link.send(Sample(protocol.COUNTED, protocol.encode(Counted(leaf, by))))

    # life

    async def open(self) -> None:
        """Connect and wait for the first snapshot, however long the bus process takes."""
        try:
            await self._connect()
        except BaseException:
            await self._link.close()
            raise

    def _new_link(self) -> ZenohLink:
        return ZenohLink(zenoh_config(connect=[self._endpoint], lease_ms=LEASE_MS), "mirror")

    async def _connect(self) -> None:
        await self._open(self._link)
        while not self._in_step:
            await self._catch_up()
            if not self._in_step:
                await asyncio.sleep(_LOOK_EVERY_S)

    async def _open(self, link: ZenohLink) -> None:
        await link.open()
        self._connected_at = self._clock()
        link.declare_subscriber(protocol.DELTA, self._on_told)
        link.declare_subscriber(protocol.EVENT, self._on_event)
        if self._is_hurried:
            self._follow_promptly(link)
        link.follow_liveliness(protocol.TOKEN, self._on_token)

    async def _catch_up(self) -> None:
        """Get in step again; where that fails for long, over another connection."""
        await self._take_snapshot()
        if not self._in_step and self._clock() - max(self._last_in_step, self._connected_at) > _RENEW_S:
            await self._renew_link()

    async def _renew_link(self) -> None:
        _log.warning(
            "mirror: %s for %g s, connecting anew", UNREACHABLE, _RENEW_S, extra=log_source("mirror")
        )
        fresh = self._new_link()
        await self._open(fresh)
        before, self._link = self._link, fresh
        await before.close()

    async def run(self) -> None:
        """Keep the image in step, or every point dead, until cancelled.

        Raises PointsChanged where the bus process came back with other points.
        """
        async with asyncio.TaskGroup() as tasks:
            watching = tasks.create_task(self._watch_silence())
            while not self._points_changed:
                with self._guard:
                    if not self._in_step:
                        await self._catch_up()
                await asyncio.sleep(_LOOK_EVERY_S)
            watching.cancel()
        raise PointsChanged("the bus process runs another site now; this process has to start anew")

    async def _watch_silence(self) -> None:
        while True:
            with self._guard:
                if self._clock() - self._last_in_step > SILENCE_S:
                    self._mark_dead()
                self._tell_rejections()
            await asyncio.sleep(_LOOK_EVERY_S)

    async def close(self) -> None:
        for task in (*self._asking, *self._telling):
            task.cancel()
        await self._link.close()

    async def failed(self) -> None:
        """Wait until closed, or raise ``OperationFailed`` when the link has ended by itself."""
        link = None
        while link is not self._link:
            link = self._link
            await link.failed()

    # in step with the publisher

    async def _take_snapshot(self) -> None:
        for answer in await self._link.get(protocol.SNAPSHOT, timeout_s=_SNAPSHOT_TIMEOUT_S):
            if answer.ok and (snapshot := self._read(protocol.decode_snapshot, answer.message)):
                self._apply_snapshot(snapshot)

    def _apply_snapshot(self, snapshot: Snapshot) -> None:
        if self._image is None:
            self._image = Image(snapshot.points)
        elif self._image.points != snapshot.points:
            self._points_changed = True
            return
        self._last_in_step = self._clock()
        self._is_dead = False
        self._instance, self._sequence = snapshot.instance, snapshot.sequence
        self._apply(snapshot.readings)
        self._in_step = True
        pending, self._pending = self._pending, []
        for delta in pending:
            if delta.instance == self._instance:
                self._follow(delta)
        self._tell_waiting()

    def _on_told(self, message: Sample) -> None:
        if message.key == protocol.PROMPT:
            self._on_prompt(message)
        else:
            self._on_delta(message)

    def _on_delta(self, message: Sample) -> None:
        count = 0 if self._image is None else len(self._image.points)
        if not count:
            return
        delta = self._read(partial(protocol.decode_delta, count=count), message)
        if delta is None:
            # Also how another site's deltas look; the snapshot will tell.
            self._in_step = False
        elif self._in_step:
            self._follow(delta)
        elif len(self._pending) < _MOST_PENDING:
            self._pending.append(delta)

    def _on_prompt(self, message: Sample) -> None:
        if not self._in_step:
            return
        prompt = self._read(partial(protocol.decode_prompt, count=len(self.image.points)), message)
        if prompt and prompt.instance == self._instance:
            self._apply(prompt.readings)

    def _follow(self, delta: Delta) -> None:
        """Apply ``delta`` if it is the next one; after a gap a new snapshot is due."""
        if delta.instance == self._instance and delta.sequence <= self._sequence:
            return  # the snapshot already had it
        if delta.instance != self._instance or delta.sequence != self._sequence + 1:
            self.gaps += 1
            self._in_step = False
            return
        self._last_in_step = self._clock()
        self._sequence = delta.sequence
        self._apply(delta.readings)
        self._tell_waiting()

    def _apply(self, readings: tuple[Changed, ...]) -> None:
        image = self.image
        for changed in readings:
            value = changed.value
            if isinstance(value, Text):
                image.say(changed.index, value, changed.time, changed.quality, changed.why)
            else:
                image.set(changed.index, value, changed.time, changed.quality, changed.why)
                image.date(changed.index, changed.time)

    def _mark_dead(self) -> None:
        """The bus process is gone: no value may look current."""
        if self._is_dead:
            return
        self._is_dead = True
        self._in_step = False
        self._pending.clear()
        _log.warning("mirror: %s", UNREACHABLE)
        everything = range(len(self.image.points))
        self.image.judge(everything, Quality.DEAD, self._wall_clock(), UNREACHABLE)
        self._tell_waiting()

    def _on_token(self, _: str, is_alive: bool) -> None:
        if not is_alive and self._image is not None:
            self._mark_dead()

    def _on_event(self, message: Sample) -> None:
        event = self._read(partial(protocol.decode, Event), message)
        if event is None:
            return
        for listener in tuple(self._listeners):
            with self._guard:
                listener(event)

    def _read(self, decode: Callable[[bytes], _Told], message: Sample) -> _Told | None:
        try:
            return decode(message.payload)
        except Malformed as error:
            self.malformed += 1
            _log.warning("mirror: a message that is none of ours: %s", error, extra=log_source("mirror"))
            return None
