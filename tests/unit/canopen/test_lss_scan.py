"""A scan among devices that do not fall silent when they are found: none hides another, and it ends."""

from __future__ import annotations

import pytest
from hypothesis import example, given, settings
from hypothesis import strategies as st

from bridge.bustools.lss_task import LssTask
from bridge.canopen.lss import LssAddress
from bridge.canopen.lss_scan import Scanned, find_all
from tests.support.lss_slave import WAITING, LssSlave
from tests.unit.canopen.test_lss import NORD, OTHER, TIMEOUT_S, LssBus

STANDARD, TALKER = "as the standard has it", "answers everything once it is found"
KINDS = {
    STANDARD: {},
    TALKER: {"talks_when_found": True},
    "stays in waiting state when it is found": {"never_leaves": True},
}
kinds = st.sampled_from(list(KINDS))
numbers = st.one_of(st.integers(0, 3), st.integers(0, 0xFFFF_FFFF))
identities = st.builds(LssAddress, numbers, numbers, numbers, numbers)
THIRD = LssAddress(NORD.vendor, 0x99, 1, 0)


def slaves(present: dict[LssAddress, str]) -> list[LssSlave]:
    return [LssSlave(identity, **KINDS[kind]) for identity, kind in present.items()]


@given(st.dictionaries(identities, kinds, max_size=3))
@example({NORD: TALKER, OTHER: TALKER})
@example({NORD: TALKER, OTHER: STANDARD, THIRD: STANDARD})
@settings(max_examples=25, deadline=None)
def test_every_device_is_found_whatever_its_neighbours_do(present: dict[LssAddress, str]) -> None:
    devices = slaves(present)
    bus = LssBus(*devices)
    scanned = bus.run(find_all(None)).result
    assert sorted(scanned.found) == sorted(present)
    assert scanned.problem == ""
    assert all(slave.state == WAITING and slave.node_id == 255 for slave in devices)
    talkers = {one for one, kind in present.items() if kind == TALKER}
    if len(present) == 1:
        assert set(scanned.keeps_answering) >= talkers
    # A scan of each, one more for each that has to be sent away, and twice as long to tell them apart.
    assert bus.now - 100.0 <= (4 * len(present) + 1) * 140 * TIMEOUT_S


def test_two_devices_of_a_widespread_stack_are_listed_and_named() -> None:
    """CANopenNode 4: the first one answers every further question, and hid the second for good."""
    devices = [LssSlave(identity, talks_when_found=True) for identity in (NORD, OTHER)]
    bus = LssBus(*devices)
    scanned = bus.run(find_all(None)).result
    assert (sorted(scanned.found), scanned.keeps_answering, scanned.problem) == ([NORD, OTHER], [NORD], "")
    scans = (bus.now - 100.0) / (133 * TIMEOUT_S)
    assert scans < 3, "less than three scans of one device"


def test_a_device_that_answers_everything_from_the_start_ends_the_scan_with_a_problem() -> None:
    bus = LssBus(LssSlave(OTHER, answers_all=True), LssSlave(NORD))
    scanned = bus.run(find_all(None)).result
    assert "answers every question" in scanned.problem
    assert bus.now - 100.0 < 3 * 133 * TIMEOUT_S


def test_what_was_found_is_kept_where_the_rest_is_spoilt() -> None:
    """The second device answers as it likes: the first one is listed, and why there may be more."""
    asked = 0

    def delays(request: bytes) -> float:
        nonlocal asked
        asked += 1
        return (asked % 7) * TIMEOUT_S if asked > 150 else 0.0

    task = LssBus(LssSlave(NORD), LssSlave(OTHER), delays=delays).run(find_all(None))
    assert set(task.result.found) <= {NORD, OTHER}
    assert task.result.found
    assert task.result.problem or len(task.result.found) == 2


def test_what_an_interrupted_scan_has_found_is_there() -> None:
    scanned = Scanned()
    slave = LssSlave(NORD)
    task = LssTask(find_all(None, scanned), 0.0, TIMEOUT_S)
    now = 0.0
    while not scanned.found:
        for frame in task.take_frames():
            answer = slave.on_request(frame.data)
            if answer:
                task.on_frame(frame._replace(can_id=0x7E4, data=answer, time=now))
        now = task.next_deadline() or now
        task.on_time(now)
    assert scanned.found == [NORD]


@pytest.mark.parametrize(
    "known", [LssAddress(NORD.vendor, NORD.product, NORD.revision, 0), LssAddress(NORD.vendor, 0, 0, 0)]
)
def test_what_is_known_is_not_searched_among_talkers_either(known: LssAddress) -> None:
    devices = [LssSlave(identity, talks_when_found=True) for identity in (NORD, OTHER)]
    bus, whole = LssBus(*devices), LssBus(*(LssSlave(one, talks_when_found=True) for one in (NORD, OTHER)))
    assert sorted(bus.run(find_all(known)).result.found) == [NORD, OTHER]
    whole.run(find_all(None))
    assert bus.now < whole.now
