"""What one client may have of the subscriptions and monitored items that all share."""

from __future__ import annotations

from collections.abc import Sequence
from typing import Final, Protocol

from asyncua.server.subscription_service import SubscriptionService

from bridge.northbound.opcua.admission import source_of
from bridge.northbound.opcua.library import ServiceError, StatusCodes, ua

MOST_SUBSCRIPTIONS: Final = 200
MOST_OF_SESSION: Final = 50
MOST_OF_ADDRESS: Final = 100
MOST_ITEMS: Final = 100_000
"""Monitored items of all clients together."""
MOST_ITEMS_OF_ADDRESS: Final = 50_000


class Holder(Protocol):
    """A session. ``holder`` is None while it has no connection, which ended at ``left_at``."""

    session_id: ua.NodeId
    address: str
    holder: object | None
    left_at: float

    async def close_session(self, delete_subs: bool = True) -> None: ...


async def make_room(session: Holder, sessions: Sequence[Holder], subscriptions: SubscriptionService) -> None:
    """See that ``session`` can have one more subscription: sessions without a connection, which a client that
    was started anew has left behind, end first. Raises ServiceError."""
    left = sorted((one for one in sessions if one.holder is None), key=lambda one: one.left_at)
    same = [one for one in sessions if source_of(one.address) == source_of(session.address)]
    while True:
        owners = [one.session_id for one in subscriptions.subscriptions.values()]
        of_address = sum(owners.count(one.session_id) for one in same)
        if owners.count(session.session_id) >= MOST_OF_SESSION:
            break
        if of_address < MOST_OF_ADDRESS and len(owners) < MOST_SUBSCRIPTIONS:
            return
        ending = [one for one in left if of_address < MOST_OF_ADDRESS or one in same]
        if not ending:
            break
        left.remove(ending[0])
        await ending[0].close_session()
    raise ServiceError(StatusCodes.BadTooManySubscriptions)


def room_for_items(owner: ua.NodeId, sessions: Sequence[Holder], items: dict[ua.NodeId, int]) -> int:
    """How many more the session ``owner`` may have; ``items`` are those that there are, by session."""
    of_address = {one.session_id: source_of(one.address) for one in sessions}
    source = of_address.get(owner)
    same = sum(count for session_id, count in items.items() if of_address.get(session_id) == source)
    return min(MOST_ITEMS - sum(items.values()), MOST_ITEMS_OF_ADDRESS - same)
