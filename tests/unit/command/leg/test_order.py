"""Which positions a drive with a handshake is still handed: none that a stop or a fault came after."""

from __future__ import annotations

import pytest

from bridge.command import Action, Start
from bridge.command.leg.event import NodeBack, Time
from bridge.drive import DriveState
from bridge.mapping import load_family
from tests.support.leg import OPEN, SHUT, Leg, settings_of, told

FAMILY = "cia402/profile-position"
SHUTDOWN, DISABLE, RUN = 0x0006, 0x0007, 0x002F
NEW, TAKEN = 0x0010, True
PLACE, OTHER = 5000, 7000


class Axis(Leg):
    """A drive that says whatever the test lets it say."""

    def __init__(self) -> None:
        super().__init__(settings_of(FAMILY, on_expiry="stop"))
        self.says(DriveState.READY)
        self.writes(SHUTDOWN)

    def write(self, word: int | None = None, position: int | None = None) -> None:
        self.writes(word, **({} if position is None else {"position": position}))

    def enable(self) -> None:
        self.writes(RUN)
        self.says(DriveState.OPERATION_ENABLED)

    @property
    def orders(self) -> bool:
        return bool(self.sent & NEW)


def test_the_bits_are_those_of_the_mapping() -> None:
    model = load_family(FAMILY).control_word.handshake
    assert model is not None
    assert (1 << model.bit, 1 << model.acknowledge_bit) == (NEW, 0x1000)


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
    axis.says(DriveState.OPERATION_ENABLED, is_acknowledged=TAKEN)
    axis.write(position=PLACE)
    axis.says(DriveState.FAULT)
    axis.says(DriveState.READY)
    axis.enable()
    assert not axis.orders


@pytest.mark.parametrize("word", [DISABLE, SHUTDOWN, 0x0002, 0x0000])
def test_every_control_word_that_does_not_enable_forgets_it(axis: Axis, word: int):
    axis.write(RUN)
    axis.says(DriveState.OPERATION_ENABLED, is_acknowledged=TAKEN)
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
    assert axis.setpoints == (PLACE, 0)


def test_leaving_operation_enabled_forgets_it(axis: Axis):
    axis.write(RUN)
    axis.says(DriveState.OPERATION_ENABLED, is_acknowledged=TAKEN)
    axis.write(position=PLACE)
    axis.says(DriveState.QUICK_STOP_ACTIVE)
    axis.says(DriveState.OPERATION_ENABLED)
    assert not axis.orders


def test_a_drive_that_may_not_be_enabled_forgets_it(axis: Axis):
    axis.write(position=PLACE)
    axis.happens(SHUT)
    axis.happens(OPEN)
    axis.asks(Start())
    axis.says(DriveState.OPERATION_ENABLED)
    assert axis.enables
    assert not axis.orders


def test_a_start_keeps_what_was_ordered_before(axis: Axis):
    axis.write(position=PLACE)
    axis.asks(Start())
    axis.says(DriveState.OPERATION_ENABLED)
    assert axis.orders


def test_the_first_start_goes_to_no_position_that_nobody_has_ordered() -> None:
    leg = Leg(settings_of(FAMILY))
    leg.says(DriveState.READY)
    leg.asks(Start())
    leg.says(DriveState.OPERATION_ENABLED)
    assert leg.enables
    assert not leg.sent & NEW


def test_one_that_the_drive_does_not_take_ends_after_a_second_and_is_told_once(axis: Axis):
    axis.enable()
    axis.write(position=PLACE)
    assert not told(axis.waits(0.99))
    assert axis.orders
    assert told(axis.waits(0.02)) == [
        "the drive has not taken the position that was written: no answer within 1 s"
    ]
    assert not axis.orders
    assert not told(axis.waits(5))
    assert not axis.orders


def test_the_next_one_has_an_edge_that_the_bus_sees(axis: Axis):
    axis.enable()
    axis.write(position=PLACE)
    axis.write(position=OTHER)
    axis.waits(1.05)
    assert not axis.orders, "low for longer than any cycle we send with"
    axis.waits(0.1)
    assert axis.orders
    assert axis.setpoints == (OTHER, 0)


def test_the_same_one_again_is_a_new_one_where_it_was_not_taken(axis: Axis):
    axis.enable()
    axis.write(position=PLACE)
    axis.waits(2)
    axis.write(position=PLACE)
    assert axis.orders


def test_one_that_is_taken_in_time_is_not_told(axis: Axis):
    axis.enable()
    axis.write(position=PLACE)
    axis.waits(0.5)
    axis.says(DriveState.OPERATION_ENABLED, is_acknowledged=TAKEN)
    assert not told(axis.waits(5))


@pytest.mark.parametrize("way", ["stop", "release", "restart"])
def test_the_place_where_the_drive_was_before_a_stop_can_be_ordered_again(axis: Axis, way: str):
    axis.enable()
    axis.write(position=PLACE)
    axis.says(DriveState.OPERATION_ENABLED, is_acknowledged=TAKEN)
    axis.says(DriveState.OPERATION_ENABLED)
    axis.write(position=PLACE)
    assert not axis.orders, "it is there, or on its way"
    if way == "restart":
        axis.restarts()
    else:
        axis.asks(Action.STOP if way == "stop" else Action.RELEASE_CONTROL)
    axis.asks(Start())
    axis.says(DriveState.READY)
    axis.enable()
    assert not axis.orders
    axis.write(position=PLACE)
    assert axis.orders


def test_one_that_waits_behind_another_that_is_not_taken_is_forgotten_with_the_node(axis: Axis):
    axis.enable()
    axis.write(position=PLACE)
    axis.write(position=OTHER)
    axis.now += 1.0
    axis.happens(Time())
    assert not axis.orders
    axis.happens(NodeBack())
    axis.asks(Start())
    axis.waits(0.5)
    axis.says(DriveState.OPERATION_ENABLED)
    assert axis.enables
    assert not axis.orders


@pytest.mark.parametrize("with_word", [True, False])
def test_what_was_said_before_the_node_restarted_raises_no_bit(axis: Axis, with_word: bool):
    """The drive is not enabled any more, though it has not said so yet."""
    axis.enable()
    axis.restarts()
    axis.write(SHUTDOWN, PLACE if with_word else None)
    axis.write(RUN, None if with_word else PLACE)
    assert not axis.orders
    axis.says(DriveState.READY)
    axis.says(DriveState.OPERATION_ENABLED)
    assert axis.orders
    assert axis.setpoints == (PLACE, 0)


def test_what_is_held_after_a_trip_gets_no_new_position_and_nobody_is_told_that_it_was_not_taken() -> None:
    leg = Leg(settings_of(FAMILY, on_expiry="hold", fieldbus_timeout_ms=1000))
    leg.says(DriveState.READY)
    leg.writes(SHUTDOWN)
    leg.writes(RUN)
    leg.says(DriveState.OPERATION_ENABLED)
    leg.trips()
    leg.writes(RUN, position=PLACE)
    assert not leg.outcome.forwarded
    assert not told(leg.waits(2.0))
    assert not leg.sent & NEW
