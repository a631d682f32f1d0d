"""Steps that wait for notifications until there are no more.

Every subscription of a case has the shortest publishing interval that all three servers take and says after
each without news that it is there. So nothing is left to be told once each has said so. How notifications are
spread over messages depends on when each server looks, and is not compared: only what each item tells, in its
order.
"""

from __future__ import annotations

from dataclasses import dataclass
from typing import Any, Final

from asyncua import ua

from tests.compare.asked import UNKNOWN, Ask, Made
from tests.compare.facts import Facts, code_name, plain
from tests.compare.play import Party, Play, settle

INTERVAL_MS: Final = 100.0
_ANSWER_S: Final = 1.5
"""Longest wait where a subscription has to say something."""
_SILENCE_S: Final = 0.25
"""Wait for an answer where there is nothing that could tell something."""
_MOST: Final = 60


@dataclass(frozen=True, slots=True)
class Publish:
    """Publish until nothing is left to tell. ``acknowledges`` what the first request does: everything, what
    has been acknowledged before, or a number that was never sent."""

    acknowledges: str = "nothing"
    service: str = "Publish"

    def play(self, play: Play) -> None:
        if any(one.odd and not one.live for one in play.parties):
            return  # nothing but those with odd terms, of which each server makes its own
        settle()
        play.each(self.service, self, self._publish)

    def _publish(self, party: Party) -> Facts:
        found: Facts = {}
        acknowledged = _acknowledged(party, self.acknowledges)
        quiet: set[int] = set()
        acknowledging = 0
        for _ in range(_MOST):
            # One for each, or a subscription may wait for ever for those before it. None is left over: what
            # is told between two steps is told at a time of the server's own.
            is_quiet = bool(party.live) and party.live <= quiet
            wanted = 0 if is_quiet else 1 + len(party.live) + len(party.odd)
            while acknowledged or len(party.publishing) < wanted:
                asked = {"SubscriptionAcknowledgements": acknowledged}
                party.publishing.append(party.send(Ask("Publish", asked)))
                if acknowledged:
                    acknowledging, acknowledged = party.publishing[-1], []
            try:
                wait_s = _ANSWER_S if party.live else _SILENCE_S
                number, answer = party.channel().receive_any(party.publishing, wait_s)
            except TimeoutError:
                found["result"] = "waits"
                return found
            party.publishing.remove(number)
            if isinstance(answer, ua.ServiceFault):
                found["result"] = code_name(answer.ResponseHeader.ServiceResult.value)
                return found
            if number == acknowledging:
                codes = {code_name(one.value) for one in answer.Parameters.Results or ()}
                found["acknowledgements"] = " ".join(sorted(codes))  # how many there are is each server's own
                acknowledging = 0
            self._note(party, answer.Parameters, found, quiet)
            if party.live and party.live <= quiet and not party.publishing:
                return found
        found["result"] = "does not end"
        return found

    def _note(self, party: Party, told: Any, found: Facts, quiet: set[int]) -> None:
        message = told.NotificationMessage
        notifications = message.NotificationData or []
        if not notifications:
            quiet.add(told.SubscriptionId)
            return
        quiet.discard(told.SubscriptionId)
        party.messages.setdefault(told.SubscriptionId, []).append((message.SequenceNumber, message))
        places = party.made.get("subscription", [])
        if told.SubscriptionId not in places:
            return  # one with odd terms, which each server revises in its own way
        place = places.index(told.SubscriptionId)
        for one in notifications:
            for key, content in _contents(one, place):
                found.setdefault(key, []).append(content)


def _contents(notification: Any, place: Any) -> list[tuple[str, Any]]:
    if isinstance(notification, ua.DataChangeNotification):
        return [(f"item {one.ClientHandle}", _value(one.Value)) for one in notification.MonitoredItems]
    if isinstance(notification, ua.EventNotificationList):
        return [
            (f"events {one.ClientHandle}", [plain(field) for field in one.EventFields])
            for one in notification.Events
        ]
    return [(f"subscription {place}", plain(notification))]


def _value(held: ua.DataValue) -> str:
    code = code_name(held.StatusCode.value if held.StatusCode else 0)
    return code if code.startswith("Bad") else f"{plain(held.Value)} {code}"


def _acknowledged(party: Party, which: str) -> list[Any]:
    made = ua.SubscriptionAcknowledgement
    before = party.acknowledged
    if which == "unknown":
        return [made(party.find(Made("subscription", 0)), UNKNOWN)]
    if which == "of an unknown subscription":
        return [made(UNKNOWN, 1)]
    if which == "again":
        return [made(number, one) for number, ones in before.items() for one in ones[-1:]]
    if which != "everything":
        return []
    found: list[Any] = []
    for number, messages in party.messages.items():
        if number in party.made.get("subscription", ()):
            found += [made(number, one) for one, _ in messages]
            before.setdefault(number, []).extend(one for one, _ in messages)
    party.messages.clear()
    return found


@dataclass(frozen=True, slots=True)
class Republish:
    """Ask for a message again: the newest that is not acknowledged, one that is, or one that never was."""

    subscription: int
    which: str
    service: str = "Republish"

    def play(self, play: Play) -> None:
        numbers = {one.name: self._number(one) for one in play.parties}
        if len({number is None for number in numbers.values()}) > 1:
            return
        play.each(self.service, self, lambda one: self._ask(one, numbers[one.name]))

    def _number(self, party: Party) -> int | None:
        subscription = party.find(Made("subscription", self.subscription))
        if self.which == "newest":
            return next((one for one, _ in reversed(party.messages.get(subscription, []))), None)
        if self.which == "acknowledged":
            return next(reversed(party.acknowledged.get(subscription, [])), None)
        return UNKNOWN

    def _ask(self, party: Party, number: int | None) -> Facts:
        subscription = party.find(Made("subscription", self.subscription))
        asked = {
            "SubscriptionId": subscription,
            "RetransmitSequenceNumber": UNKNOWN if number is None else number,
        }
        answer = party.ask(Ask("Republish", asked))
        found: Facts = {"result": code_name(answer.ResponseHeader.ServiceResult.value)}
        if not isinstance(answer, ua.ServiceFault) and number is not None:
            before = dict(party.messages.get(subscription, [])).get(number)
            found["is the same message"] = _notified(answer.NotificationMessage) == _notified(before)
        return found


def _notified(message: Any) -> Any:
    if message is None:
        return None
    return [content for one in message.NotificationData or () for content in _contents(one, "")]
