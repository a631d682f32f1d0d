"""Quotas of one client in the sessions, subscriptions and monitored items that all share."""

from __future__ import annotations

from collections import Counter
from collections.abc import Iterable, Mapping, Sequence
from typing import Final

from bridge.base.admission import first_to_yield
from bridge.base.sources import source_of
from bridge.uaserver.library import ServiceError, StatusCodes
from bridge.uaserver.subscriptions.subscription import Subscription, SubscriptionOwner

MOST_SESSIONS: Final = 100
"""Also of clients that have lost their connection, for the session's time-out."""
MOST_SESSIONS_OF_ADDRESS: Final = 50
MOST_SUBSCRIPTIONS: Final = 200
MOST_OF_SESSION: Final = 50
MOST_OF_ADDRESS: Final = 100
MOST_ITEMS: Final = 100_000
"""Monitored items of all clients together."""
MOST_ITEMS_OF_ADDRESS: Final = 50_000
MOST_ON_ONE: Final = 1_000
"""Limit for one address on one attribute: each item is told of every change of it."""
MOST_LISTENERS: Final = 1_000
"""Limit of the weight of all clients' items for events: each is asked about every event."""
MOST_LISTENERS_OF_ADDRESS: Final = 500


async def make_room_for_session(address: str, sessions: Sequence[SubscriptionOwner], top_rank: int) -> None:
    """See that there can be one more session of this address, whoever will activate it. Raises ServiceError.

    The lowest role yields, and of it a session without a connection, which a client that was started anew has
    left behind. One with a connection yields where there is a higher role than its own: a place is kept free
    for that.
    """
    same = [one for one in sessions if source_of(one.address) == source_of(address)]
    if len(same) >= MOST_SESSIONS_OF_ADDRESS:
        sessions = same
    elif len(sessions) < MOST_SESSIONS:
        return
    yielding = [one for one in sessions if one.holder is None or one.identity.rank < top_rank]
    if not yielding:
        raise ServiceError(StatusCodes.BadTooManySessions)
    lowest = min(one.identity.rank for one in yielding)
    left = [one for one in yielding if one.holder is None and one.identity.rank == lowest]
    if left:
        await min(left, key=lambda one: one.left_at).abort(delete_subs=False)
    else:
        await first_to_yield(yielding, _rank_of, share_of).evict()


async def make_room(
    session: SubscriptionOwner,
    sessions: Sequence[SubscriptionOwner],
    subscriptions: Mapping[int, Subscription],
) -> None:
    """See that ``session`` can have one more subscription. Raises ServiceError.

    Sessions without a connection, which a client that was started anew has left behind, end first, then those
    of lower roles; none of a higher one.
    """
    rank = session.identity.rank
    left = sorted(
        (one for one in sessions if one.holder is None and one.identity.rank <= rank),
        key=lambda one: (one.identity.rank, one.left_at),
    )
    same = [one for one in sessions if source_of(one.address) == source_of(session.address)]
    while True:
        owners = [one.session_id for one in subscriptions.values()]
        of_address = sum(owners.count(one.session_id) for one in same)
        if owners.count(session.session_id) >= MOST_OF_SESSION:
            break
        if of_address < MOST_OF_ADDRESS and len(owners) < MOST_SUBSCRIPTIONS:
            return
        ending = [one for one in left if of_address < MOST_OF_ADDRESS or one in same]
        if ending:
            left.remove(ending[0])
            await ending[0].abort()
            continue
        among = [one.owner for one in subscriptions.values()]
        lower = lower_than(session, [one for one in among if of_address < MOST_OF_ADDRESS or one in same])
        if lower is None:
            break
        await lower.evict()
    raise ServiceError(StatusCodes.BadTooManySubscriptions)


def lower_than(session: SubscriptionOwner, holders: Sequence[SubscriptionOwner]) -> SubscriptionOwner | None:
    """The one of ``holders``, each as often as it holds something, that makes room for ``session``; None
    where nobody has a lower role."""
    lower = [one for one in holders if one.identity.rank < session.identity.rank and not one.is_gone]
    return first_to_yield(lower, _rank_of, share_of) if lower else None


def share_of(session: SubscriptionOwner) -> str:
    """Whom it is counted for: its user, or without a name its address."""
    return source_of(session.address) if session.identity.is_anonymous else session.identity.name


def _rank_of(session: SubscriptionOwner) -> int:
    return session.identity.rank


def room_for_items(address: str, subscriptions: Iterable[Subscription]) -> int:
    """Number of monitored items that a session of this address may have in addition to what all have."""
    items: Counter[str] = Counter()
    for one in subscriptions:
        items[source_of(one.owner.address)] += len(one.items)
    return min(MOST_ITEMS - items.total(), MOST_ITEMS_OF_ADDRESS - items[source_of(address)])


class EventItemQuota:
    """Weight of the items for events, by whom they are counted for."""

    def __init__(self) -> None:
        self._weights: Counter[str] = Counter()

    @property
    def is_full(self) -> bool:
        return self._weights.total() >= MOST_LISTENERS

    def change(self, source: str, by: int) -> None:
        """Raises ServiceError for more where there is no room. What comes last may go beyond it."""
        full = self.is_full or self._weights[source] >= MOST_LISTENERS_OF_ADDRESS
        if by > 0 and full:
            raise ServiceError(StatusCodes.BadTooManyMonitoredItems)
        self._weights[source] += by
        if not self._weights[source]:
            del self._weights[source]
