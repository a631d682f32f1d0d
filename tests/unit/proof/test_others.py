"""The demand on a bridge that gives way: the NMT stop of each node, before it begins anew."""

from __future__ import annotations

from types import SimpleNamespace
from typing import cast

import pytest

from tests.proof import others
from tests.proof.drives import DRIVES
from tests.proof.rig import BRIDGE_HEARTBEAT, NMT, Rig
from tests.proof.witness import Run

DRIVE = DRIVES[0]
STOP, STOP_ALL, RESET = bytes((2, DRIVE.node_id)), b"\2\0", bytes((0x81, DRIVE.node_id))
OF_ANOTHER = bytes((2, DRIVE.node_id + 1))
TWIN, BOOT_UP, OPERATIONAL = b"\x7f", b"\0", b"\5"


def found(commands: dict[float, bytes], beats: dict[float, bytes]) -> str:
    seen = {NMT: commands, BRIDGE_HEARTBEAT: beats}

    def runs(can_id: int, since: float) -> list[Run]:
        return [Run(at, at, data) for at, data in seen[can_id].items() if at >= since]

    rig = SimpleNamespace(told=SimpleNamespace(runs=runs))
    return others.owed_stop(cast(Rig, rig), DRIVE, 10.0)


@pytest.mark.parametrize("stop", [STOP, STOP_ALL])
def test_a_stop_before_the_boot_up_is_the_one_that_was_owed(stop: bytes) -> None:
    assert not found({10.3: stop}, {10.25: TWIN, 11.4: BOOT_UP, 11.5: OPERATIONAL})
    assert not found({10.3: stop}, {10.25: TWIN})


@pytest.mark.parametrize(
    "commands", [{}, {10.3: OF_ANOTHER}, {10.3: RESET}, {9.0: STOP}, {11.5: STOP}], ids=str
)
def test_nothing_else_is(commands: dict[float, bytes]) -> None:
    assert found(commands, {9.1: BOOT_UP, 10.25: TWIN, 11.4: BOOT_UP}) == (
        "the bridge gave way without its NMT stop"
    )
