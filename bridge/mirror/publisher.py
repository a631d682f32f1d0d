"""The bus process's end of the link to its fronts."""

from __future__ import annotations

import asyncio
import random
from collections import defaultdict
from collections.abc import Callable, Sequence
from dataclasses import replace
from functools import partial
from typing import Final, TypeVar

from bridge.base.errors import Unavailable
from bridge.base.publishing_clock import PUBLISH_EVERY_S, next_send
from bridge.command import Code, Event, Outcome, PlantView
from bridge.command.messages.freshness import NEVER, TAKEN_LATE
from bridge.image import Feed, Point
from bridge.mirror import protocol
from bridge.mirror.endpoint import LEASE_MS, close_to_others, prepare_folder
from bridge.mirror.protocol import Answered, Changed, Connected, Delta, Malformed, Prompt, Rejected, Snapshot
from bridge.text import Text
from bridge.zenohlink import IncomingQuery, Pace, Sample, ZenohLink, zenoh_config

_POINTS_PER_DELTA: Final = 500
_HEARTBEAT_S: Final = 0.25
"""Longest time without a delta."""

_Told = TypeVar("_Told")


class MirrorPublisher:
    """Shows the plant to the fronts and takes their requests.

    ``clock`` is the machine's monotonic clock in seconds. It is that of the fronts, too, as the link is a
    Unix socket. So a request's time and deadline are taken as they are, and what it has waited on the link
    counts: an age would leave that out, and a delayed enabling word would look fresh. A front on another
    machine would need its times translated.

    A front that asks for it is told of changes as soon as they are made, at most every ``prompt_s``.
    """

    def __init__(
        self, view: PlantView, endpoint: str, clock: Callable[[], float], prompt_s: float = PUBLISH_EVERY_S
    ) -> None:
        self.malformed = 0
        """Messages of fronts that could not be read."""
        self._view = view
        self._image = view.image
        self._endpoint = endpoint
        self._clock = clock
        self._link = self._new_link()
        self._pace = Pace(self._tick, PUBLISH_EVERY_S, _HEARTBEAT_S, beat=next_send)
        self._feed = self._image.feed(self._pace.wake)
        self._has_fronts = False
        self._prompt_pace = Pace(self._tell_promptly, prompt_s)
        self._prompt_feed: Feed | None = None
        """While somebody asks for it."""
        self._instance = random.getrandbits(63)
        self._sequence = 0
        self._snapshots: set[asyncio.Task[None]] = set()
        self._of = _by_owner(self._image.points)
        self._was_started = False

    def _new_link(self) -> ZenohLink:
        return ZenohLink(zenoh_config(listen=[self._endpoint], lease_ms=LEASE_MS), "mirror")

    async def start(self) -> None:
        """Open the socket, also again after ``failed``. Raises Unavailable where that cannot be."""
        if self._was_started:
            await self.close()
            self._link = self._new_link()
            self._feed = self._image.feed(self._pace.wake)
            self._has_fronts = False
        self._was_started = True
        prepare_folder(self._endpoint)
        try:
            await self._link.open()
        except Unavailable as error:
            raise Unavailable(f"{error} (is this site already being run?)") from None
        close_to_others(self._endpoint)
        # A front that has a snapshot may send requests.
        # What one front says keeps its order, and waits for nothing that another says.
        self._link.declare_queryable(protocol.REQUESTS, self._on_request, _by_front)
        self._link.declare_queryable(protocol.CONNECTIONS, self._on_connection, _by_front)
        self._link.declare_queryable(protocol.SNAPSHOT, self._on_snapshot)
        self._link.declare_subscriber(protocol.REJECTED, self._on_rejected)
        self._link.declare_subscriber(protocol.COUNTED, self._on_counted)
        self._link.declare_token(protocol.TOKEN)
        self._link.follow_readers(protocol.DELTA, self._on_fronts)
        self._link.follow_readers(protocol.PROMPT, self._on_hurried)
        self._view.on_event(self._on_event)
        self._pace.wake()
        self._pace.start()

    async def close(self) -> None:
        self._pace.stop()
        self._on_hurried(False)
        self._has_fronts = False
        for task in tuple(self._snapshots):
            task.cancel()
        self._view.forget(self._on_event)
        self._image.drop_feed(self._feed)
        await self._link.close()

    async def failed(self) -> None:
        """Wait until closed, or raise ``OperationFailed`` when the link has ended by itself."""
        await self._link.failed()

    # out

    def _on_fronts(self, are_there: bool) -> None:
        self._has_fronts = are_there
        if are_there:
            self._pace.wake()

    def _on_hurried(self, are_there: bool) -> None:
        feed, self._prompt_feed = self._prompt_feed, None
        self._prompt_pace.stop()
        if feed:
            self._image.drop_feed(feed)
        if are_there:
            self._prompt_feed = self._image.feed(self._prompt_pace.wake)
            self._prompt_pace.wake()
            self._prompt_pace.start()

    def _tell_promptly(self) -> None:
        """Send the prompt points at once. Where a message is lost, the next delta has the same changes."""
        feed = self._prompt_feed
        if feed is None:
            return
        at_zero_ns = self._view.epoch_ns(0.0)
        readings = tuple(self._changed(index, at_zero_ns) for index in feed.take(_POINTS_PER_DELTA))
        self._send(protocol.PROMPT, Prompt(self._instance, readings))
        if feed:
            self._prompt_pace.wake()

    def _tick(self) -> None:
        """Publish all changes; they wait while no front listens."""
        self._publish(len(self._feed))

    def _publish(self, left: int, then: Callable[[], None] | None = None) -> None:
        """A delta, or several, and ``then``: the bus has its turn between two of them."""
        if self._has_fronts or then:
            self._publish_delta(self._feed.take(_POINTS_PER_DELTA))
            left -= _POINTS_PER_DELTA
            if left > 0:
                asyncio.get_running_loop().call_soon(self._publish, left, then)
                return
            if self._feed:
                self._pace.wake()
        if then:
            then()

    def _show(self, target: str, then: Callable[[], None]) -> None:
        """Publish at once what has changed of a request's target, and do ``then``: after the answer
        nobody may read it as it was before. Of a whole bus that is everything; of a drive or a node only its
        own points, however much else waits for its turn.
        """
        if target.startswith("bus/"):
            self._publish(len(self._feed), then)
            return
        node, _, drive = target.partition("/")
        own = self._of.get(target, [])
        if drive:
            own = [*own, *self._of.get(f"{node}/node", [])]
        if f"{target}/supervision/telegrams" in self._image.index:
            self._view.look(target)
            self._image.tell_kept_of(own)
        waiting = self._feed.take_of(own)
        for first in range(0, len(waiting), _POINTS_PER_DELTA):
            self._publish_delta(waiting[first : first + _POINTS_PER_DELTA])
        then()

    def _publish_delta(self, indices: Sequence[int]) -> None:
        self._sequence += 1
        at_zero_ns = self._view.epoch_ns(0.0)
        readings = tuple(self._changed(index, at_zero_ns) for index in indices)
        # Where a front or the worker cannot follow, a delta is lost; the gap makes the front ask for
        # a new snapshot.
        self._send(protocol.DELTA, Delta(self._instance, self._sequence, readings))

    def _changed(self, index: int, at_zero_ns: int) -> Changed:
        """``at_zero_ns``: the wall clock at monotonic 0, which is read once for many points."""
        value, quality, time, why = self._image[index]
        told = self._image.said(index) or value
        return Changed(index, told, quality, (at_zero_ns + round(time * 1e9)) / 1e9, why)

    def _on_event(self, event: Event) -> None:
        self._send(protocol.EVENT, replace(event, time=self._view.epoch_ns(event.time) / 1e9))

    def _send(self, key: str, message: Delta | Prompt | Event) -> None:
        self._link.send(Sample(key, protocol.encode(message)))

    # in

    def _on_snapshot(self, asked: IncomingQuery) -> None:
        task = asyncio.get_running_loop().create_task(self._answer_snapshot(asked))
        self._snapshots.add(task)
        task.add_done_callback(self._snapshots.discard)

    async def _answer_snapshot(self, asked: IncomingQuery) -> None:
        """Everything, read a portion at a time: a large image must not hold up the bus.

        A reading that is newer than ``sequence`` does no harm: the deltas that follow lead to it again.
        """
        sequence = self._sequence
        points = self._image.points
        readings: list[Changed] = []
        at_zero_ns = self._view.epoch_ns(0.0)
        for index in range(len(points)):
            readings.append(self._changed(index, at_zero_ns))
            if index % _POINTS_PER_DELTA == 0:
                await asyncio.sleep(0)
        snapshot = Snapshot(self._instance, sequence, points, tuple(readings))
        asked.send([Sample(protocol.SNAPSHOT, protocol.encode(snapshot))])
        asked.finish()

    def _on_rejected(self, message: Sample) -> None:
        told = self._read(partial(protocol.decode, Rejected), message)
        if told:
            self._view.rejected(told.rejection, told.time_s, told.count)

    def _on_counted(self, message: Sample) -> None:
        told = self._read(protocol.decode_counted, message)
        if told:
            self._view.count(told.leaf, told.by)

    def _on_connection(self, asked: IncomingQuery) -> None:
        """A query and no message: those are lost where a front is in a hurry, and the requests that follow
        overtake them."""
        try:
            told = protocol.decode(Connected, asked.payload or b"")
        except Malformed as error:
            self.malformed += 1
            asked.fail(str(error).encode(), "text/plain")
            return
        self._view.on_connection(told.identity, is_there=told.is_there, has_others=told.has_others)
        asked.finish()

    def _read(self, decode: Callable[[bytes], _Told], message: Sample) -> _Told | None:
        try:
            return decode(message.payload)
        except Malformed:
            self.malformed += 1
            return None

    def _on_request(self, asked: IncomingQuery) -> None:
        def reply(outcome: Outcome) -> None:
            if outcome.value is not None:
                outcome = replace(outcome, time=self._view.epoch_ns(outcome.time) / 1e9)
            self._show(request.target, partial(self._answer, asked, outcome))

        try:
            request, deadline_s = protocol.decode_request(asked.payload or b"")
        except Malformed as error:
            self.malformed += 1
            asked.fail(str(error).encode(), "text/plain")
            return
        now = self._clock()
        # While this process hung, the request waited and its client was told that it failed. Nothing
        # may start moving after that; stopping is right at any time, also by a word that does not enable.
        is_late = now > deadline_s
        if is_late and request.action not in TAKEN_LATE:
            reply(Outcome(Code.TIMED_OUT, Text.of("link.too_late"), forwarded=False))
            return
        if is_late or request.received_at is None or request.received_at > now:
            # Too late, no time, or one that is still to come: nobody knows how old it is.
            request = replace(request, received_at=NEVER)
        self._view.submit(request, reply)

    def _answer(self, asked: IncomingQuery, outcome: Outcome) -> None:
        answered = Answered(outcome, self._instance, self._sequence)
        asked.send([Sample(asked.key, protocol.encode(answered))])
        asked.finish()


def _by_owner(points: Sequence[Point]) -> dict[str, list[int]]:
    """Indices of the points below ``<node>`` and ``<node>/<drive>``."""
    found = defaultdict[str, list[int]](list)
    for index, point in enumerate(points):
        node, part, *_ = point.path
        found[node].append(index)
        found[f"{node}/{part}"].append(index)
    return dict(found)


def _by_front(key: str, _: bytes | None) -> str:
    return protocol.front_of(key)
