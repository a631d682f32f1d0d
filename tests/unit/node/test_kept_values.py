"""What a node does not keep is not written for ever: its memory has a limited number of writes."""

from __future__ import annotations

import struct
from collections.abc import Callable
from pathlib import Path

import pytest

from bridge.command import Action
from bridge.command.drive_link import NodeState
from tests.support.quick import ENGINEER, Quick, QuickNode, quick_site

CONFIGURE = '[[bus.node.configure]]\nobject = "2097:01"\ntype = "uint16"\nvalue = 500'
STORE = f"configuration_store = true\n{CONFIGURE}"
SAVE = (0x1010, 1, b"save")
_CANNOT_STORE = 0x0800_0020


class Rounding(QuickNode):
    """Keeps what ``kept`` makes of a written value."""

    def __init__(self, node_id: int, index: int, kept: Callable[[int], int]) -> None:
        super().__init__(node_id)
        self.index, self.kept = index, kept

    def _on_sdo(self, data: bytes, now: float) -> None:
        super()._on_sdo(data, now)
        for at, value in self.objects.items():
            if at[0] == self.index:
                number = self.kept(int.from_bytes(value, "little"))
                self.objects[at] = number.to_bytes(len(value), "little")


class Storing(QuickNode):
    """Answers "save" after ``save_s``, or refuses it."""

    def __init__(self, node_id: int, *, save_s: float = 0.0) -> None:
        super().__init__(node_id)
        self.save_s = save_s
        self.refuses_store = False
        self.saved = 0

    def _on_sdo(self, data: bytes, now: float) -> None:
        command, index, sub = struct.unpack_from("<BHB", data)
        if index != 0x1010 or command == 0x40:
            super()._on_sdo(data, now)
            return
        if command == 0x80:
            return
        self.writes.append((index, sub, data[4:]))
        if self.refuses_store:
            self._abort(index, sub, _CANNOT_STORE)
            return
        self.saved += 1
        self.delay_s = self.save_s
        self._answer(b"\x60" + data[1:4] + bytes(4))
        self.delay_s = 0.0


def quick_with(tmp_path: Path, node: QuickNode, keys: str) -> Quick:
    quick = Quick(quick_site(tmp_path, [keys]))
    quick.nodes[1] = node
    return quick


def writes(quick: Quick, *indices: int) -> list[tuple[int, int, bytes]]:
    return [write for write in quick.nodes[1].writes if write[0] in indices]


# configuration


@pytest.mark.landing
def test_a_value_that_is_not_kept_is_written_once_in_an_hour(tmp_path: Path) -> None:
    quick = quick_with(tmp_path, Rounding(1, 0x2097, lambda value: min(value, 495)), CONFIGURE)
    quick.run(3600.0)
    assert len(writes(quick, 0x2097)) == 1
    assert "J: 2097h:01 is 01EFh after 01F4h was written" in quick.status(1)
    assert "not written again" in quick.status(1)
    assert quick.core(1).state is NodeState.CONFIG_ERROR


@pytest.mark.landing
def test_a_node_that_cannot_be_used_is_asked_every_five_minutes_in_the_end(tmp_path: Path) -> None:
    quick = quick_with(tmp_path, Rounding(1, 0x2097, lambda value: min(value, 495)), CONFIGURE)
    quick.run(1800.0)
    since = quick.now
    quick.run(3600.0)
    asked = [frame for frame in quick.log if frame.can_id == 0x601 and frame.time > since]
    boots = [frame for frame in asked if frame.data[:4] == b"\x40\x00\x10\x00"]
    assert 11 <= len(boots) <= 13
    assert len(quick.told("boot-up failed")) <= 2


@pytest.mark.parametrize("how", ["boot-up", "reset"])
def test_it_is_written_again_after_a_boot_up_message_or_an_operators_reset(tmp_path: Path, how: str) -> None:
    quick = quick_with(tmp_path, Rounding(1, 0x2097, lambda value: min(value, 495)), CONFIGURE)
    quick.run(60.0)
    node = quick.nodes[1]
    assert isinstance(node, Rounding)
    node.kept = lambda value: value
    if how == "boot-up":
        node.start(quick.now)
    else:
        assert quick.ask(Action.RESET, "n1", ENGINEER).ok
    quick.run(3.0)
    assert quick.states() == "o"
    assert len(writes(quick, 0x2097)) == 2


def test_what_somebody_else_has_set_right_is_taken_without_a_write(tmp_path: Path) -> None:
    quick = quick_with(tmp_path, Rounding(1, 0x2097, lambda value: min(value, 495)), CONFIGURE)
    quick.run(5.0)
    node = quick.nodes[1]
    assert isinstance(node, Rounding)
    node.kept = lambda value: value
    node.objects[0x2097, 1] = struct.pack("<H", 500)
    quick.run(301.0)
    assert quick.states() == "o"
    assert len(writes(quick, 0x2097)) == 1


# PDOs


def test_an_inhibit_time_that_is_rounded_is_written_once(tmp_path: Path) -> None:
    """A node that keeps whole milliseconds."""
    keys = '[[bus.node.drive]]\nslot = "fu2"\ntpdo = { inhibit_ms = 10.5 }'
    quick = quick_with(tmp_path, Rounding(1, 0x1801, lambda value: value), keys)
    node = quick.nodes[1]
    assert isinstance(node, Rounding)
    node.objects |= {(0x1801, 1): struct.pack("<I", 0x4000_0281), (0x1801, 3): bytes(2)}
    node.kept = lambda value: value // 10 * 10 if value < 0x1000 else value
    quick.run(3.0)
    for _ in range(20):
        quick.ask(Action.ENTER_PRE_OPERATIONAL, "n1")
        quick.ask(Action.START_NODE, "n1")
        quick.run(3.0)
        assert quick.states() == "o", "the other drive works"
    assert len([write for write in writes(quick, 0x1801) if write[1] == 3]) == 1
    assert "1801h:03 is 64h after 69h was written" in quick.status(1)


# store


def test_a_refused_store_is_tried_again_and_told_until_it_succeeds(tmp_path: Path) -> None:
    node = Storing(1)
    node.refuses_store = True
    node.objects |= {(0x1020, 1): bytes(4), (0x1020, 2): bytes(4)}
    quick = quick_with(tmp_path, node, STORE)
    quick.run(120.0)
    assert quick.status(1).startswith("J: 1010h:01: the node aborted")
    assert quick.states() == "s"
    assert 3 <= len(writes(quick, 0x1010)) <= 10
    assert len(writes(quick, 0x2097)) == 1
    node.refuses_store = False
    quick.run(301.0)
    assert quick.states() == "o"
    assert node.saved == 1


def test_a_bridge_that_starts_anew_does_not_take_an_unstored_configuration_for_stored(tmp_path: Path) -> None:
    """1020h goes back to zero where the store has failed."""
    node = Storing(1)
    node.refuses_store = True
    node.objects |= {(0x1020, 1): bytes(4), (0x1020, 2): bytes(4)}
    quick_with(tmp_path, node, STORE).run(3.0)
    assert not any(node.objects[0x1020, 1])
    node.refuses_store = False
    again = quick_with(tmp_path, node, STORE)
    again.run(3.0)
    assert again.states() == "o"
    assert node.saved == 1
    assert any(node.objects[0x1020, 1])


def test_a_node_without_1020h_owes_its_store_too(tmp_path: Path) -> None:
    node = Storing(1)
    node.refuses_store = True
    quick = quick_with(tmp_path, node, STORE)
    quick.run(20.0)
    assert quick.status(1).startswith("J: 1010h:01")
    node.refuses_store = False
    quick.run(301.0)
    assert quick.states() == "o"
    assert node.saved == 1


def test_a_store_may_take_ten_seconds(tmp_path: Path) -> None:
    quick = quick_with(tmp_path, Storing(1, save_s=9.0), STORE)
    quick.run(11.0)
    assert quick.states() == "o"
    assert writes(quick, 0x1010) == [SAVE]


@pytest.mark.landing
def test_a_store_without_an_answer_does_not_wear_out_the_node(tmp_path: Path) -> None:
    node = Storing(1, save_s=11.0)
    quick = quick_with(tmp_path, node, STORE)
    quick.run(3600.0)
    assert quick.status(1).startswith("J: ")
    assert 1 <= node.saved <= 3


def test_a_store_among_the_objects_is_done_once_while_the_boot_up_fails(tmp_path: Path) -> None:
    keys = '[[bus.node.configure]]\nobject = "1010:01"\ntype = "uint32"\nvalue = 0x65766173\nread_back = {}'
    node = Storing(1)
    node.objects[0x1010, 1] = b"\1\0\0\0"
    quick = quick_with(tmp_path, node, keys.format("false") + "\n" + CONFIGURE.replace("2097", "2FFF"))
    node.objects[0x2FFF, 1] = bytes(2)
    node.__class__ = type("Odd", (Storing,), {"_on_sdo": _forgets(0x2FFF)})
    quick.run(600.0)
    assert quick.core(1).state is NodeState.CONFIG_ERROR
    assert node.saved == 1


def _forgets(index: int) -> Callable[[Storing, bytes, float], None]:
    def on_sdo(node: Storing, data: bytes, now: float) -> None:
        Storing._on_sdo(node, data, now)
        if (index, 1) in node.objects:
            node.objects[index, 1] = bytes(2)

    return on_sdo


def test_a_store_that_is_to_be_read_back_is_written_once(tmp_path: Path) -> None:
    keys = '[[bus.node.configure]]\nobject = "1010:01"\ntype = "uint32"\nvalue = 0x65766173'
    node = Storing(1)
    node.objects[0x1010, 1] = b"\1\0\0\0"
    quick = quick_with(tmp_path, node, keys)
    quick.run(600.0)
    assert node.saved == 1
    assert quick.core(1).state is NodeState.CONFIG_ERROR
