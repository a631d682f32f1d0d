"""The socket at which the bus process and its fronts meet, as their links see it (bridge.zenohlink): what is
sent over it comes in order, and an end that is gone is known to the other."""

from __future__ import annotations

import asyncio
from collections.abc import Callable, Sequence
from functools import partial
from typing import Any, Final

from bridge.zenohlink import GetReply, Sample
from tests.plant.machine import Process
from tests.plant.world import World

_DELAY_S: Final = 0.000_3
_ANY: Final = "*"


class Meeting:
    """All ends of the socket."""

    def __init__(self, world: World) -> None:
        self.world = world
        self.links: list[Link] = []

    def link(self, process: Process) -> Link:
        """A new end, of this process."""
        return Link(self, process)

    def others(self, link: Link) -> list[Link]:
        return [one for one in self.links if one is not link]

    def tell_readers(self) -> None:
        """Tell those who publish whether somebody reads."""
        for link in self.links:
            for key, (was_there, handler) in list(link.readers.items()):
                are_there = any(key in other.subscribers for other in self.others(link))
                if are_there is not was_there:
                    link.readers[key] = are_there, handler
                    link.hand_over(partial(handler, are_there))


class Query:
    """A query on its way (bridge.zenohlink.IncomingQuery)."""

    def __init__(self, asker: Link, key: str, payload: bytes | None, end: Callable[[], None]) -> None:
        self.key, self.payload = key, payload
        self.answers: list[GetReply] = []
        self._asker = asker
        self._end = end
        self.is_over = False

    def send(self, messages: Sequence[Sample]) -> None:
        self.answers += [GetReply(True, message) for message in messages]

    def fail(self, payload: bytes, encoding: str) -> None:
        self.answers.append(GetReply(False, Sample("", payload, encoding)))
        self.finish()

    def finish(self) -> None:
        if not self.is_over:
            self.is_over = True
            self._asker.hand_over(self._end)


class Link:
    """One end (bridge.zenohlink.ZenohLink)."""

    def __init__(self, meeting: Meeting, process: Process) -> None:
        self.subscribers: dict[str, Callable[[Sample], None]] = {}
        self.readers: dict[str, tuple[bool, Callable[[bool], None]]] = {}
        """Who is told whether somebody else subscribes to a key, and what it was told last."""
        self._meeting = meeting
        self._process = process
        self._queryables: dict[str, Callable[[Any], None]] = {}
        self._alive: dict[str, Callable[[str, bool], None]] = {}
        self._tokens: set[str] = set()
        self._asked: list[Query] = []

    def hand_over(self, act: Callable[[], None]) -> None:
        """Have this done in a turn of its process, when it has come."""
        self._meeting.world.after(_DELAY_S, lambda: self._process.post(act))

    async def open(self) -> bool:
        self._meeting.links.append(self)
        return True

    async def close(self) -> None:
        self.drop()

    async def failed(self) -> None:
        await asyncio.get_running_loop().create_future()

    def drop(self) -> None:
        """This end is gone, closed or with its process."""
        if self not in self._meeting.links:
            return
        self._meeting.links.remove(self)
        for other in self._meeting.links:
            for key in sorted(self._tokens & other._alive.keys()):
                other.hand_over(partial(other._alive[key], key, False))
        asked, self._asked = self._asked, []
        for query in asked:
            query.finish()
        self._meeting.tell_readers()

    # what is told

    def send(self, message: Sample) -> bool:
        for other in self._meeting.others(self):
            if message.key in other.subscribers:
                other.hand_over(partial(other._take, message))
        return True

    def _take(self, message: Sample) -> None:
        if handler := self.subscribers.get(message.key):
            handler(message)

    def declare_subscriber(self, key: str, handler: Callable[[Sample], None]) -> None:
        self.subscribers[key] = handler
        self._meeting.tell_readers()

    def drop_subscriber(self, key: str) -> None:
        self.subscribers.pop(key, None)
        self._meeting.tell_readers()

    def follow_readers(self, key: str, handler: Callable[[bool], None]) -> None:
        self.readers[key] = False, handler
        self._meeting.tell_readers()

    def declare_token(self, key: str) -> None:
        self._tokens.add(key)
        for other in self._meeting.others(self):
            if key in other._alive:
                other.hand_over(partial(other._alive[key], key, True))

    def follow_liveliness(self, key: str, handler: Callable[[str, bool], None]) -> None:
        self._alive[key] = handler
        for other in self._meeting.others(self):
            if key in other._tokens:
                self.hand_over(partial(handler, key, True))

    # what is asked

    def declare_queryable(
        self,
        key: str,
        handler: Callable[[Any], None],
        share: Callable[[str, bytes | None], str] | None = None,
    ) -> None:
        self._queryables[key] = handler

    async def get(self, key: str, payload: bytes | None = None, *, timeout_s: float = 2.0) -> list[GetReply]:
        done = asyncio.get_running_loop().create_future()

        def end() -> None:
            if not done.done():
                done.set_result(None)

        query = Query(self, key, payload, end)
        answering = next(
            (one for other in self._meeting.others(self) if (one := other._answering(query))), None
        )
        if answering is None:
            # Nobody can answer.
            query.finish()
        else:
            answering()
        await asyncio.wait((done,), timeout=timeout_s)
        return list(query.answers)

    def _answering(self, query: Query) -> Callable[[], None] | None:
        """What brings a query here; None where it is not answered here."""
        for pattern, handler in self._queryables.items():
            if query.key == pattern or (pattern.endswith(_ANY) and query.key.startswith(pattern[:-1])):
                return partial(self._bring, query, handler)
        return None

    def _bring(self, query: Query, handler: Callable[[Any], None]) -> None:
        self._asked = [one for one in self._asked if not one.is_over]
        self._asked.append(query)
        self.hand_over(partial(handler, query))
