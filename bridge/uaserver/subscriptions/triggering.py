"""Triggering links of one subscription: items that are reported when another one has something to tell
(OPC 10000-4 §5.13.1.6)."""

from __future__ import annotations

from typing import Final

from bridge.uaserver.library import ServiceError, StatusCodes
from bridge.uaserver.subscriptions.items import Item

MOST_LINKS: Final = 2_000
"""Limit for one subscription: each is looked at in every publishing interval in which its item triggers."""


class TriggeringLinks:
    """Links from triggering items to items to report, both by their numbers.

    They are one level deep: an item that is reported because of another one triggers nothing by that.
    """

    def __init__(self) -> None:
        self._links: dict[int, dict[int, Item]] = {}
        self._triggers: dict[int, set[int]] = {}
        """Triggering items by the item that they have reported."""
        self._fired: set[int] = set()
        self._count = 0

    def add(self, trigger: int, item: Item) -> None:
        """Raises ServiceError where there are as many links as there may be."""
        links = self._links.setdefault(trigger, {})
        if item.number in links:
            return
        if self._count >= MOST_LINKS:
            raise ServiceError(StatusCodes.BadResourceUnavailable)
        # What was queued before a link is made does not count for it.
        self.release()
        links[item.number] = item
        self._triggers.setdefault(item.number, set()).add(trigger)
        self._count += 1

    def remove(self, trigger: int, number: int) -> None:
        """Raises ServiceError where there is no such link."""
        links = self._links.get(trigger, {})
        if number not in links:
            raise ServiceError(StatusCodes.BadMonitoredItemIdInvalid)
        # What was triggered while there was a link is reported all the same.
        self.release()
        del links[number]
        self._count -= 1
        if not links:
            del self._links[trigger]
        self._triggers[number].discard(trigger)
        if not self._triggers[number]:
            del self._triggers[number]

    def drop(self, number: int) -> None:
        """An item is deleted, and with it the links from it and to it."""
        for linked in list(self._links.get(number, ())):
            self.remove(number, linked)
        for trigger in list(self._triggers.get(number, ())):
            self.remove(trigger, number)

    def fire(self, number: int) -> None:
        """An item has queued something."""
        if number in self._links:
            self._fired.add(number)

    def release(self) -> None:
        """Have what is queued of the linked items reported, where their item has triggered since."""
        for trigger in self._fired:
            for item in self._links.get(trigger, {}).values():
                item.release()
        self._fired.clear()
