"""The present and the last fault of a drive: its own, as it was asked for them, and the bridge's."""

from __future__ import annotations

from bridge.command.drive_link import NodeState
from tests.support.rig import FAULT, Rig, emergency

OVERCURRENT, OVERTEMPERATURE = 3.0, 1.0


class Asked:
    """A drive that has been asked for its faults. ``now_and_last`` is what it shows then."""

    def __init__(self) -> None:
        self.rig = Rig()
        self.rig.run()

    def tells(self, current: float | None = None, last: float | None = None) -> tuple[float, float]:
        self.rig.channel.on_drive_fault(current, last, self.rig.now)
        return self.now_and_last

    @property
    def now_and_last(self) -> tuple[float, float]:
        return self.rig.channel.current_fault, self.rig.channel.last_fault


def test_before_anything_was_told_there_is_none() -> None:
    channel = Rig().channel
    assert (channel.current_fault, channel.last_fault, channel.fault_text) == (0.0, 0.0, "")
    assert (channel.drive_status_word, channel.emcy_code) == (0, 0)


def test_a_present_fault_becomes_the_last_one_and_stays_so() -> None:
    drive = Asked()
    assert drive.tells(current=OVERCURRENT) == (3.0, 3.0)
    assert drive.tells(current=0.0) == (0.0, 3.0)
    assert drive.tells(current=OVERTEMPERATURE) == (1.0, 1.0)
    assert drive.tells() == (1.0, 1.0), "it did not tell any"


def test_the_drives_last_fault_counts_when_it_is_new_to_us() -> None:
    drive = Asked()
    assert drive.tells(last=OVERTEMPERATURE) == (0.0, 1.0)
    assert drive.tells(last=0.0) == (0.0, 1.0)
    assert drive.tells(last=OVERCURRENT) == (0.0, 3.0)


def test_of_what_the_bridge_and_the_drive_tell_the_newest_counts() -> None:
    """A drive that is asked again and again tells the same again and again: that is no news."""
    drive = Asked()
    drive.tells(current=OVERCURRENT, last=OVERTEMPERATURE)
    assert drive.now_and_last == (3.0, 1.0)
    drive.rig.node(NodeState.LOST)
    node_missing = drive.rig.channel.last_fault
    assert node_missing not in (OVERCURRENT, OVERTEMPERATURE)
    drive.rig.node(NodeState.OPERATIONAL)
    assert drive.tells(current=OVERCURRENT, last=OVERTEMPERATURE) == (3.0, node_missing)


def test_a_drive_that_has_said_that_its_fault_is_gone_has_no_text_of_it() -> None:
    rig = Rig()
    rig.run()
    rig.channel.on_emcy(emergency(0x2310), rig.now)
    rig.drive_says(FAULT)
    assert (rig.channel.emcy_code, rig.channel.fault_text) == (0x2310, emergency(0x2310).text)
    rig.channel.on_emcy(emergency(0), rig.now)
    assert (rig.channel.emcy_code, rig.channel.fault_text) == (0, "fault")
