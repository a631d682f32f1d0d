"""How a node is shown: its points of state and boot-up, and the events about it."""

from __future__ import annotations

from collections.abc import Sequence

from bridge.canopen.nmt import NmtState
from bridge.command import Event, Identification, Kind, Plant
from bridge.command.link import NodeState
from bridge.command.node import Node
from bridge.node.backoff import BackOff
from bridge.node.boot import BootError
from bridge.node.bootloop import BootLoop


class NodeView:
    def __init__(self, node: Node, plant: Plant) -> None:
        self._node = node
        self._plant = plant
        self._top = f"{node.name}/node"
        self._failure: tuple[str, str] | None = None
        self._success = ""
        self._errors = ""
        self._identification: Identification | None = None

    def say(self, text: str, now: float) -> None:
        """Step or result of the boot-up."""
        self._plant.set(f"{self._top}/boot_status", text, now)

    def show(self, nmt_state: NmtState, state: NodeState, toggle_errors: int, now: float) -> None:
        self._plant.set(f"{self._top}/nmt_state", int(nmt_state), now)
        text = f"{self._node.table.supervision}: {state.value}"
        if toggle_errors:
            text += f", {toggle_errors} wrong toggle bit{'s' if toggle_errors > 1 else ''}"
        self._plant.set(f"{self._top}/supervision_state", text, now)

    def succeeded(self, text: str, now: float) -> None:
        self._failure, self._success = None, text
        self.say(text, now)

    def failed(self, error: BootError, now: float) -> None:
        """The boot-up has failed; each way of failing is an event once until it succeeds."""
        self.say(str(error), now)
        failure = error.letter, error.detail
        if self._failure != failure:
            self._failure = failure
            self._tell(Kind.CONFIGURATION, 600, f"boot-up failed: {error}", now)

    def errors(self, text: str, now: float) -> None:
        """What the node says of its errors, empty where it has none; an event when it is something else."""
        self._plant.set(f"{self._top}/device_errors", text, now)
        if text and text != self._errors:
            self._tell(Kind.EMERGENCY, 300, f"the node says: {text}", now)
        self._errors = text

    def shows_habits(self, news: Sequence[str], habits: Sequence[str], now: float) -> None:
        """``news`` are habits of the node in operation that are to be told, ``habits`` all of them."""
        for text in news:
            self._tell(Kind.CONFIGURATION, 300, text, now)
        self.say("; ".join([self._success, *habits]), now)

    def identified(self, found: Identification, now: float) -> bool:
        """Who the node is, by a boot-up that has succeeded. True where that is somebody else than before,
        which is an event."""
        before, self._identification = self._identification, found
        if before is None:
            return False
        told = [
            f"{name} {getattr(found, name):08X}h, was {getattr(before, name):08X}h"
            for name in ("vendor", "product", "revision")
            if getattr(found, name) != getattr(before, name)
        ]
        if found.serial != before.serial:
            told.append(f"serial number {found.serial}, was {before.serial}")
        if told:
            text = f"another device than before: {', '.join(told)}. Its settings may be others"
            self._tell(Kind.CONFIGURATION, 600, text, now)
        return bool(told)

    def resets(self, why: str, now: float) -> None:
        self._tell(Kind.CONFIGURATION, 500, f"reset communication by the bridge, once: {why}", now)

    def restarted(self, now: float) -> None:
        self._tell(Kind.NODE_LOST, 800, "the node has restarted", now)

    def loops(self, loop: BootLoop, now: float) -> None:
        """Once a minute, where the node starts again and again."""
        told = loop.report(now)
        if told:
            self._tell(Kind.CONFIGURATION, 600, told, now)

    def flaps(self, back_off: BackOff, now: float) -> None:
        """Once a minute, where the node is lost soon after each boot-up."""
        told = back_off.report(now)
        if told:
            self._tell(Kind.NODE_LOST, 800, told, now)

    def stays(self, now: float) -> None:
        self._tell(Kind.NODE_BACK, 200, "node operational, and no longer lost again and again", now)

    def _tell(self, kind: Kind, severity: int, message: str, now: float) -> None:
        self._plant.report(Event(now, kind, self._node.name, severity, message))
