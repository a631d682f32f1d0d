"""The LSS master against the slaves of ``tests/support/lss_slave.py``, on a virtual clock."""

from __future__ import annotations

from collections.abc import Callable
from contextlib import suppress
from typing import TypeVar

import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from bridge.bustools import lss_task
from bridge.bustools.lss_task import LssTask
from bridge.canopen import lss
from bridge.canopen.frame import Frame
from bridge.canopen.lss import LssAddress, LssError, Service
from bridge.canopen.lss_scan import find_all
from tests.support.lss_slave import CONFIGURATION, WAITING, LssSlave

T = TypeVar("T")
NORD = LssAddress(0x0000_0038, 0x0001_0203, 0x0000_0007, 0x1234_5678)
OTHER = LssAddress(0x0000_0038, 0x0001_0203, 0x0000_0007, 0x1234_5679)
TIMEOUT_S = 0.05

numbers = st.integers(0, 0xFFFF_FFFF)
identities = st.tuples(numbers, numbers, numbers, numbers)


class LssBus:
    """Every slave hears every request; answers come ``delay_s`` later, all of them, and as much later
    again as ``delays`` says for a request."""

    def __init__(
        self,
        *slaves: LssSlave,
        delay_s: float = 0.001,
        mute: bool = False,
        delays: Callable[[bytes], float] = lambda request: 0.0,
    ) -> None:
        self.slaves = slaves
        self.delay_s = delay_s
        self.delays = delays
        self.mute = mute
        self.now = 100.0
        self.requests: list[bytes] = []

    def run(self, service: Service[T]) -> LssTask[T]:
        task = LssTask(service, self.now, TIMEOUT_S)
        coming: list[Frame] = []
        while not task.is_finished(self.now):
            for frame in task.take_frames():
                assert frame.can_id == 0x7E5
                assert len(frame.data) == 8
                self.requests.append(frame.data)
                for number, slave in enumerate(self.slaves, 1):
                    answer = slave.on_request(frame.data)
                    if answer is not None and not self.mute:
                        delay_s = number * self.delay_s + self.delays(frame.data)
                        coming.append(Frame(0x7E4, answer, self.now + delay_s))
            times = [frame.time for frame in coming]
            deadline = task.next_deadline()
            if deadline is None:
                break
            self.now = min([*times, deadline])
            for frame in [frame for frame in coming if frame.time <= self.now]:
                coming.remove(frame)
                task.on_frame(frame)
            task.on_time(self.now)
        for frame in task.take_frames():
            self.requests.append(frame.data)
            for slave in self.slaves:
                slave.on_request(frame.data)
        return task


def test_the_messages_are_those_of_cia_305() -> None:
    slave = LssSlave(NORD)
    bus = LssBus(slave)
    bus.run(lss_task.set_node_id(NORD, 5, keep=True))
    assert [request.hex().upper() for request in bus.requests] == [
        "0400000000000000",
        "4038000000000000",
        "4103020100000000",
        "4207000000000000",
        "4378563412000000",
        "1105000000000000",
        "1700000000000000",
        "0400000000000000",
    ]


@given(st.lists(identities, max_size=3, unique=True))
@settings(max_examples=60, deadline=None)
def test_a_scan_finds_every_device_and_leaves_it_waiting(present: list[tuple[int, int, int, int]]) -> None:
    slaves = [LssSlave(identity) for identity in present]
    task = LssBus(*slaves).run(find_all(None))
    assert sorted(task.result.found) == sorted(present)
    assert not task.result.keeps_answering
    assert all(slave.state == WAITING for slave in slaves)


def test_late_answers_of_several_devices_do_not_spoil_the_scan() -> None:
    """Both answer the same question, the second nearly when the time is over."""
    bus = LssBus(LssSlave(NORD), LssSlave(OTHER), delay_s=0.024)
    assert set(bus.run(find_all(None)).result.found) == {NORD, OTHER}


def test_devices_slower_than_the_answer_time_are_given_what_they_need() -> None:
    """The first question waits longer, and measures how slow they are."""
    slow_s = 2 * TIMEOUT_S
    task = LssBus(LssSlave(NORD), LssSlave(OTHER), delay_s=slow_s).run(find_all(None))
    assert set(task.result.found) == {NORD, OTHER}
    assert task.late == 0


def test_a_device_that_becomes_slow_in_the_middle_is_found_in_the_next_scan() -> None:
    asked = 0

    def delays(request: bytes) -> float:
        nonlocal asked
        asked += 1
        return 1.5 * TIMEOUT_S if asked > 20 else 0.0

    task = LssBus(LssSlave(NORD), delays=delays).run(find_all(None))
    assert task.result.found == [NORD]


def test_a_late_answer_that_passes_for_the_last_confirmation_finds_no_phantom() -> None:
    """The answer to "serial number, bit 0" comes when the number is to be confirmed, with that bit wrong."""
    hits: list[bytes] = []

    def delays(request: bytes) -> float:
        is_last_bit = request[0] == 0x51 and tuple(request[5:8]) == (0, 3, 3)
        if not is_last_bit or hits:
            return 0.0
        hits.append(request)
        return 1.1 * TIMEOUT_S

    slave = LssSlave(NORD)
    task = LssBus(slave, delays=delays).run(find_all(None))
    assert hits
    assert task.result.found == [NORD]
    assert slave.state == WAITING


def test_a_device_that_is_too_slow_for_the_first_question_is_not_found_but_noticed() -> None:
    task = LssTask(find_all(None), 0.0, TIMEOUT_S)
    now = 0.0
    while not task.is_finished(now):
        asked = any(frame.data[0] == 0x51 for frame in task.take_frames())
        now = task.next_deadline() or now
        task.on_time(now)
        if asked:
            task.on_frame(Frame(0x7E4, b"\x4f" + bytes(7), now + 0.001))
    assert task.result.found == []
    assert task.late == 1


def test_a_scan_that_was_spoilt_by_a_late_answer_is_made_again() -> None:
    bus = LssBus(LssSlave(NORD), delay_s=0.001)
    service = find_all(None)
    task = LssTask(service, 0.0, TIMEOUT_S)
    asked, now = 0, 0.0
    while not task.is_finished(now):
        for frame in task.take_frames():
            answer = bus.slaves[0].on_request(frame.data)
            asked += 1
            # Somebody else's late answer says "this bit is 0" in the middle of the first scan.
            if asked == 20:
                answer = b"\x4f" + bytes(7)
            if answer:
                task.on_frame(Frame(0x7E4, answer, now))
        now = task.next_deadline() or now
        task.on_time(now)
    assert task.result.found == [NORD]


def test_a_scan_passes_over_devices_that_have_a_node_id() -> None:
    assert LssBus(LssSlave(NORD, node_id=5)).run(find_all(None)).result.found == []


def test_what_is_known_is_not_searched() -> None:
    bus = LssBus(LssSlave(NORD))
    task = bus.run(find_all(LssAddress(NORD.vendor, NORD.product, NORD.revision, 0)))
    assert task.result.found == [NORD]
    assert len(bus.requests) < 50


def test_a_device_without_a_node_id_has_one_afterwards() -> None:
    one, other = LssSlave(NORD), LssSlave(OTHER)
    LssBus(one, other).run(lss_task.set_node_id(OTHER, 17, keep=False))
    assert (one.node_id, other.node_id) == (255, 17)
    assert other.stored is None


def test_the_only_device_is_asked_without_its_identity() -> None:
    slave = LssSlave(NORD, node_id=9)
    assert LssBus(slave).run(lss_task.inquire(None)).result == (NORD, 9)
    assert slave.state == WAITING


def test_bit_rate_is_set_stored_and_activated() -> None:
    slave = LssSlave(NORD)
    LssBus(slave).run(lss_task.set_bit_rate(NORD, 250_000, keep=True, activate_ms=500))
    assert (slave.bit_timing, slave.stored, slave.activated_ms) == (3, (255, 3), 500)


def test_a_refusal_is_told_and_the_device_left_in_waiting_state() -> None:
    slave = LssSlave(NORD)
    task = LssBus(slave).run(lss_task.set_bit_rate(NORD, 800_000, keep=True, activate_ms=None))
    with pytest.raises(LssError, match="this bit rate is not supported"):
        _ = task.result
    assert slave.stored is None
    assert slave.state == WAITING


def test_a_device_that_cannot_store_says_so() -> None:
    task = LssBus(LssSlave(NORD, cannot_store=True)).run(lss_task.keep_settings(None))
    with pytest.raises(LssError, match="the device cannot store"):
        _ = task.result


def test_nobody_with_this_identity_is_told() -> None:
    task = LssBus(LssSlave(OTHER)).run(lss_task.inquire(NORD))
    with pytest.raises(LssError, match="no device has this identity"):
        _ = task.result


def test_a_silent_device_is_told_by_the_step_it_was_silent_at() -> None:
    task = LssBus(LssSlave(NORD), mute=True).run(lss_task.inquire(None))
    with pytest.raises(LssError, match="no answer: asking for its vendor id"):
        _ = task.result


@given(st.lists(st.tuples(st.sampled_from([0x7E4, 0x7E5, 0x185]), st.binary(max_size=8)), max_size=40))
def test_nothing_on_the_wire_raises(frames: list[tuple[int, bytes]]) -> None:
    task = LssTask(find_all(None), 0.0, TIMEOUT_S)
    now = 0.0
    for can_id, data in frames:
        task.take_frames()
        task.on_frame(Frame(can_id, data, now))
        now = task.next_deadline() or now
        task.on_time(now)


def test_a_selected_device_is_in_configuration_state() -> None:
    slave = LssSlave(NORD)
    LssBus(slave).run(lss.switch_selective(NORD))
    assert slave.state == CONFIGURATION


def requests(service: Service[T], answer: bytes | None = None) -> list[str]:
    """Requests of a service if this is the answer to each of them."""
    sent: list[str] = []
    with suppress(StopIteration):
        exchange = next(service)
        while True:
            sent.append(exchange.request.hex(" ").upper())
            exchange = service.send(answer)
    return sent


@pytest.mark.parametrize(
    ("bit_rate", "index"),
    [
        (1_000_000, 0),
        (800_000, 1),
        (500_000, 2),
        (250_000, 3),
        (125_000, 4),
        (50_000, 6),
        (20_000, 7),
        (10_000, 8),
        (None, 9),
    ],
)
def test_each_bit_rate_has_its_index_in_table_0(bit_rate: int | None, index: int) -> None:
    """CiA 305 §6.4.3; 5 is reserved, 9 is the automatic detection."""
    assert requests(lss.configure_bit_rate(bit_rate)) == [f"13 00 {index:02X} 00 00 00 00 00"]


@pytest.mark.parametrize(
    ("answer", "text"),
    [
        ("11 00 00", ""),
        ("11 01 00", "a node id must be 1…127 or 255"),
        ("13 01 00", "this bit rate is not supported"),
        ("17 01 00", "the device cannot store"),
        ("17 02 00", "access to its memory failed"),
        ("17 03 00", "error 3"),
        ("11 02 00", "error 2"),
        ("11 FF 07", "its own error 7"),
    ],
)
def test_errors_are_told_in_words(answer: str, text: str) -> None:
    assert lss.error_text(bytes.fromhex(answer).ljust(8, b"\0")) == text


def test_whoever_refuses_a_node_id_is_no_success() -> None:
    slave = LssSlave(NORD, state=CONFIGURATION)
    task = LssBus(slave).run(lss.configure_node_id(200))
    with pytest.raises(LssError, match="1…127 or 255"):
        _ = task.result
    assert requests(lss.configure_node_id(lss.NO_NODE_ID)) == ["11 FF 00 00 00 00 00 00"]


def test_the_questions_of_a_scan() -> None:
    """CiA 305 §6.7: number, lowest bit that is compared, field, next field; 80h begins a scan."""
    assert requests(lss.is_anybody_there()) == ["51 00 00 00 00 80 00 00"]
    assert requests(lss.has(2, 0x1234_5678, 7)) == ["51 78 56 34 12 07 02 02"]
    assert requests(lss.has(2, 0x1234_5678)) == ["51 78 56 34 12 00 02 02"], "the whole number"
    assert requests(lss.enter(2, 0x1234_5678)) == ["51 78 56 34 12 00 02 03"]
    assert requests(lss.enter(3, 0x1234_5678)) == ["51 78 56 34 12 00 03 00"]


def test_who_answers_everything_is_asked_for_both_values_of_a_bit() -> None:
    assert requests(lss.answers_everything(), bytes(8)) == [
        "51 00 00 00 00 1F 03 03",
        "51 00 00 00 80 1F 03 03",
    ]
    assert requests(lss.answers_everything()) == ["51 00 00 00 00 1F 03 03"]


def test_the_delay_of_a_new_bit_rate_is_told_in_ms() -> None:
    assert requests(lss.activate_bit_rate(0x0102)) == ["15 02 01 00 00 00 00 00"]
