"""Troubles as the points publish them: JSON with codes and facts, for clients that have the texts.
Sans-IO."""

from __future__ import annotations

from collections.abc import Iterable
from typing import Any, Final

import msgspec

from bridge.catalogue.codes import CONDITIONS
from bridge.condition.causes import Known, TroubleLine
from bridge.condition.point_troubles import Rank, Trouble
from bridge.condition.recent import Ended
from bridge.text import Text, as_json, in_english

MOST: Final = 100
"""Troubles in one text; each explains at most as many. The worst come first."""
_encode = msgspec.json.Encoder().encode


def condition(rank: Rank | None) -> int:
    """The number of the worst trouble at a place, 0 where there is none."""
    return 0 if rank is None else len(CONDITIONS) - 1 - rank


def troubles_json(shown: Iterable[TroubleLine]) -> str:
    """A list of objects: rank, kind, place, since in ms since 1970, facts; ``or_longer`` where it may have
    begun before the bridge did, ``explains`` (the same of each consequence) and ``until`` where the cause is
    over, and only these are left. Facts that are words of a text are in ``texts`` with its code and facts."""
    return _json([_shown(one) for one in list(shown)[:MOST]])


def recent_json(ended: Iterable[Ended]) -> str:
    """A list like that of ``troubles_json``, with ``until`` and ``times``, the number of times that each
    ended."""
    return _json([_shown(one.shown) | {"until": round(one.until_ms), "times": one.times} for one in ended])


def _json(told: list[dict[str, Any]]) -> str:
    return _encode(told).decode()


def _shown(one: TroubleLine) -> dict[str, Any]:
    said = _said(one.trouble, one.rank, one.since_ms, is_or_longer=one.is_or_longer)
    if one.until_ms is not None:
        said["until"] = round(one.until_ms)
    if one.explains:
        said["explains"] = [_known(known) for known in one.explains[:MOST]]
    return said


def _known(one: Known) -> dict[str, Any]:
    return _said(one.trouble, one.trouble.rank, one.since_epoch_ms, is_or_longer=one.is_or_longer)


def _said(trouble: Trouble, rank: Rank, since_ms: float, *, is_or_longer: bool) -> dict[str, Any]:
    said: dict[str, Any] = {
        "rank": rank.name.lower(),
        "kind": trouble.kind,
        "place": trouble.place,
        "since": round(since_ms),
        "facts": {name: in_english(fact) if isinstance(fact, Text) else fact for name, fact in trouble.facts},
    }
    if texts := {name: as_json(fact) for name, fact in trouble.facts if isinstance(fact, Text)}:
        said["texts"] = texts
    return said | ({"or_longer": True} if is_or_longer else {})
