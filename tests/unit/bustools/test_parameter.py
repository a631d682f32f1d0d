"""Procedures on parameters as tasks: over the channel that reaches the drive, until they have ended."""

from __future__ import annotations

from collections.abc import Generator

from bridge.bustools.parameter import ParameterTask
from bridge.canopen.frame import Frame
from bridge.mapping.model import ObjectRef
from bridge.parameter import ParameterError, Transfer, TransferFailed, Why
from bridge.text import Text
from tests.support import sites
from tests.support.nodes import node_of

PLACE = ObjectRef(0x2066, 1)
Steps = Generator[Transfer, tuple[bytes, float], bytes]


def task(slot: str = "fu1", *, of_node: bool = False, fails: bool = False) -> ParameterTask[bytes]:
    node = node_of(sites.drive(slot, "none", 0, ""))

    def steps() -> Steps:
        if fails:
            raise ParameterError(Why.READ_ONLY, Text.plain("no"))
        try:
            data, _ = yield Transfer(PLACE, of_node=of_node)
        except TransferFailed as failure:
            raise ParameterError(Why.NO_ANSWER, failure.said) from None
        return data

    return ParameterTask(node.table, node.family, node.drives[0].slot, lambda now: steps(), 10.0)


def test_a_drive_behind_a_channel_of_its_own_is_asked_over_that() -> None:
    """BU 2500 §6.4: SDO3 reaches FU2 … its requests are 440h + node id."""
    family = sites.family(sites.FAMILY)
    for server in family.sdo:
        if server.slot is None:
            continue
        slot = family.slot_named(server.slot)
        want = 0x605 if slot.parameters_by_sdo else server.request + 5
        assert [frame.can_id for frame in task(server.slot).take_frames()] == [want]
        assert [frame.can_id for frame in task(server.slot, of_node=True).take_frames()] == [0x605]


def test_it_ends_with_its_result() -> None:
    one = task()
    one.take_frames()
    assert not one.is_finished(10.0)
    one.on_frame(Frame(0x585, bytes.fromhex("4B662001F4010000"), 10.1))
    assert one.is_finished(10.1)
    assert one.result == b"\xf4\x01"


def test_its_own_error_is_its_result() -> None:
    one = task(fails=True)
    assert one.is_finished(10.0)
    assert isinstance(one.result, ParameterError)
    assert one.result.why is Why.READ_ONLY


def test_a_node_that_does_not_answer_ends_it() -> None:
    one = task()
    while (due := one.next_deadline()) is not None:
        one.take_frames()
        one.on_time(due)
    assert isinstance(one.result, ParameterError)
    assert one.result.why is Why.NO_ANSWER
