"""Publishers and readers of values: busy keys are declared, few of them, and changes are told once."""

from __future__ import annotations

from collections.abc import Callable
from types import SimpleNamespace
from typing import Any, cast

import zenoh

from bridge.zenohlink.publishers import Publishers, Readers


class Session:
    """Notes what is put on it."""

    def __init__(self) -> None:
        self.puts: list[tuple[str, bytes, Any]] = []
        self.declared: list[str] = []
        self.by_publisher: list[tuple[str, bytes]] = []

    def put(self, key: str, payload: bytes, *, congestion_control: object, **more: Any) -> None:
        assert congestion_control == zenoh.CongestionControl.DROP
        self.puts.append((key, payload, more["encoding"]))

    def declare_publisher(self, key: str, *, congestion_control: object, **more: Any) -> object:
        assert congestion_control == zenoh.CongestionControl.DROP
        self.declared.append(key)
        return SimpleNamespace(put=lambda payload, attachment: self.by_publisher.append((key, payload)))


def put(publishers: Publishers, session: Session, key: str, payload: bytes = b"1") -> None:
    publishers.put(cast("zenoh.Session", session), (key, payload, None))


def test_a_key_with_many_values_gets_a_publisher_and_no_value_is_left_out() -> None:
    publishers, session = Publishers("text/plain"), Session()
    for number in range(12):
        put(publishers, session, "a", str(number).encode())
    assert session.declared == ["a"]
    assert [payload for _, payload, _ in session.puts] == [str(number).encode() for number in range(9)]
    assert [payload for _, payload in session.by_publisher] == [b"9", b"10", b"11"]
    assert {encoding for _, _, encoding in session.puts} == {"text/plain"}


def test_there_is_an_end_to_publishers_and_the_others_are_sent_all_the_same() -> None:
    publishers, session = Publishers("text/plain"), Session()
    for key in range(1001):
        for _ in range(10):
            put(publishers, session, str(key))
    assert len(session.declared) == 1000
    assert sum(key == "1000" for key, _, _ in session.puts) == 10


def test_however_often_readers_come_and_go_one_call_waits_and_tells_what_has_changed() -> None:
    told: list[bool] = []
    calls: list[Callable[[], None]] = []
    readers = Readers(told.append, calls.append)

    def status(matching: bool) -> None:
        readers.on_status(cast("zenoh.MatchingStatus", SimpleNamespace(matching=matching)))

    for matching in (True, False, True):
        status(matching)
    assert len(calls) == 1
    calls.pop()()
    assert told == [True]
    status(False)
    status(True)
    calls.pop()()
    assert told == [True], "nothing has changed"
    status(False)
    calls.pop()()
    assert told == [True, False]
