"""Refusals of requests by others than drives: the plant, nodes and protocols."""

from __future__ import annotations

from typing import Final

from bridge.catalogue import Catalogue
from bridge.command.messages.event import Event, EventKind, EventQueue
from bridge.command.messages.request import Action, Identity, Outcome, Reply, Request
from bridge.text import Said, Text

_LONGEST_NAME: Final = 80
"""Most characters of a target's name that are shown: clients may call anything a drive."""


class Refusals:
    """Refusals by the plant, by nodes and by protocols: each is an event and counts, as that of a drive."""

    def __init__(self, catalogue: Catalogue, events: EventQueue) -> None:
        self._sources = {f"bus/{bus.name}": bus.name for bus in catalogue.site.bus}
        for name, node in catalogue.nodes.items():
            self._sources |= {one: one for one in (name, *(drive.name for drive in node.drives))}
        self._events = events
        self.count = 0

    def report(
        self, what: str, identity: Identity, target: str, why: Said, now: float, count: int = 1
    ) -> None:
        """Report ``count`` refusals of one kind; for an unknown ``target`` the bridge's event names it."""
        source = self._sources.get(target)
        unknown = target[:_LONGEST_NAME] if source is None else ""
        who = str(identity) if identity.user else identity.source.label
        self.count += count
        said = _refused(what, unknown, who, why)
        self._events.report(Event(now, EventKind.REFUSED, source or "bridge", 300, said))

    def counted(self, request: Request, now: float, reply: Reply) -> Reply:
        """Reply that reports a refusal before ``reply`` is called."""

        def conclude(outcome: Outcome) -> None:
            if not outcome.ok and request.action is not Action.READ_PARAMETER:
                self.report(request.action, request.identity, request.target, outcome.said, now)
            reply(outcome)

        return conclude


def _refused(what: str, target: str, who: str, why: Said) -> Text:
    """Text of the event. ``what`` is empty where several requests that differ in it are told as one,
    ``target`` where the event is of it."""
    action = Text.plain(what) if what else Text.of("request.several")
    if what in Action.__members__.values():
        action = Text.word("action", what)
    if target and why:
        return Text.of("request.refused_on", action=action, target=target, who=who, why=why)
    if target:
        return Text.of("request.refused_on_unsaid", action=action, target=target, who=who)
    if why:
        return Text.of("request.refused", action=action, who=who, why=why)
    return Text.of("request.refused_unsaid", action=action, who=who)
