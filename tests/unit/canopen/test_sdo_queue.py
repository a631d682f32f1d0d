"""Transfers that wait for an SDO channel: by priority, then in order, and no more than there is room for."""

from __future__ import annotations

import pytest
from hypothesis import given
from hypothesis import strategies as st

from bridge.canopen.sdo_block import BlockUse
from bridge.canopen.sdo_queue import MOST_WAITING, Priority, SdoJob, SdoQueue
from bridge.canopen.sdo_transfer import Transfer


def never(use: BlockUse) -> Transfer:
    raise AssertionError("nothing is begun here")


def job(number: int, priority: Priority) -> SdoJob:
    return SdoJob(number, 0, never, lambda result: None, priority, 0, 0.5)


def test_there_is_room_for_64() -> None:
    queue = SdoQueue()
    assert sum(queue.add(job(number, Priority.POLL)) is None for number in range(99)) == 64


def test_commands_come_first_and_polls_last() -> None:
    assert sorted(Priority) == [Priority.COMMAND, Priority.BOOT, Priority.MEANING, Priority.POLL]
    queue = SdoQueue()
    for number, priority in enumerate((Priority.POLL, Priority.MEANING, Priority.COMMAND, Priority.BOOT)):
        assert queue.add(job(number, priority)) is None
    assert [one.index for one in queue] == [2, 3, 1, 0]
    assert len(queue) == 4


@given(st.lists(st.sampled_from(Priority), max_size=80))
def test_no_more_wait_than_there_is_room_for_and_the_least_important_give_way(kinds: list[Priority]) -> None:
    queue, dropped = SdoQueue(), 0
    for number, kind in enumerate(kinds):
        dropped += queue.add(job(number, kind)) is not None
        assert len(queue) <= MOST_WAITING
    served = [(one.priority, one.index) for one in queue]
    assert served == sorted(served), "of one priority the first that came is the first"
    assert len(served) == len(kinds) - dropped
    kept = sorted(kinds)[:MOST_WAITING]
    assert [priority for priority, _ in served] == kept


def full(priority: Priority) -> SdoQueue:
    queue = SdoQueue()
    for number in range(MOST_WAITING):
        queue.add(job(number, priority))
    return queue


def test_in_a_full_queue_the_last_of_the_least_important_is_dropped() -> None:
    queue = full(Priority.POLL)
    victim = queue.add(job(99, Priority.BOOT))
    assert victim is not None
    assert (victim.index, victim.priority) == (MOST_WAITING - 1, Priority.POLL)
    assert next(iter(queue)).index == 99


@pytest.mark.parametrize("priority", [Priority.MEANING, Priority.POLL])
def test_where_none_is_less_important_the_new_one_is_dropped(priority: Priority) -> None:
    queue, new = full(Priority.MEANING), job(99, priority)
    assert queue.add(new) is new
    assert len(queue) == MOST_WAITING


def test_a_job_is_removed_itself_and_not_one_like_it() -> None:
    queue, one, other = SdoQueue(), job(1, Priority.POLL), job(1, Priority.POLL)
    queue.add(one)
    assert not queue.remove(other)
    assert queue.remove(one)
    assert not queue.remove(one)
    queue.add(other)
    queue.clear()
    assert (len(queue), list(queue)) == (0, [])
