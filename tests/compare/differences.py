"""The differences that are known, each with its reason. ``docs/reference/opcua-differences.md`` has them.

A difference that no row explains is a fault: ours is mended, another server's gets a row.
"""

from __future__ import annotations

from typing import Final

from tests.compare.difference import Difference
from tests.compare.known_alarms import OF_ALARMS
from tests.compare.known_history import OF_HISTORY
from tests.compare.known_items import OF_ITEMS
from tests.compare.known_services import OF_SERVICES
from tests.compare.known_sessions import OF_SESSIONS
from tests.compare.play import Seen
from tests.compare.servers import OURS

DIFFERENCES: Final[tuple[Difference, ...]] = (*OF_SESSIONS, *OF_SERVICES, *OF_HISTORY, *OF_ALARMS, *OF_ITEMS)


def differing(seen: Seen) -> list[str]:
    return [name for name, value in seen.values.items() if value != seen.values[OURS]]


def explanation(seen: Seen, server: str) -> Difference | None:
    return next((row for row in DIFFERENCES if row.explains(seen, server)), None)


def unexplained(seen: Seen) -> list[str]:
    """The servers that differ from ours and no row says why."""
    return [server for server in differing(seen) if explanation(seen, server) is None]
