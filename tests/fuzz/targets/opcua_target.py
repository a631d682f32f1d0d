"""OPC UA: bytes before there is a channel, chunks on a channel, and the services of a session.

The session is that of an anonymous operator on the endpoint without security: what it asks gets past the
channel and as far as a right may bring it.
"""

from __future__ import annotations

from random import Random
from typing import Final

from asyncua import ua

from tests.fuzz.case import Case, load
from tests.fuzz.mutate import Mutator
from tests.fuzz.rig import Rig
from tests.fuzz.targets.opcua_channel import Channel, Closed, chunk

_KINDS: Final = {"service": 70, "chunk": 12, "channel": 6, "raw": 10, "left": 2}
_MOST_ON_ONE: Final = 60
_ANSWER_S: Final = 0.05


class Thrower:
    """``service`` parts are bodies in a session; ``chunk`` parts are whole chunks there; ``channel`` ones
    come after a good Hello, ``raw`` ones first of all. ``left`` is a service whose client leaves at once."""

    def __init__(self, rig: Rig, random: Random) -> None:
        self._port = rig.opcua
        self._random = random
        self._mutator = Mutator(random, "little", texts=True)
        corpus = load("opcua")
        self._bodies = corpus.parts("service")
        self._raw = corpus.parts("raw")
        self._by_type: dict[bytes, list[bytes]] = {}
        for body in self._bodies:
            self._by_type.setdefault(body[:4], []).append(body)
        self._channel: Channel | None = None
        self._thrown = 0

    def case(self) -> Case:
        kind = self._random.choices(tuple(_KINDS), tuple(_KINDS.values()))[0]
        if kind in ("raw", "channel"):
            raw = self._mutator.mutate(self._random.choice(self._raw), self._raw)
            return Case(kind, tuple(self._mutator.cut(raw, 3)))
        bodies = tuple(self._body() for _ in range(self._random.choice((1, 1, 2, 3, 8))))
        if kind == "chunk":
            return Case(kind, tuple(self._chunk(body) for body in bodies))
        return Case(kind, bodies)

    def _body(self) -> bytes:
        # Each service as often as any other, however often its clients have called it.
        body = self._random.choice(self._by_type[self._random.choice(tuple(self._by_type))])
        if self._random.randrange(15) == 0:
            return body
        # The type and the session's token stay, mostly: without them nothing of the rest is looked at.
        head = 4 + 3 + 4 + 32 if self._random.randrange(8) else 0
        return body[:head] + self._mutator.mutate(body[head:], self._bodies)

    def _chunk(self, body: bytes) -> bytes:
        """A chunk that is wrong somewhere, or a message in several of them."""
        how = self._random.randrange(4)
        if how == 0:
            return self._mutator.mutate(chunk(body))
        if how == 1:
            return chunk(
                body, self._random.choice((b"MSGA", b"MSGC", b"MSGX", b"OPNF", b"CLOF", b"ERRF", b"HELF"))
            )
        pieces = self._mutator.cut(body) or [b""]
        chunks = [chunk(piece, b"MSGC") for piece in pieces[:-1]] + [chunk(pieces[-1])]
        if how == 2:
            self._random.shuffle(chunks)
        return b"".join(chunks)

    def throw(self, case: Case) -> None:
        try:
            self._throw(case)
        except (OSError, Closed, StopIteration, ua.UaError):
            self.close()

    def _throw(self, case: Case) -> None:
        if case.kind in ("raw", "channel"):
            self._throw_first(case)
            return
        channel = self._in_session()
        self._thrown += 1
        for part in case.parts:
            channel.send(part if case.kind == "chunk" else chunk(part))
        if case.kind == "left":
            channel.close()
            self._channel = None
        elif self._thrown > _MOST_ON_ONE:
            self.close()
        else:
            channel.listen(_ANSWER_S)

    def _throw_first(self, case: Case) -> None:
        channel = Channel(self._port)
        try:
            if case.kind == "channel":
                channel.hello()
            for part in case.parts:
                channel.send(part)
            channel.listen(_ANSWER_S)
        finally:
            channel.close()

    def _in_session(self) -> Channel:
        if self._channel is None:
            self._channel = channel = Channel(self._port)
            self._thrown = 0
            channel.hello()
            channel.open()
            channel.activate()
        return self._channel

    def close(self) -> None:
        channel, self._channel = self._channel, None
        if channel:
            channel.leave()
