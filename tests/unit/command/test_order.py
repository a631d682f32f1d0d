"""Which positions a gate with a handshake still hands over: none that a stop or a fault came after."""

from __future__ import annotations

import pytest

from bridge.command.output import Gate
from bridge.drive import ControlWords, DriveState, Handshake
from bridge.mapping import load_family

MODEL = load_family("cia402/profile-position").control_word
WORDS = ControlWords(MODEL)
SHUTDOWN, DISABLE, RUN = 0x0006, 0x0007, 0x002F
NEW, TAKEN = 0x0010, 0x1000
PLACE, OTHER = (5000, 0), (7000, 0)


class Axis:
    """A gate, and a drive that says whatever the test lets it say."""

    def __init__(self) -> None:
        assert MODEL.handshake is not None
        self.gate = Gate(WORDS, 2, "stop", 0, handshake=Handshake(MODEL.handshake, (0, 1)))
        self.now = 0.0
        self.says(DriveState.READY)
        self.write(SHUTDOWN)

    def says(self, state: DriveState, bits: int = 0) -> None:
        self.gate.on_status_word(bits)
        self.gate.on_state(state)
        self.settle()

    def settle(self, *, may_enable: bool = True) -> None:
        self.gate.compute(self.now, may_enable=may_enable)

    def write(self, word: int | None = None, position: tuple[int, int] | None = None) -> None:
        self.gate.take(word, position or self.gate.setpoints, may_enable=True, position=position is not None)
        self.settle()

    def enable(self) -> None:
        self.write(RUN)
        self.says(DriveState.OPERATION_ENABLED)

    def wait(self, seconds: float) -> None:
        """Let the time pass, asked for as the master does."""
        end = self.now + seconds
        while (due := self.gate.next_deadline()) is not None and due <= end:
            self.now = due
            self.settle()
        self.now = end
        self.settle()

    @property
    def orders(self) -> bool:
        return bool(self.gate.sent.words[0] & NEW)


@pytest.fixture
def axis() -> Axis:
    return Axis()


def test_what_is_written_while_ready_is_gone_to(axis: Axis):
    axis.write(position=PLACE)
    axis.enable()
    assert axis.orders


@pytest.mark.parametrize("state", [DriveState.FAULT_REACTION_ACTIVE, DriveState.FAULT])
def test_a_fault_before_the_drive_was_enabled_forgets_it(axis: Axis, state: DriveState):
    axis.write(position=PLACE)
    axis.says(state)
    axis.says(DriveState.READY)
    axis.enable()
    assert not axis.orders


def test_a_fault_forgets_one_that_waits_for_the_acknowledge_bit_to_fall(axis: Axis):
    axis.write(RUN)
    axis.says(DriveState.OPERATION_ENABLED, TAKEN)
    axis.write(position=PLACE)
    axis.says(DriveState.FAULT)
    axis.says(DriveState.READY)
    axis.enable()
    assert not axis.orders


@pytest.mark.parametrize("word", [DISABLE, SHUTDOWN, 0x0002, 0x0000])
def test_every_control_word_that_does_not_enable_forgets_it(axis: Axis, word: int):
    axis.write(RUN)
    axis.says(DriveState.OPERATION_ENABLED, TAKEN)
    axis.write(position=PLACE)
    axis.write(word)
    axis.write(RUN)
    axis.says(DriveState.OPERATION_ENABLED)
    assert not axis.orders, "nobody has ordered it again"
    axis.write(position=PLACE)
    assert axis.orders


def test_a_telegram_that_stops_a_running_drive_orders_nothing(axis: Axis):
    axis.enable()
    axis.write(DISABLE, PLACE)
    axis.enable()
    assert not axis.orders
    axis.write(RUN, PLACE)
    assert axis.orders


def test_one_that_comes_to_a_drive_at_rest_does(axis: Axis):
    axis.write(position=OTHER)
    axis.write(SHUTDOWN, PLACE)
    axis.enable()
    assert axis.orders
    assert axis.gate.sent.words[1:] == PLACE


def test_leaving_operation_enabled_forgets_it(axis: Axis):
    axis.write(RUN)
    axis.says(DriveState.OPERATION_ENABLED, TAKEN)
    axis.write(position=PLACE)
    axis.says(DriveState.QUICK_STOP_ACTIVE)
    axis.says(DriveState.OPERATION_ENABLED)
    assert not axis.orders


def test_a_drive_that_may_not_be_enabled_forgets_it(axis: Axis):
    axis.write(position=PLACE)
    axis.settle(may_enable=False)
    axis.gate.interlocked = True
    axis.gate.lead(SHUTDOWN)
    axis.settle()
    axis.gate.lead(RUN)
    axis.says(DriveState.OPERATION_ENABLED)
    assert not axis.orders


def test_a_start_keeps_what_was_ordered_before(axis: Axis):
    axis.write(position=PLACE)
    axis.gate.lead(SHUTDOWN)
    axis.settle()
    axis.gate.lead(RUN)
    axis.says(DriveState.OPERATION_ENABLED)
    assert axis.orders


def test_one_that_the_drive_does_not_take_ends_after_a_second_and_is_told_once(axis: Axis):
    axis.enable()
    axis.write(position=PLACE)
    axis.wait(0.99)
    assert axis.orders
    assert not axis.gate.take_untaken()
    axis.wait(0.02)
    assert not axis.orders
    assert axis.gate.take_untaken()
    assert not axis.gate.take_untaken()
    axis.wait(5)
    assert not axis.orders


def test_the_next_one_has_an_edge_that_the_bus_sees(axis: Axis):
    axis.enable()
    axis.write(position=PLACE)
    axis.write(position=OTHER)
    axis.wait(1.05)
    assert not axis.orders, "low for longer than any cycle we send with"
    axis.wait(0.1)
    assert axis.orders
    assert axis.gate.sent.words[1:] == OTHER


def test_the_same_one_again_is_a_new_one_where_it_was_not_taken(axis: Axis):
    axis.enable()
    axis.write(position=PLACE)
    axis.wait(2)
    axis.write(position=PLACE)
    assert axis.orders


def test_one_that_is_taken_in_time_is_not_told(axis: Axis):
    axis.enable()
    axis.write(position=PLACE)
    axis.wait(0.5)
    axis.says(DriveState.OPERATION_ENABLED, TAKEN)
    axis.wait(5)
    assert not axis.gate.take_untaken()
