"""A drive whose position comes in another TPDO than its status word is not enabled before it has come."""

from __future__ import annotations

import pytest

from bridge.command import Action, Code, Outcome, Request, command_of
from bridge.command.drive_link import FurtherTpdo, NodeState
from bridge.image import Value
from tests.support import sites
from tests.support.node_states import node_goes
from tests.support.rig import PLC

CSP = "cia402/cyclic-position"
SITE = sites.site(
    sites.bus(sites.node(sites.drive("drive", "modbus", 10_000, ""), name="axis", mapping=CSP)),
    sites.modbus(),
)
SHUTDOWN, DISABLE, RUN = 0x0006, 0x0007, 0x000F
READY, ENABLED = 0x0231, 0x0237


class Axis:
    """The position, words 1 and 2, comes by TPDO2 every 100 ms."""

    def __init__(self) -> None:
        self.plant = sites.plant_of(SITE, CSP)
        self.drive = self.plant.drives["axis/drive"]
        self.now = 100.0
        self.boot()

    def boot(self) -> None:
        self.tpdo2 = FurtherTpdo("TPDO2", frozenset((1, 2)), 0.1)
        self.drive.on_pdos({}, [self.tpdo2], self.now, deadline_s=None, rpdo_type=255)
        node = self.plant.nodes["axis"]
        node_goes(self.plant, node, NodeState.BOOTING, self.now)
        node_goes(self.plant, node, NodeState.OPERATIONAL, self.now)

    def says(self, status_word: int) -> None:
        words = list(self.drive.words)
        words[0] = status_word
        self.drive.on_process_data(words, self.now)

    def stands(self, position: int) -> None:
        self.drive.words[1:3] = [position, 0]
        self.drive.on_further_data(self.tpdo2, self.now)

    def submit(self, action: Action, **values: Value) -> Outcome:
        outcomes: list[Outcome] = []
        command = command_of(action, **({"values": values} if values else {}))
        self.plant.submit(Request(PLC, "axis/drive", command), self.now, outcomes.append)
        return outcomes[0] if outcomes else Outcome(Code.OK, "not told yet")

    def write(self, word: int) -> Outcome:
        return self.submit(Action.WRITE, control_word=word)

    @property
    def sent(self) -> tuple[int, ...]:
        return self.drive.channel.output.words


@pytest.fixture
def axis() -> Axis:
    axis = Axis()
    axis.says(READY)
    return axis


def test_a_control_word_enables_nothing_before_the_position_has_come(axis: Axis):
    axis.write(SHUTDOWN)
    outcome = axis.write(RUN)
    assert not outcome.forwarded
    assert outcome.message == "the drive's own position is not known: no TPDO2 from the drive"
    assert axis.sent[0] & 0x000F != RUN
    axis.stands(4711)
    assert axis.sent[0] & 0x000F != RUN, "it is enabled by a fresh word only"
    axis.write(SHUTDOWN)
    assert axis.write(RUN).forwarded
    assert axis.sent == (RUN, 4711, 0)


def test_a_start_is_refused_and_says_why(axis: Axis):
    outcome = axis.submit(Action.START)
    assert (outcome.code, outcome.message) == (
        Code.NOT_READY,
        "the drive's own position is not known: no TPDO2 from the drive",
    )
    axis.stands(4711)
    assert axis.submit(Action.START).ok
    axis.says(READY)
    assert axis.sent == (RUN, 4711, 0)


def test_nothing_is_enabled_while_it_is_late(axis: Axis):
    axis.stands(4711)
    axis.now += 0.11
    axis.says(READY)
    axis.write(SHUTDOWN)
    assert not axis.write(RUN).forwarded
    assert axis.submit(Action.START).code is Code.NOT_READY


def test_a_boot_up_asks_for_it_anew(axis: Axis):
    axis.stands(4711)
    axis.now += 0.01
    axis.boot()
    axis.says(READY)
    assert axis.submit(Action.START).code is Code.NOT_READY


def test_nothing_is_enabled_before_the_status_word_has_come():
    axis = Axis()
    axis.stands(4711)
    assert axis.submit(Action.START).code is Code.NOT_READY


def test_an_enabled_drive_is_not_stopped_when_it_is_late(axis: Axis):
    axis.stands(4711)
    axis.submit(Action.START)
    axis.says(READY)
    axis.says(ENABLED)
    axis.now += 0.2
    axis.says(ENABLED)
    axis.submit(Action.WRITE, position=4800)
    assert axis.sent == (RUN, 4800, 0)
    axis.write(DISABLE)
    assert not axis.write(RUN).forwarded, "stopped, it has to know again"
