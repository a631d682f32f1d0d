"""Refusals by a front itself, condensed: a client that is refused fast must not flood the bus process.

Sans-IO.
"""

from __future__ import annotations

from collections import Counter
from typing import Final

from bridge.command import Rejection
from bridge.command.audit import client_of, shared_by
from bridge.mirror.protocol import Rejected

_MOST_KINDS: Final = 20
"""Most kinds of one client that are reported one by one each time; of further ones their number, and what all
have in common."""
_MOST_CLIENTS: Final = 20
_Kind = tuple[str, ...]


class Rejections:
    """Rejections that wait to be told: the last one of each kind, and how many. None is hidden by those of
    another client, nor told as that of another one."""

    def __init__(self) -> None:
        self._waiting: dict[_Kind, Rejected] = {}
        self._kinds = Counter[str]()

    def add(self, rejection: Rejection, now: float) -> None:
        """``now`` in seconds of the monotonic clock."""
        identity = rejection.identity
        client = client_of(identity)
        if client not in self._kinds and len(self._kinds) >= _MOST_CLIENTS:
            client = "others"
        role = identity.role.name
        kind: _Kind = (client, identity.user, role, rejection.target, rejection.action, rejection.code)
        if kind not in self._waiting and self._kinds[client] >= _MOST_KINDS:
            kind = (client,)
        before = self._waiting.get(kind)
        if before is None:
            self._kinds[client] += 1
            self._waiting[kind] = Rejected(now, 1, rejection)
        else:
            told = _both(before.rejection, rejection)
            self._waiting[kind] = Rejected(now, before.count + 1, told)

    def take(self) -> list[Rejected]:
        """All of them, in the order in which their kinds first came."""
        waiting, self._waiting = self._waiting, {}
        self._kinds.clear()
        return list(waiting.values())


def _both(one: Rejection, other: Rejection) -> Rejection:
    """The refusal common to both, empty where they differ. Of one kind the values of the last are an
    example."""
    is_kind = (one.target, one.action, one.code) == (other.target, other.action, other.code)
    return Rejection(
        shared_by(one.identity, other.identity),
        other.target if one.target == other.target else "",
        other.action if one.action == other.action else "",
        other.code if one.code == other.code else "",
        other.said if one.said == other.said else "",
        other.values if is_kind else {},
    )
