"""OPC UA: bytes before there is a channel, chunks on a channel, and the services of a session.

The session is that of an anonymous operator on the endpoint without security: what it asks gets past the
channel and as far as a right may bring it. What is for administrators comes on an encrypted one.
"""

from __future__ import annotations

from random import Random
from typing import Final

from asyncua import ua

from tests.fuzz.case import Case, Corpus, load
from tests.fuzz.mutate import Mutator
from tests.fuzz.rig import Rig
from tests.fuzz.targets.opcua_admin import AdminChannel
from tests.fuzz.targets.opcua_channel import Channel, Closed, chunk

_KINDS: Final = {"service": 66, "admin": 4, "chunk": 12, "channel": 6, "raw": 10, "left": 2}
_MOST_ON_ONE: Final = 60
_ANSWER_S: Final = 0.05


class Thrower:
    """``service`` parts are bodies in a session, ``admin`` ones in an administrator's; ``chunk`` parts are
    whole chunks; ``channel`` ones come after a good Hello, ``raw`` ones first of all. ``left`` is a service
    whose client leaves at once."""

    def __init__(self, rig: Rig, random: Random) -> None:
        self._rig = rig
        self._random = random
        self._mutator = Mutator(random, "little", texts=True)
        corpus = load("opcua")
        self._bodies = corpus.parts("service")
        self._raw = corpus.parts("raw")
        self._named = {kind: _by_name(corpus, kind) for kind in ("service", "admin")}
        self._channel: Channel | None = None
        self._admin: AdminChannel | None = None
        self._admins = 0
        self._thrown = 0

    def case(self) -> Case:
        kind = self._random.choices(tuple(_KINDS), tuple(_KINDS.values()))[0]
        if kind in ("raw", "channel"):
            raw = self._mutator.mutate(self._random.choice(self._raw), self._raw)
            return Case(kind, tuple(self._mutator.cut(raw, 3)))
        bodies = tuple(
            self._body("admin" if kind == "admin" else "service")
            for _ in range(self._random.choice((1, 1, 2, 3, 8)))
        )
        if kind == "chunk":
            return Case(kind, tuple(self._chunk(body) for body in bodies))
        return Case(kind, bodies)

    def _body(self, kind: str) -> bytes:
        # Each service and each method as often as any other, however often its clients have called it.
        named = self._named[kind]
        bodies = named[self._random.choice(tuple(named))]
        body = self._random.choice(bodies)
        if self._random.randrange(15) == 0:
            return body
        # The type and the session's token stay, mostly: without them nothing of the rest is looked at.
        head = 4 + 3 + 4 + 32 if self._random.randrange(8) else 0
        # Of an administrator's only what is meant for him: he could move the drives of others.
        others = self._bodies if kind == "service" else bodies
        return body[:head] + self._mutator.mutate(body[head:], others)

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
        if case.kind == "admin":
            self._throw_as_admin(case)
            return
        channel = self._in_session()
        self._thrown += 1
        for part in case.parts:
            if case.kind == "chunk":
                channel.send(part)
            else:
                channel.send_body(part)
        if case.kind == "left":
            channel.close()
            self._channel = None
        elif self._thrown > _MOST_ON_ONE:
            self.close()
        else:
            channel.listen(_ANSWER_S)

    def _throw_as_admin(self, case: Case) -> None:
        if self._admin is None:
            self._admins += 1
            self._admin = AdminChannel(self._rig, writes=self._admins % 2 == 0)
            self._admin.hello()
            self._admin.open()
            self._admin.activate()
        for part in case.parts:
            self._admin.send_body(part)
        self._admin.listen(_ANSWER_S)

    def _throw_first(self, case: Case) -> None:
        channel = Channel(self._rig.opcua)
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
            self._channel = channel = Channel(self._rig.opcua)
            self._thrown = 0
            channel.hello()
            channel.open()
            channel.activate()
        return self._channel

    def close(self) -> None:
        channels = self._channel, self._admin
        self._channel = self._admin = None
        for channel in channels:
            if channel:
                channel.leave()


def _by_name(corpus: Corpus, kind: str) -> dict[str, list[bytes]]:
    """Bodies of this kind by what they are."""
    found: dict[str, list[bytes]] = {}
    for one in corpus.recorded:
        if one.case.kind == kind:
            found.setdefault(one.what, []).extend(one.case.parts)
    return found
