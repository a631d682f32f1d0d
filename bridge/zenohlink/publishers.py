"""Cyclic publications: values on many keys, and whether anybody reads them."""

# pyright: reportUnknownMemberType=false
# zenoh's stubs leave out the return types of what returns nothing.

from __future__ import annotations

from collections import Counter
from collections.abc import Callable
from typing import Final

import zenoh

Value = tuple[str, bytes, bytes | None]
"""Key, payload, attachment."""

_BUSY: Final = 10
"""Values of a key before it gets a publisher: most keys have hardly any."""
_MOST: Final = 1000
"""Publishers: to declare one takes the longer the more there are."""


class Publishers:
    """Puts values; keys that have many get a declared publisher, which takes a third of the time. For one
    thread."""

    def __init__(self, encoding: str) -> None:
        self._encoding = encoding
        self._declared: dict[str, zenoh.Publisher] = {}
        self._values = Counter[str]()

    def put(self, session: zenoh.Session, value: Value) -> None:
        """Never waits for a peer that does not read: that peer loses the value."""
        key, payload, attachment = value
        publisher = self._declared.get(key) or self._declare(session, key)
        if publisher:
            publisher.put(payload, attachment=attachment)
        else:
            drop = zenoh.CongestionControl.DROP
            session.put(key, payload, encoding=self._encoding, attachment=attachment, congestion_control=drop)

    def _declare(self, session: zenoh.Session, key: str) -> zenoh.Publisher | None:
        if len(self._declared) >= _MOST:
            return None
        self._values[key] += 1
        if self._values[key] < _BUSY:
            return None
        publisher = self._declared[key] = session.declare_publisher(
            key, encoding=self._encoding, congestion_control=zenoh.CongestionControl.DROP
        )
        return publisher


class Readers:
    """Whether anybody subscribes to some of the keys that match an expression: ``on_status`` is called on
    zenoh's threads, ``on_change`` in the loop. ``tell`` has a call made there."""

    def __init__(
        self, on_change: Callable[[bool], None], tell: Callable[[Callable[[], None]], object]
    ) -> None:
        self._on_change = on_change
        self._tell = tell
        self._are_there = self._were_there = False
        self._is_due = False

    def on_status(self, status: zenoh.MatchingStatus) -> None:
        """However often they come and go, one call waits for the loop."""
        self._are_there = status.matching
        if not self._is_due:
            self._is_due = True
            self._tell(self._tell_change)

    def _tell_change(self) -> None:
        self._is_due = False
        if self._are_there is not self._were_there:
            self._were_there = self._are_there
            self._on_change(self._were_there)
