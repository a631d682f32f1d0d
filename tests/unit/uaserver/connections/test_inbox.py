"""Messages that wait: how many there may be, and what is kept with each."""

from __future__ import annotations

import asyncio
from dataclasses import dataclass

import pytest
from asyncua.common.utils import Buffer

from bridge.uaserver.connections.inbox import Inbox


@dataclass
class Header:
    body_size: int


def message(size: int, behind: int = 0) -> tuple[Header, Buffer]:
    """One of this size, read together with so much that came behind it."""
    return Header(size), Buffer(b"h" * 8 + b"m" * size + b"x" * behind, 8)


def test_what_was_read_behind_a_message_is_not_kept_with_it() -> None:
    inbox = Inbox(500, lambda: 1 << 20)
    for _ in range(100):
        inbox.put_nowait(message(10, 64_000))
    kept = [inbox.get_nowait()[1] for _ in range(100)]
    assert {len(vars(body)["_data"]) for body in kept} == {10}
    assert bytes(kept[0]) == b"m" * 10


def test_it_is_full_by_number_and_by_bytes() -> None:
    most = 1000
    inbox = Inbox(5, lambda: most)
    for size in (300, 300, 300):
        inbox.put_nowait(message(size))
    assert inbox.held_bytes == 900
    inbox.put_nowait(message(300))
    with pytest.raises(asyncio.QueueFull):
        inbox.put_nowait(message(1))
    most = 10_000
    inbox.put_nowait(message(1))
    with pytest.raises(asyncio.QueueFull):
        inbox.put_nowait(message(1))
    for _ in range(5):
        inbox.get_nowait()
    assert inbox.held_bytes == 0


def test_the_end_of_a_connection_takes_no_bytes() -> None:
    inbox = Inbox(5, lambda: 1000)
    inbox.put_nowait((None, None))
    assert inbox.held_bytes == 0
    assert inbox.get_nowait() == (None, None)
    assert inbox.held_bytes == 0
