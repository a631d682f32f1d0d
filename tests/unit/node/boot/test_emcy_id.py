"""Emergency messages on the identifier that the node itself names (1014h)."""

from __future__ import annotations

import json
import struct
from pathlib import Path

import pytest

from bridge.canopen.frame import Frame
from tests.support.quick import Quick, quick_site

EMERGENCY = bytes.fromhex("0010010000000000")


def booted(tmp_path: Path, value: int | None, nodes: int = 1) -> Quick:
    quick = Quick(quick_site(tmp_path, nodes))
    if value is not None:
        quick.nodes[1].objects[0x1014, 0] = struct.pack("<I", value)
    quick.run(3.0)
    assert quick.states() == "o" * nodes
    return quick


def heard(quick: Quick, cob_id: int) -> int:
    """How many emergencies of node 1 are known once one came on this identifier."""
    quick.receive(Frame(cob_id, EMERGENCY))
    quick.run(0.3)
    return len(json.loads(str(quick.value("n1/node/emcy_history"))))


@pytest.mark.parametrize(("value", "cob_id"), [(None, 0x81), (0x81, 0x81), (0xC1, 0xC1), (0x6A1, 0x6A1)])
def test_emergencies_are_taken_where_the_node_sends_them(
    tmp_path: Path, value: int | None, cob_id: int
) -> None:
    quick = booted(tmp_path, value)
    assert heard(quick, cob_id) == 1
    if cob_id != 0x81:
        assert f"emergency messages come on {cob_id:03X}h (1014h)" in quick.status(1)
        assert heard(quick, 0x81) == 1, "that is nobody's now"


def test_emergencies_that_are_off_are_told(tmp_path: Path) -> None:
    quick = booted(tmp_path, 0x8000_0081)
    assert "emergency messages are off (1014h, bit 31)" in quick.status(1)
    assert heard(quick, 0x81) == 0


@pytest.mark.parametrize("value", [0x80, 0x000, 0x701, 0x601, 0x2000_0081])
def test_an_identifier_for_something_else_is_not_used(tmp_path: Path, value: int) -> None:
    quick = booted(tmp_path, value)
    assert f"1014h is {value:08X}h: no identifier for emergency messages" in quick.status(1)
    assert heard(quick, 0x81) == 1


def test_an_identifier_of_another_node_stays_with_it(tmp_path: Path) -> None:
    quick = booted(tmp_path, 0x82, nodes=2)
    assert heard(quick, 0x82) == 0
    assert "another node has 082h, too" in quick.status(1)
    assert len(json.loads(str(quick.value("n2/node/emcy_history")))) == 1
