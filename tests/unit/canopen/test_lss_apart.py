"""Separation of devices by a scan: its questions, and its report of lost answers."""

from __future__ import annotations

from collections.abc import Callable
from contextlib import suppress

import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from bridge.canopen.lss import LssAddress, LssExchange
from bridge.canopen.lss_scan import Scanned, find_all
from tests.support.lss_slave import LssSlave

STANDARD, TALKER, STAYS = {}, {"talks_when_found": True}, {"never_leaves": True}
kinds = st.sampled_from([STANDARD, TALKER, STAYS])
numbers = st.one_of(st.integers(0, 3), st.integers(0, 0xFFFF_FFFF))
identities = st.builds(LssAddress, numbers, numbers, numbers, numbers)
BEGIN = 0x80


def device(serial: int, vendor: int = 0x38) -> LssAddress:
    return LssAddress(vendor, 0x0001_0203, 7, serial)


class Wire:
    """Devices that answer at once. ``is_lost`` says of each question that was answered, by its number,
    whether the master hears nothing of it; ``before`` is called before each."""

    def __init__(
        self,
        *slaves: LssSlave,
        is_lost: Callable[[int, bytes], bool] = lambda number, question: False,
        before: Callable[[], None] = lambda: None,
    ) -> None:
        self.slaves = list(slaves)
        self.questions: list[bytes] = []
        self.begun = 0
        self._is_lost = is_lost
        self._before = before

    def scan(self, known: LssAddress | None = None) -> Scanned:
        scanned = Scanned()
        service = find_all(known, scanned)
        with suppress(StopIteration):
            exchange = next(service)
            while True:
                exchange = service.send(self._answer(exchange))
        return scanned

    def _answer(self, exchange: LssExchange) -> bytes | None:
        question = exchange.request
        if not question:
            return None
        if question[0] == 0x51:
            bit, sub, following = question[5:8]
            assert bit <= 31 or bit == BEGIN, "CiA 305 §6.7"
            assert following in (sub, (sub + 1) % 4)
            self._before()
            self.questions.append(question)
            self.begun += bit == BEGIN
        answers = [slave.on_request(question) for slave in self.slaves]
        answer = next((one for one in answers if one and one[0] == exchange.reply), None)
        if answer and question[0] == 0x51 and self._is_lost(len(self.questions) - 1, question):
            return None
        return answer


def test_each_bit_of_a_device_is_asked_once() -> None:
    """32 bits and the whole number, of four fields; and whether anybody is there, before and after."""
    wire = Wire(LssSlave(device(5)))
    assert wire.scan().found == [device(5)]
    assert len(wire.questions) == 1 + 4 * 33 + 1


def devices(*kinds: tuple[int, dict[str, bool]]) -> list[LssSlave]:
    """One for each serial number."""
    return [LssSlave(device(serial), **kind) for serial, kind in kinds]


def serials(found: list[LssAddress]) -> list[int]:
    return [one.serial for one in found]


@pytest.mark.parametrize(
    ("present", "keep_answering", "questions"),
    [
        # It is found (133), keeps answering (6); its neighbour is looked for in four fields, where each bit
        # that both have is one question (2, 10 + 4 · 32), and a bit of the neighbour's own two (6).
        ([(5, TALKER), (9, STANDARD)], [5], 285),
        ([(5, TALKER), (9, TALKER)], [5], 285),
        # Both are found (133 + 134), the second keeps answering (3 + 3), the first does not (2); nobody else
        # is there (2, 10 + 4 · 32).
        ([(5, STANDARD), (9, TALKER)], [9], 415),
        # As the latter, and a third one besides (4).
        ([(5, STANDARD), (9, TALKER), (12, STANDARD)], [9], 419),
        # The first is found twice (133 + 134) before it is sent to configuration state, where it is silent;
        # from there on it is as with the standard device (134 + 3 + 3 + 2 + 2 + 10 + 4 · 32).
        ([(5, STAYS), (9, TALKER)], [5, 9], 549),
    ],
)
def test_who_keeps_answering_is_named_and_nobody_is_searched_again(
    present: list[tuple[int, dict[str, bool]]], keep_answering: list[int], questions: int
) -> None:
    wire = Wire(*devices(*present))
    scanned = wire.scan()
    assert sorted(serials(scanned.found)) == [serial for serial, _ in present]
    assert (serials(scanned.keeps_answering), scanned.problem) == (keep_answering, "")
    assert len(wire.questions) == questions


@given(st.dictionaries(identities, kinds, max_size=3))
@settings(max_examples=60, deadline=None)
def test_no_question_is_asked_twice_of_the_same_devices(present: dict[LssAddress, dict[str, bool]]) -> None:
    wire = Wire(*(LssSlave(identity, **kind) for identity, kind in present.items()))
    scanned = wire.scan()
    assert (sorted(scanned.found), scanned.problem) == (sorted(present), "")
    asked: set[bytes] = set()
    for question in wire.questions:
        if question[5] == BEGIN:
            asked = set()
        elif question[5] < 31:  # the first bit of a serial number also shows who answers everything
            assert question not in asked, question.hex(" ")
            asked.add(question)


@pytest.mark.parametrize("known", [device(0), LssAddress(0x38, 0, 0, 0)])
def test_what_is_known_of_all_devices_is_not_asked(known: LssAddress) -> None:
    wire = Wire(*devices((5, TALKER), (9, STANDARD)))
    scanned = wire.scan(known)
    assert (sorted(serials(scanned.found)), scanned.problem) == ([5, 9], "")
    fields = {question[6] for question in wire.questions if 0 < question[5] < 31}
    assert fields == {sub for sub, value in enumerate(known) if not value}


def test_a_device_that_is_another_one_each_time_does_not_keep_a_scan_going_for_ever() -> None:
    """A bus has 127 nodes at the most."""
    slave = LssSlave(device(1), never_leaves=True)

    def before() -> None:
        slave.identity = device(wire.begun)

    wire = Wire(slave, before=before)
    assert len(wire.scan(device(0)).found) == 1
    assert wire.begun == 127


# lost answers


def test_a_device_that_never_confirms_is_searched_three_times_more_and_told() -> None:
    wire = Wire(LssSlave(device(5)), is_lost=lambda number, question: tuple(question[5:8]) == (0, 0, 1))
    scanned = wire.scan()
    assert scanned.found == []
    assert scanned.problem == "a device answered and confirmed no vendor id 00000038h: allow it more time"
    assert wire.begun == 4


def lose(question: str, times: int) -> Callable[[int, bytes], bool]:
    """The first answers to this question."""
    lost: list[int] = []

    def is_lost(number: int, asked: bytes) -> bool:
        if asked != bytes.fromhex(question) or len(lost) == times:
            return False
        lost.append(number)
        return True

    return is_lost


FIRST_BIT_OF_ITS_OWN = "51 00 08 00 00 0A 03 03"
"""First question that only serial number 900h answers, beside 5: from bit 10 on it is the only one."""
ITS_VENDOR = "51 39 00 00 00 00 00 01"


@pytest.mark.parametrize(
    ("question", "neighbour"),
    [(FIRST_BIT_OF_ITS_OWN, device(0x900)), (ITS_VENDOR, device(5, vendor=0x39))],
    ids=["a bit", "a field"],
)
def test_an_answer_that_is_missing_among_talkers_is_asked_for_three_times(
    question: str, neighbour: LssAddress
) -> None:
    def scan(times: int) -> Scanned:
        slaves = (LssSlave(device(5), talks_when_found=True), LssSlave(neighbour))
        return Wire(*slaves, is_lost=lose(question, times)).scan()

    for times in (1, 2):
        assert (scan(times).found, scan(times).problem) == ([device(5), neighbour], "")
    assert scan(3).found == [device(5)]
    assert scan(3).problem == "devices answer too late: allow them more time"


@pytest.mark.parametrize("beginning", [5, 6, 7, 8])
def test_devices_that_seem_to_be_away_are_looked_for_again(beginning: int) -> None:
    """The answer to "is anybody there?" is lost at one of the four fields."""
    wire = Wire(
        *devices((5, TALKER), (9, STANDARD)),
        is_lost=lambda number, question: question[5] == BEGIN and wire.begun == beginning,
    )
    scanned = wire.scan()
    assert (sorted(serials(scanned.found)), scanned.problem) == ([5, 9], "")
    assert wire.begun > 8


def test_a_device_that_leaves_the_bus_while_it_is_scanned_is_not_listed() -> None:
    gone = LssSlave(device(5, vendor=0x30), never_leaves=True)

    def before() -> None:
        if wire.begun == 4 and gone in wire.slaves:
            wire.slaves.remove(gone)

    wire = Wire(gone, LssSlave(device(9), talks_when_found=True), before=before)
    scanned = wire.scan()
    assert (scanned.found, scanned.keeps_answering, scanned.problem) == ([device(9)], [device(9)], "")


@given(st.integers(0, 420))
@settings(max_examples=40, deadline=None)
def test_whichever_answer_is_lost_nobody_is_listed_who_is_not_there(lost: int) -> None:
    present = devices((5, TALKER), (9, STANDARD), (12, STAYS))
    scanned = Wire(*present, is_lost=lambda number, question: number == lost).scan()
    assert set(serials(scanned.found)) <= {5, 9, 12}
