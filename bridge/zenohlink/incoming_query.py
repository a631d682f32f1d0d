"""Queries of others, answered from the event loop."""

# pyright: reportUnknownMemberType=false, reportUnknownLambdaType=false
# zenoh's stubs leave out the return types of what returns nothing.

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, replace
from typing import Protocol

import zenoh

from bridge.zenohlink.lane import Lane
from bridge.zenohlink.message import Sample
from bridge.zenohlink.worker import ZENOH_ERRORS


class Lanes(Protocol):
    """Threads on which answers go out."""

    def own_lane(self, like: Lane) -> Lane: ...

    async def settle(self, lane: Lane | None = None) -> None: ...


@dataclass(frozen=True, slots=True)
class IncomingQuery:
    """A query, to be answered from the loop: any number of ``send``, then ``finish`` or ``fail``.

    If it is not finished, the client waits until its own time-out.
    """

    key: str
    payload: bytes | None
    attachment: bytes | None
    parameters: str
    """The selector's part after the ``?``."""
    received_at: float
    """Time at which zenoh handed it over, in monotonic seconds; it may have waited for the loop since."""
    source: str
    """Id of the client's zenoh session, where the client gives it; not proved."""
    _query: zenoh.Query
    _link: Lanes
    _lane: Lane
    _is_apart: bool = False

    def apart(self) -> IncomingQuery:
        """The same, answered on a thread of its own, which ``finish`` ends. For long answers: replies wait
        for a client that does not read."""
        return replace(self, _lane=self._link.own_lane(self._lane), _is_apart=True)

    def send(self, messages: Sequence[Sample]) -> None:
        """With the present time stamp: what is published later counts as newer, whenever this is sent."""
        try:
            stamp = self._lane.session.new_timestamp()
        except ZENOH_ERRORS:  # the session has been closed
            return
        self._lane.do(lambda _: _reply(self._query, messages, stamp))

    async def settle(self) -> None:
        """Wait until the replies so far have been sent or given up."""
        await self._link.settle(self._lane)

    def finish(self) -> None:
        """End the query: there are no more replies."""
        self._lane.do(lambda _: self._query.drop())
        if self._is_apart:
            self._lane.end()

    def fail(self, payload: bytes, encoding: str) -> None:
        """Answer with an error, and finish."""
        self._lane.do(lambda _: _reply_error(self._query, payload, encoding))
        if self._is_apart:
            self._lane.end()


def _reply(query: zenoh.Query, messages: Sequence[Sample], stamp: zenoh.Timestamp) -> None:
    """``stamp``: if a storage has another sample of the key, the client's zenoh takes the newer one, and one
    without a time counts as the oldest."""
    for message in messages:
        query.reply(
            message.key,
            message.payload,
            encoding=message.encoding or None,
            attachment=message.attachment,
            timestamp=stamp,
        )


def _reply_error(query: zenoh.Query, payload: bytes, encoding: str) -> None:
    """Answer with an error and finish the query."""
    try:
        query.reply_err(payload, encoding=encoding)
    finally:
        query.drop()
