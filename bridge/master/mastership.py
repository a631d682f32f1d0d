"""Mastership of a bus: whether this bridge or another one is in charge, and how that is reported. Sans-IO."""

from __future__ import annotations

from collections.abc import Sequence

from bridge.command import Event, EventKind, EventQueue
from bridge.config import BusTable
from bridge.master.standby import BusRole, Standby, listen_s
from bridge.node.node_core import NodeCore
from bridge.text import Said, Text


class BusMastership:
    """Mastership of one bus, by its ``Standby``."""

    def __init__(
        self,
        bus: BusTable,
        nodes: Sequence[NodeCore],
        events: EventQueue,
        listening: Standby | None,
    ) -> None:
        self._bus = bus
        self._nodes = nodes
        self._events = events
        self._listening = listening or Standby(listen_s(bus))

    def acts(self) -> bool:
        """True if this bridge acts: otherwise nothing is sent."""
        return self._listening.part is BusRole.ACTING

    @property
    def is_passive(self) -> bool:
        """True if another bridge is in charge."""
        return self._listening.is_passive

    @property
    def why_not(self) -> Said:
        """Reason why nothing is sent; empty where this bridge acts."""
        if self.acts():
            return ""
        listens = self._listening.part is BusRole.LISTENING
        return Text.of("bus.listens" if listens else "bus.leaves", bus=self._bus.name)

    def heard(self, sign: Text, now: float) -> Text | None:
        """Take a ``sign`` of another bridge. If this one gives way by that it sends nothing more than it
        owes: returns the reason, with which all that is known of the bus is to be forgotten."""
        if not self._listening.heard(now):
            return None
        until_ms = self._listening.silence_s * 1000
        self._tell(Text.of("bus.gives_way", sign=sign, until_ms=until_ms), now)
        return Text.of("bus.other_in_charge", bus=self._bus.name)

    def on_time(self, now: float) -> None:
        """Begin to act when it is time: as at any start, with everything stopped."""
        was_passive = self.is_passive
        if not self._listening.on_time(now) or not was_passive:
            return
        silent_ms = self._listening.silence_s * 1000
        self._tell(Text.of("bus.takes_over", silent_ms=silent_ms), now)
        for node in self._nodes:
            if not node.is_out_of_service:
                node.say(Text.of("node.waiting"), now)
            for one in node.node.commanded:
                one.channel.on_bridge_gap(now)
                one.refresh(now)

    def next_deadline(self) -> float | None:
        return self._listening.next_deadline()

    def came_back(self, now: float) -> None:
        """Note that the bridge was away for longer than its bursts last."""
        self._listening.returns(now)

    def bus_is_gone(self) -> None:
        self._listening.bus_is_gone()

    def bus_is_back(self, now: float) -> None:
        self._listening.bus_is_back(now)
        if self.is_passive:
            self.say_passive(now)

    def say_passive(self, now: float) -> None:
        """Show for each node that another bridge is in charge of it."""
        for node in self._nodes:
            if not node.is_out_of_service:
                node.say(Text.of("node.passive", bus=self._bus.name), now)

    def _tell(self, said: Text, now: float) -> None:
        self._events.report(Event(now, EventKind.BUS, self._bus.name, 800, said))
