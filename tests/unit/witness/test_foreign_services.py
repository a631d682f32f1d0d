"""NMT commands and SDO writes that cannot be the bridge's are told; those that may be are not."""

from __future__ import annotations

from collections.abc import Callable

import pytest

from bridge.witness.foreign_services import Services

TIMEOUT_S = 0.5
READ, WRITE = bytes.fromhex("4000100000000000"), bytes.fromhex("2B0D200064000000")
ANSWER, ABORT = bytes.fromhex("60 0D 20 00 00 00 00 00"), bytes.fromhex("80 0D 20 00 00 00 04 05")


def _told(runs: tuple[int, ...]) -> Callable[[int, float], str]:
    return lambda node, at: "a drive of it is told to run" if node in runs else ""


class Bus:
    """Nodes 5 and 6."""

    def __init__(self, *runs: int) -> None:
        self.services = Services({5: TIMEOUT_S, 6: TIMEOUT_S}, _told(runs), {6: frozenset({0x6200})})
        self.told: list[str] = []

    def sees(self, can_id: int, data: bytes, at: float) -> str:
        found = self.services.on_frame(can_id, data, at)
        self.told += [found] if found else []
        return found


def test_it_looks_at_nmt_and_both_directions_of_sdo() -> None:
    assert Bus().services.identifiers == {0x000, 0x585, 0x586, 0x605, 0x606}
    assert not Services({}, _told(()), {}).identifiers


@pytest.mark.parametrize("command", [0x01, 0x02, 0x80, 0x81, 0x82])
@pytest.mark.parametrize("node", [0, 5])
def test_nothing_is_sent_by_nmt_to_a_node_whose_drive_is_told_to_run(command: int, node: int) -> None:
    assert "node 5 while a drive of it is told to run" in Bus(5).sees(0x000, bytes((command, node)), 1.0)


@pytest.mark.parametrize("command", [0x01, 0x02, 0x80, 0x81, 0x82])
@pytest.mark.parametrize("node", [0, 6])
def test_to_others_any_command_may_be_sent(command: int, node: int) -> None:
    runs = (5,) if node else ()
    assert not Bus(*runs).sees(0x000, bytes((command, node)), 1.0)


def test_a_node_that_the_site_does_not_have_is_nobodys_to_command() -> None:
    assert "node 9, which the site does not have" in Bus().sees(0x000, b"\x02\x09", 1.0)


@pytest.mark.parametrize("data", [b"", b"\x01", b"\x03\x05"])
def test_what_is_no_command_is_told(data: bytes) -> None:
    assert Bus().sees(0x000, data, 1.0)


@pytest.mark.parametrize(("period_s", "is_told"), [(0.02, True), (0.5, True), (0.8, False)])
def test_a_node_that_is_started_again_and_again_is_told(period_s: float, is_told: bool) -> None:
    bus = Bus()
    for n in range(20):
        bus.sees(0x000, b"\x01\x05", n * period_s)
    assert bool(bus.told) is is_told


def test_stops_may_be_repeated() -> None:
    bus = Bus()
    for n in range(100):
        bus.sees(0x000, b"\x02\x05", n / 50)
    assert not bus.told


def test_two_requests_at_once_are_of_two_clients() -> None:
    bus = Bus()
    bus.sees(0x605, READ, 1.0)
    assert not bus.told
    assert "two SDO requests to node 5 at once" in bus.sees(0x605, WRITE, 1.1)


@pytest.mark.parametrize("between", [(0x585, ANSWER), (0x605, ABORT)])
def test_after_the_answer_or_an_abort_the_next_may_follow(between: tuple[int, bytes]) -> None:
    bus = Bus()
    for can_id, data in ((0x605, READ), between, (0x605, READ)):
        bus.sees(can_id, data, 1.0)
    assert not bus.told


@pytest.mark.parametrize("command", [0x02, 0x81, 0x82])
def test_what_a_node_was_asked_before_it_was_stopped_has_no_answer(command: int) -> None:
    bus = Bus()
    bus.sees(0x605, READ, 1.0)
    bus.sees(0x000, bytes((command, 5)), 1.1)
    bus.sees(0x605, READ, 1.2)
    assert not bus.told


def test_a_stopped_node_answers_nothing_until_it_is_woken() -> None:
    bus = Bus()
    bus.sees(0x000, b"\x02\x00", 1.0)
    for at in (1.1, 1.2):
        bus.sees(0x605, READ, at)
    bus.sees(0x000, b"\x80\x05", 1.3)
    bus.sees(0x605, READ, 1.4)
    assert not bus.told
    assert "two SDO requests" in bus.sees(0x605, READ, 1.5)


def test_nor_does_one_that_has_restarted() -> None:
    bus = Bus()
    bus.sees(0x605, READ, 1.0)
    bus.services.on_restart(5)
    bus.sees(0x605, READ, 1.1)
    assert not bus.told


@pytest.mark.parametrize("waited_s", [0.0, 0.03])
def test_after_its_time_out_a_request_may_be_repeated(waited_s: float) -> None:
    """The first of them may have waited for the bus."""
    bus = Bus()
    bus.sees(0x605, READ, 1.0 + waited_s)
    bus.sees(0x605, READ, 1.0 + TIMEOUT_S)
    bus.sees(0x606, READ, 1.0 + TIMEOUT_S)
    assert not bus.told


def test_segments_are_no_further_requests() -> None:
    bus = Bus()
    for data in (READ, bytes((0x60, *bytes(7))), bytes((0x70, *bytes(7))), b"\x60"):
        bus.sees(0x605, data, 1.0)
    assert not bus.told


def written(index: int, *runs: int) -> bool:
    return bool(Bus(*runs).sees(0x605, bytes((0x2B, *index.to_bytes(2, "little"), 1, 0, 0, 0, 0)), 1.0))


@pytest.mark.parametrize("index", [0x1005, 0x1006, 0x1014, 0x1016, 0x1017, 0x1400, 0x1A03, 0x1F80, 0x6040])
def test_what_a_drive_hears_and_watches_is_left_alone_while_it_runs(index: int) -> None:
    assert written(index, 5)
    assert not written(index, 6)
    assert not written(index)


@pytest.mark.parametrize("index", [0x1003, 0x1010, 0x1018, 0x200D, 0x6042, 0x1C00])
def test_parameters_may_be_written(index: int) -> None:
    assert not written(index, 5)


def test_reading_is_harmless() -> None:
    assert not Bus(5).sees(0x605, bytes.fromhex("4000140100000000"), 1.0)
