"""The gate that every write of a parameter passes: before anything else, and when its turn has come."""

from __future__ import annotations

import pytest

from bridge.canopen.frame import Frame
from bridge.canopen.sdo import SdoChannel
from bridge.mapping import load_family
from bridge.node.parameters.run import run
from bridge.parameter import DriveParameters, Ledger, Names, ParameterError
from bridge.parameter.error import Why
from bridge.parameter.protection import Gate

NORD, TIMEOUT = "nord/sk-tu4-cao", "P513"
"""Telegram time-out of the drive: it decides what a silent bridge does."""


class Doors:
    """A gate that can be told that something moves."""

    def __init__(self, *, is_engineer: bool) -> None:
        self.moving = False
        self.gate = Gate(is_engineer, lambda: self.moving)


def parameters(family: str) -> DriveParameters:
    model = load_family(family)
    return DriveParameters("conveyor/fu1", "conveyor", model, Names(model), Ledger())


@pytest.mark.parametrize(("is_engineer", "moving"), [(False, False), (True, True)])
def test_what_the_gate_does_not_let_in_costs_no_transfer(*, is_engineer: bool, moving: bool) -> None:
    access, doors = parameters(NORD), Doors(is_engineer=is_engineer)
    doors.moving = moving
    entry = access.names.resolve(TIMEOUT)
    with pytest.raises(ParameterError) as refused:
        next(access.write(entry, 0, 0.0, doors.gate))
    assert refused.value.why is Why.PROTECTED


def test_a_write_is_judged_again_when_its_turn_has_come() -> None:
    access, doors = parameters(NORD), Doors(is_engineer=True)
    entry = access.names.resolve(TIMEOUT)
    steps = access.write(entry, 1, 0.0, doors.gate)
    transfer = next(steps)
    while transfer.data is None:
        transfer = steps.send((bytes(2), 0.0))
    assert transfer.why_not is not None
    assert not transfer.why_not()
    doors.moving = True
    assert "is not written while the drive is enabled" in str(transfer.why_not())


def test_who_asks_the_drive_asks_it_right_before_the_write() -> None:
    access, asked = parameters(NORD), list[str]()
    entry = access.names.resolve(TIMEOUT)

    def asks(entries):
        asked.extend(one.name for one in entries)
        return
        yield

    steps = access.write(entry, 1, 0.0, Gate(True, lambda: False, asks))
    transfer = next(steps)
    while transfer.data is None:
        assert not asked
        transfer = steps.send((bytes(2), 0.0))
    assert asked == [entry.name]


def test_who_runs_a_write_asks_the_gate_when_its_turn_has_come() -> None:
    """The channel is busy, and the drive is enabled before it is free."""
    access, doors = parameters(NORD), Doors(is_engineer=True)
    channel = SdoChannel(0x605, 0x585, 0.2)
    results: list[object] = []
    entry = access.names.resolve(TIMEOUT)
    run(access.write(entry, 1, 0.0, doors.gate), lambda _: channel, lambda: 0.0, results.append)
    while frames := channel.take_frames():
        for frame in frames:
            assert frame.data[0] == 0x40, "a download, though something moves"
            doors.moving = True
            channel.on_frame(Frame(0x585, bytes((0x4B, *frame.data[1:4], 0, 0, 0, 0))))
    (refused,) = results
    assert isinstance(refused, ParameterError)
    assert refused.why is Why.PROTECTED
