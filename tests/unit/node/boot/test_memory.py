"""Memory of a node from one boot-up to the next: what is not written, done or tried a second time."""

from __future__ import annotations

import pytest

from bridge.canopen.pdo import PdoCodec
from bridge.node.boot.memory import BootMemory
from bridge.node.boot.pdo_plan import PdoPlan
from bridge.parameter import ParameterError


def rpdo(cob_id: int, kind: int = 255) -> PdoPlan:
    return PdoPlan(cob_id, kind, 0, PdoCodec(()), ())


def test_of_a_node_that_was_never_seen_drives_may_run_and_nothing_was_done() -> None:
    memory = BootMemory()
    assert (memory.may_run, memory.is_at_rest, memory.did_not_start) == (True, False, False)
    assert (memory.unsaved, memory.unanswered_stores) == (False, 0)
    assert memory.count_write("n", "1010:01", "save") == "", "its first"


def test_a_write_to_the_eeprom_is_counted_as_of_the_boot_up_until_it_is_one_too_many() -> None:
    memory = BootMemory(cycles=2, began_at=100.0)
    for _ in range(2):
        memory.count_write("n", "1010:01", "save")
    with pytest.raises(ParameterError):
        memory.count_write("n", "1010:01", "save")
    assert memory.ledger.writes(("n", "1010:01")) == 2


def test_a_value_that_was_not_kept_is_known_by_its_bytes_until_the_node_starts_anew() -> None:
    memory = BootMemory()
    memory.note_not_kept(0x2097, 1, b"\1\0")
    assert memory.was_not_kept(0x2097, 1, b"\1\0")
    assert not memory.was_not_kept(0x2097, 1, b"\2\0")
    assert not memory.was_not_kept(0x2097, 2, b"\1\0")
    memory.start_anew()
    assert not memory.was_not_kept(0x2097, 1, b"\1\0")


def test_a_reset_by_the_boot_up_forgets_communication_objects_alone() -> None:
    """CiA 301 §7.4.1: 1000h … 1FFFh. 1010h and 1011h are commands and stay."""
    memory = BootMemory()
    for index in (0x1017, 0x1400, 0x1010, 0x2097, 0x6060):
        memory.note_not_kept(index, 1, b"\0")
    memory.was_reset()
    kept = [
        index for index in (0x1010, 0x1017, 0x1400, 0x2097, 0x6060) if memory.was_not_kept(index, 1, b"\0")
    ]
    assert kept == [0x1010, 0x2097, 0x6060]


def test_a_command_is_done_once_until_a_boot_up_has_succeeded() -> None:
    memory = BootMemory()
    assert not memory.has_done(0x1010, 1, b"save")
    memory.note_command(0x1010, 1, b"save")
    assert memory.has_done(0x1010, 1, b"save")
    assert not memory.has_done(0x1010, 2, b"save")
    memory.boot_succeeded()
    assert not memory.has_done(0x1010, 1, b"save")


@pytest.mark.parametrize(
    ("did_not_start", "may_run", "is_at_rest", "may"),
    [
        (True, False, False, True),
        (True, True, True, True),
        (True, True, False, False),
        (False, False, True, False),
    ],
)
def test_a_node_is_reset_where_it_did_not_start_and_no_drive_may_run(
    did_not_start: bool, may_run: bool, is_at_rest: bool, may: bool
) -> None:
    memory = BootMemory(may_run=may_run, is_at_rest=is_at_rest, did_not_start=did_not_start)
    assert memory.may_reset_for((0x11, 0x8240)) is may


def test_a_node_is_reset_once_for_an_error_and_for_three_in_all() -> None:
    memory = BootMemory(may_run=False)
    tried = []
    for code in (1, 1, 2, 3, 4):
        memory.did_not_start = True
        if memory.may_reset_for((0x11, code)):
            memory.note_reset((0x11, code))
            assert not memory.did_not_start
            tried.append(code)
    assert tried == [1, 2, 3]
    memory.boot_succeeded()
    memory.did_not_start, memory.may_run = True, False
    assert memory.may_reset_for((0x11, 4))


def test_who_starts_anew_may_be_reset_for_the_same_error_again() -> None:
    memory = BootMemory(may_run=False)
    memory.note_reset((0x11, 1))
    memory.start_anew()
    memory.did_not_start = True
    assert memory.may_reset_for((0x11, 1))


def test_a_reset_by_the_boot_up_is_no_start_that_failed() -> None:
    memory = BootMemory(did_not_start=True)
    memory.was_reset()
    assert not memory.did_not_start


def test_a_successful_boot_up_may_run_drives() -> None:
    memory = BootMemory(may_run=False, is_at_rest=True, did_not_start=True)
    memory.boot_succeeded()
    assert (memory.may_run, memory.is_at_rest, memory.did_not_start) == (True, False, False)


def test_of_an_rpdo_two_identifiers_are_remembered_and_the_last_comes_last() -> None:
    memory = BootMemory()
    for cob_id in (0x201, 0x202, 0x203, 0x202):
        memory.note_rpdo("a/fu1", 1, rpdo(cob_id))
    memory.note_rpdo("a/fu2", 1, rpdo(0x301))
    assert [one.cob_id for one in memory.rpdos_of("a/fu1")] == [0x203, 0x202]
    assert [one.cob_id for one in memory.rpdos_of("a/fu2")] == [0x301]
    assert list(memory.rpdos_of("a/fu3")) == []


@pytest.mark.parametrize(("kind", "waits"), [(0, True), (1, True), (240, True), (254, False), (255, False)])
def test_an_rpdo_of_a_synchronous_type_waits_for_sync(kind: int, waits: bool) -> None:
    """CiA 301 §7.5.2.35: 0 … 240 are synchronous."""
    memory = BootMemory()
    assert not memory.waits_for_sync
    memory.note_rpdo("a/fu1", 1, rpdo(0x201, kind=1))
    memory.note_rpdo("a/fu1", 1, rpdo(0x202, kind))
    assert memory.rpdo_types == {kind}, "the last one counts"
    assert memory.waits_for_sync is waits


def test_what_a_start_forgets_and_what_it_keeps() -> None:
    memory = BootMemory(unsaved=True, unanswered_stores=2, did_not_start=True)
    memory.note_rpdo("a/fu1", 1, rpdo(0x201))
    memory.note_command(0x1010, 1, b"save")
    memory.start_anew()
    assert (memory.unanswered_stores, memory.did_not_start) == (0, False)
    assert memory.unsaved
    assert not memory.has_done(0x1010, 1, b"save")
    assert len(list(memory.rpdos_of("a/fu1"))) == 1, "a stop still reaches it there"
