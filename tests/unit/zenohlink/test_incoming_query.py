"""Queries of others: replies with one time stamp, errors, their end, and answers on a thread of their own."""

from __future__ import annotations

from collections.abc import Callable
from typing import Any, cast

import zenoh

from bridge.zenohlink.incoming_query import IncomingQuery, Lanes
from bridge.zenohlink.lane import Lane
from bridge.zenohlink.message import Sample


class Query:
    def __init__(self) -> None:
        self.replies: list[tuple[str, bytes, Any, Any, Any]] = []
        self.errors: list[tuple[bytes, str]] = []
        self.drops = 0

    def reply(self, key: str, payload: bytes, *, encoding: Any, attachment: Any, timestamp: Any) -> None:
        self.replies.append((key, payload, encoding, attachment, timestamp))

    def reply_err(self, payload: bytes, *, encoding: str) -> None:
        self.errors.append((payload, encoding))

    def drop(self) -> None:
        self.drops += 1


class Line:
    """A lane that does at once what it is given."""

    def __init__(self, stamp: object = "now") -> None:
        self.stamp = stamp
        self.session = self
        self.ended = 0

    def new_timestamp(self) -> object:
        if isinstance(self.stamp, Exception):
            raise self.stamp
        return self.stamp

    def do(self, job: Callable[[object], None]) -> bool:
        job(self)
        return True

    def end(self) -> None:
        self.ended += 1


class Link:
    def __init__(self) -> None:
        self.own = Line("own")

    def own_lane(self, like: Lane) -> Lane:
        return cast("Lane", self.own)

    async def settle(self, lane: Lane | None = None) -> None: ...


def asked(line: Line, link: Link, query: Query) -> IncomingQuery:
    of_zenoh = cast("zenoh.Query", query)
    return IncomingQuery("a/b", None, None, "", 10.0, "", of_zenoh, cast("Lanes", link), cast("Lane", line))


def test_all_replies_of_a_call_have_one_time_stamp() -> None:
    line, query = Line("stamp"), Query()
    asked(line, Link(), query).send([Sample("a", b"1"), Sample("b", b"2", "text/plain", b"x")])
    assert query.replies == [
        ("a", b"1", None, None, "stamp"),
        ("b", b"2", "text/plain", b"x", "stamp"),
    ]
    assert query.drops == 0, "more may follow"


def test_it_is_finished_once_it_is_said() -> None:
    line, query = Line(), Query()
    asked(line, Link(), query).finish()
    assert (query.drops, line.ended) == (1, 0)


def test_an_error_is_its_end() -> None:
    line, query = Line(), Query()
    asked(line, Link(), query).fail(b"no", "text/plain")
    assert (query.errors, query.drops) == ([(b"no", "text/plain")], 1)


def test_a_long_answer_has_a_lane_of_its_own_which_its_end_ends() -> None:
    for end in ("finish", "fail"):
        line, link, query = Line(), Link(), Query()
        apart = asked(line, link, query).apart()
        apart.send([Sample("a", b"1")])
        assert query.replies[0][-1] == "own"
        if end == "finish":
            apart.finish()
        else:
            apart.fail(b"no", "text/plain")
        assert (link.own.ended, line.ended) == (1, 0)


def test_in_a_session_that_has_been_closed_nothing_is_sent() -> None:
    query = Query()
    asked(Line(zenoh.ZError("closed")), Link(), query).send([Sample("a", b"1")])
    assert query.replies == []
