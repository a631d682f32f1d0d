"""Points of a node's state and boot-up, and the events about the node."""

from __future__ import annotations

from collections.abc import Sequence

from bridge.canopen.nmt import NmtState
from bridge.catalogue.codes import NODE_CODES
from bridge.command import BusSide, Event, EventKind, Identification
from bridge.command.drive_link import NodeState
from bridge.command.node import Node
from bridge.node.backoff import BackOff
from bridge.node.boot import BootError
from bridge.node.bootloop import BootLoop
from bridge.text import Said, Text


class NodeView:
    def __init__(self, node: Node, side: BusSide) -> None:
        self._node = node
        self._image = side.image
        self._events = side.events
        self._top = f"{node.name}/node"
        self._failure: tuple[str, Text] | None = None
        self._success: Said = ""
        self._errors: Said = ""
        self._identification: Identification | None = None

    def say(self, said: Text, now: float) -> None:
        """Show a step or the result of the boot-up."""
        self._say("boot_status", said, now)

    def _say(self, leaf: str, said: Said, now: float) -> None:
        self._image.say(self._image.index[f"{self._top}/{leaf}"], said, now)

    def is_in(self, state: NodeState, now: float) -> None:
        """Show the state in which the master has the node."""
        self._image.put(f"{self._top}/state", NODE_CODES[state], now)

    def went(self, state: NodeState, now: float) -> None:
        """Report a node that is lost, or in operation again."""
        if state is NodeState.LOST:
            self._tell(EventKind.NODE_LOST, 800, Text.of("node.lost"), now)
        elif state is NodeState.OPERATIONAL:
            self._tell(EventKind.NODE_BACK, 200, Text.of("node.operational"), now)

    def show(self, nmt_state: NmtState, state: NodeState, toggle_errors: int, now: float) -> None:
        self._image.put(f"{self._top}/nmt_state", int(nmt_state), now)
        self._say("supervision_state", self._supervision(state, toggle_errors), now)

    def _supervision(self, state: NodeState, toggle_errors: int) -> Text:
        kind, shown = (
            Text.word("supervision", self._node.table.supervision),
            Text.word("node_state", state.value),
        )
        if not toggle_errors:
            return Text.of("node.supervised", supervision=kind, state=shown)
        if toggle_errors == 1:
            return Text.of("node.supervised_one_toggle", supervision=kind, state=shown)
        return Text.of("node.supervised_toggles", supervision=kind, state=shown, count=toggle_errors)

    def succeeded(self, said: Text, now: float) -> None:
        self._failure, self._success = None, said
        self.say(said, now)

    def failed(self, error: BootError, now: float) -> None:
        """Show a failed boot-up; each kind of failure is an event once until a boot-up succeeds."""
        self.say(error.said, now)
        failure = error.letter, error.what
        if self._failure != failure:
            self._failure = failure
            said = Text.of("node.boot_failed", error=error.said)
            self._tell(EventKind.CONFIGURATION, 600, said, now)

    def errors(self, said: Said, now: float) -> None:
        """Show the errors that the node reports, empty if it has none; new ones are an event."""
        self._say("device_errors", said, now)
        if said and said != self._errors:
            self._tell(EventKind.EMERGENCY, 300, Text.of("node.says", errors=said), now)
        self._errors = said

    def shows_habits(self, news: Sequence[Text], habits: Sequence[Text], now: float) -> None:
        """Report ``news``, habits of the node in operation that were not reported yet, and show ``habits``,
        all of them."""
        for said in news:
            self._tell(EventKind.CONFIGURATION, 300, said, now)
        self.say(Text.of("boot.noted", outcome=self._success, notes=tuple(habits)), now)

    def identified(self, found: Identification, now: float) -> bool:
        """Note the identity that a successful boot-up has found. True, and an event, if it is another device
        than before."""
        before, self._identification = self._identification, found
        if before is None:
            return False
        changes = _changes(before, found)
        if changes:
            self._tell(EventKind.CONFIGURATION, 600, Text.of("node.other_device", changes=changes), now)
        return bool(changes)

    def resets(self, why: Text, now: float) -> None:
        said = Text.of("node.reset_communication", why=why)
        self._tell(EventKind.CONFIGURATION, 500, said, now)

    def restarted(self, now: float) -> None:
        self._tell(EventKind.NODE_LOST, 800, Text.of("node.restarted"), now)

    def loops(self, loop: BootLoop, now: float) -> None:
        """Report a boot loop, at most once a minute."""
        told = loop.report(now)
        if told:
            self._tell(EventKind.CONFIGURATION, 600, told, now)

    def flaps(self, back_off: BackOff, now: float) -> None:
        """Report a node that is lost soon after each boot-up, at most once a minute."""
        told = back_off.report(now)
        if told:
            self._tell(EventKind.NODE_LOST, 800, told, now)

    def stays(self, now: float) -> None:
        self._tell(EventKind.NODE_BACK, 200, Text.of("node.stays"), now)

    def _tell(self, kind: EventKind, severity: int, said: Text, now: float) -> None:
        self._events.report(Event(now, kind, self._node.name, severity, said))


def _changes(before: Identification, found: Identification) -> tuple[Text, ...]:
    told: list[Text] = []
    if found.vendor != before.vendor:
        told.append(Text.of("node.other_vendor", now=found.vendor, before=before.vendor))
    if found.product != before.product:
        told.append(Text.of("node.other_product", now=found.product, before=before.product))
    if found.revision != before.revision:
        told.append(Text.of("node.other_revision", now=found.revision, before=before.revision))
    if found.serial != before.serial:
        told.append(Text.of("node.other_serial", now=found.serial, before=before.serial))
    return tuple(told)
