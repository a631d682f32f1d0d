"""A node whose drives' stops are judged: the plant on a virtual clock, and what it tells and does."""

from __future__ import annotations

from bridge.command import Action, Event, Request, command_of
from bridge.command.audit import AuditEntry
from bridge.command.drive import Drive
from bridge.command.drive_link import NodeState
from bridge.command.node import Enforcement
from bridge.command.stop_check.state import LastStop
from bridge.image import Value
from tests.support import sites
from tests.support.leg_words import NORD_TU4, LegWords
from tests.support.node_states import hand_over, node_goes, run_timers
from tests.support.rig import PLC

BEGIN = 1024.0


class JudgedPlant:
    """``slots`` are the drives of the node ``conveyor``; the first is the one that is judged.

    ``deadline_s`` is that of its TPDO, None where it sends changes alone. What is to be sent goes to the bus
    at once.
    """

    def __init__(
        self,
        words: LegWords = NORD_TU4,
        *slots: str,
        deadline_s: float | None = 1 / 32,
        rpdo_type: int = 255,
        more: str = "",
        bus: str = "",
        timeout_ms: int = 0,
    ) -> None:
        names = slots or (sites.family(words.mapping).slot[0].name,)
        more += f"\n{sites.SCALED}" if words.mapping.startswith("nord") else ""
        drives = [sites.drive(name, "modbus", timeout_ms, more) for name in names]
        node = sites.node(*drives, mapping=words.mapping)
        self.words = words
        self.plant = sites.plant_of(sites.site(sites.bus(node, more=bus), sites.modbus()), words.mapping)
        self.now = BEGIN
        self.events: list[Event] = []
        self.entries: list[AuditEntry] = []
        self.enforced: list[Enforcement] = []
        self.plant.on_event(self.events.append)
        self.plant.audit.tell_to(self.entries.append)
        self.drive: Drive = self.plant.drives[f"conveyor/{names[0]}"]
        self.drive.on_pdos({}, [], self.now, deadline_s=deadline_s, rpdo_type=rpdo_type)
        self.node(NodeState.BOOTING)
        self.node(NodeState.OPERATIONAL)

    def node(self, state: NodeState) -> None:
        node_goes(self.plant, self.plant.nodes["conveyor"], state, self.now)
        self._settle()

    def is_cut_off(self) -> None:
        """The bridge takes the node out of operation; nothing more is heard of its drives."""
        self.drive.on_cut_off(self.now)
        self.node(NodeState.STOPPED)

    def restarts(self) -> None:
        """The node, by itself or by command."""
        self.drive.stop_check.on_restart()
        self.node(NodeState.BOOTING)
        self.node(NodeState.OPERATIONAL)

    def _settle(self) -> None:
        if self.drive.stop_check.awaits_sending:
            hand_over(self.plant, self.drive, self.now)

    # the drive

    def says(self, status_word: int) -> None:
        """A TPDO, the same as the last one or another."""
        words = [status_word, *self.drive.words[1:]]
        if words == self.drive.words:
            self.drive.on_unchanged_data(self.now)
        else:
            self.drive.on_process_data(words, self.now)
        self.looks()

    def goes_on(self, until_s: float, every_s: float = 1 / 32) -> None:
        """Send what the drive said last until so many seconds after the begin, with one TPDO then."""
        while self.now + every_s < BEGIN + until_s:
            self.now += every_s
            self.says(self.drive.words[0])
        self.now = BEGIN + until_s
        self.says(self.drive.words[0])

    def is_silent(self, until_s: float) -> None:
        """Send nothing; the plant is called whenever it asked for it."""
        end = BEGIN + until_s
        while (due := self.plant.next_deadline(self.now)) is not None and due <= end:
            self.now = max(due, self.now)
            self.looks()
        self.now = end
        self.looks()

    def looks(self) -> None:
        self.enforced += run_timers(self.plant, self.now)
        self._settle()

    # its owner

    def writes(self, control_word: int) -> None:
        self.asks(Action.WRITE, values={"control_word": control_word})

    def asks(self, action: Action, **more: object) -> None:
        request = Request(PLC, self.drive.name, command_of(action, **more))
        self.plant.submit(request, self.now, lambda outcome: None)
        self._settle()

    def enables(self) -> JudgedPlant:
        self.says(self.words.ready)
        self.writes(self.words.shut_down)
        self.says(self.words.ready)
        self.writes(self.words.enable)
        self.says(self.words.enabled)
        assert self.last_stop is LastStop.NONE
        self.events.clear()
        self.entries.clear()
        return self

    # what came of it

    def value(self, leaf: str) -> Value:
        image = self.plant.image
        return image[image.index[f"{self.drive.name}/{leaf}"]].value

    @property
    def last_stop(self) -> LastStop:
        return self.drive.stop_check.last_stop

    @property
    def told(self) -> list[tuple[int, str]]:
        return [(event.severity, event.message) for event in self.events if event.source == self.drive.name]

    @property
    def endings(self) -> list[tuple[str, str]]:
        """Endings of stops by the audit log."""
        ended = [entry for entry in self.entries if entry.action == "stop_ended"]
        return [(entry.ending.code, entry.ending.message) for entry in ended]
