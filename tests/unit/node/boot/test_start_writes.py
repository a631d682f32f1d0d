"""Objects of ``[[slot.start]]``: brought to their values at boot-up, in order, only where they differ."""

from __future__ import annotations

import pytest

from bridge.canopen.pdo import MappingError
from bridge.node.boot.actions import BootResult
from bridge.node.boot.start_writes import write_start
from bridge.text import render
from tests.support import sites
from tests.support.answering import Answering
from tests.support.nodes import node_of

DS402 = "nord/sk-tu4-cao-ds402"
"""Its slot fu1 starts with P168[-01] = 1 (20A8h:01)."""
KEY = (0x20A8, 1)


def drive_of(mapping: str = DS402):
    return node_of(sites.drive("fu1", "lease", 200, ""), mapping=mapping).drives[0]


def test_what_differs_is_written_and_told() -> None:
    node, result = Answering({KEY: b"\0\0"}), BootResult()
    node.run(write_start(drive_of(), result))
    assert (*KEY, b"\1\0") in node.writes
    assert "fu1: 20A8:01 = 1" in map(render, result.notes)


def test_what_is_there_already_is_neither_written_nor_told() -> None:
    node, result = Answering({KEY: b"\1\0"}), BootResult()
    node.run(write_start(drive_of(), result))
    assert node.writes == []
    assert result.notes == []


def test_a_family_without_them_asks_nothing() -> None:
    node = Answering()
    node.run(write_start(drive_of(sites.FAMILY), BootResult()))
    assert node.reads == []


def test_a_refusal_is_the_drives_own_problem() -> None:
    node = Answering({KEY: b"\0\0"})
    node.refused = {KEY}
    with pytest.raises(MappingError, match=r"^J: .*20A8h:01"):
        node.run(write_start(drive_of(), BootResult()))
