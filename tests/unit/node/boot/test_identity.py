"""Who a node is: what it says, what it does not say, and what is required of it."""

from __future__ import annotations

import struct
from pathlib import Path

import pytest

from bridge.base.errors import FileFaults
from bridge.command.drive_link import NodeState
from bridge.node.boot.error_status import HINTS
from bridge.text import render
from tests.support.quick import Quick, quick_site

IDENTITY = {
    (0x1018, 1): struct.pack("<I", 0x3B),
    (0x1018, 2): struct.pack("<I", 7),
    (0x1018, 3): struct.pack("<I", 0x0001_0002),
    (0x1018, 4): struct.pack("<I", 0xABCD_0005),
    (0x1008, 0): b"CU4",
    (0x100A, 0): b"V2.3",
}


def booted(tmp_path: Path, rule: str, *, without: tuple[int, int] | None = None) -> Quick:
    quick = Quick(quick_site(tmp_path, [f"[bus.node.identity]\n{rule}"]))
    quick.nodes[1].objects |= {at: data for at, data in IDENTITY.items() if at != without}
    quick.run(3.0)
    return quick


@pytest.mark.parametrize(
    "rule",
    [
        "vendor_id = 0x13B\nvendor_id_mask = 0xFF",
        "serial = 0xABCD0000\nserial_mask = 0xFFFF0000",
        'device_name = "^CU\\\\d$"',
        'device_name = "cu4"',
        'software_version = "^V2\\\\."',
    ],
)
def test_masks_and_patterns_let_pass_what_they_name(tmp_path: Path, rule: str) -> None:
    assert booted(tmp_path, rule).states() == "o"


@pytest.mark.parametrize(
    ("rule", "says"),
    [
        ("vendor_id = 0x13C\nvendor_id_mask = 0xFF", "D: 1018h:01 is 0000003Bh, expected 0000013Ch (mask"),
        ("serial = 0xABCE0000\nserial_mask = 0xFFFF0000", "O: 1018h:04 is ABCD0005h, expected ABCE0000h"),
        ('device_name = "TU4"', "M: 1008h is 'CU4', expected 'TU4' by the site file"),
        ('software_version = "^V3"', "N: 100Ah is 'V2.3', expected '^V3' by the site file"),
    ],
)
def test_what_does_not_fit_is_named(tmp_path: Path, rule: str, says: str) -> None:
    quick = booted(tmp_path, rule)
    assert quick.status(1).startswith(says)
    assert render(HINTS[says[0]]) in quick.status(1)
    assert quick.states() == "s"


@pytest.mark.parametrize("key", ["device_name", "software_version"])
def test_a_pattern_that_is_none_is_a_fault_of_the_file(tmp_path: Path, key: str) -> None:
    with pytest.raises(FileFaults, match="regular expression"):
        quick_site(tmp_path, [f'[bus.node.identity]\n{key} = "("'])


def test_an_object_that_the_node_does_not_have_is_not_called_zero(tmp_path: Path) -> None:
    quick = booted(tmp_path, "serial = 5", without=(0x1018, 4))
    assert quick.status(1).startswith("O: the node has no 1018h:04, expected 00000005h by the site file")


def test_a_name_that_the_node_does_not_have_is_said_so(tmp_path: Path) -> None:
    quick = booted(tmp_path, 'device_name = "CU4"', without=(0x1008, 0))
    assert quick.status(1).startswith("M: the node has no 1008h, expected 'CU4' by the site file")


@pytest.mark.parametrize("sub", [1, 2, 3, 4])
def test_a_silence_is_not_blamed_on_the_identity(tmp_path: Path, sub: int) -> None:
    key = ("vendor_id", "product_code", "revision", "serial")[sub - 1]
    quick = Quick(quick_site(tmp_path, [f"[bus.node.identity]\n{key} = 1"]))
    quick.lose = lambda frame: frame.can_id == 0x581 and frame.data[1:4] == bytes((0x18, 0x10, sub))
    quick.run(2.6)  # reset after the first attempt, it is asked a second time at once
    status = quick.status(1)
    assert status.startswith(f"{'DMNO'[sub - 1]}: the node does not answer: 1018h:0{sub}: no valid answer")
    assert render(HINTS["DMNO"[sub - 1]]) not in status
    assert f"needed by identity.{key}" in status
    assert "did the node restart" in status
    assert quick.core(1).state is NodeState.LOST


def test_a_lost_heartbeat_says_what_helps(tmp_path: Path) -> None:
    quick = Quick(quick_site(tmp_path, 1))
    quick.run(3.0)
    quick.nodes[1].present = False
    quick.run(0.5)
    assert quick.status(1) == f"E: lost: no heartbeat for 300 ms: {render(HINTS['E'])}"


def test_another_device_than_before_is_told(tmp_path: Path) -> None:
    """Nothing in the site file says which serial number the node has: it is served all the same."""
    quick = booted(tmp_path, "")
    node = quick.nodes[1]
    node.start(quick.now)
    quick.run(3.0)
    assert not [event for event in quick.events if "another device" in event.message]
    node.objects[0x1018, 4] = struct.pack("<I", 6)
    node.start(quick.now)
    quick.run(3.0)
    assert quick.states() == "o"
    [event] = [event for event in quick.events if "another device" in event.message]
    assert event.message.startswith(f"another device than before: serial number 6, was {0xABCD_0005}")
