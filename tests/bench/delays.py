"""How late each change of a value was seen by somebody who watches it."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass


@dataclass(frozen=True, slots=True)
class Delays:
    """In ms; ``unseen`` changes were never shown, neither they nor a newer one. None: nothing was seen."""

    seen: int
    unseen: int
    p50_ms: float | None
    p99_ms: float | None
    max_ms: float | None
    caught_up_ms: float | None
    """From the last change until it was seen; None if it never was."""


def delays(sent: Sequence[float], seen: Sequence[tuple[float, int]]) -> tuple[list[float], int]:
    """Seconds from the sending of each change until it or a newer one was seen, and how many never were.

    ``sent[n]`` is when change n + 1 was sent; ``seen`` says when which change was there, in order.
    """
    late_s: list[float] = []
    for at, change in seen:
        if change > len(sent):
            raise ValueError(f"change {change} was seen and {len(sent)} were sent")
        late_s += [at - sent[number] for number in range(len(late_s), change)]
    return late_s, len(sent) - len(late_s)


def summary(sent: Sequence[Sequence[float]], seen: dict[int, list[tuple[float, int]]]) -> Delays:
    """Of all watched nodes: ``sent[n]`` has the changes of node n + 1, which are ``seen[n + 1]``."""
    late_s: list[float] = []
    unseen = 0
    last_s: list[float] = []
    for node, values in seen.items():
        late, missing = delays(sent[node - 1], values)
        late_s += late
        unseen += missing
        if not missing:
            last_s += late[-1:]
    late_s.sort()
    if not late_s:
        return Delays(0, unseen, None, None, None, None)
    at = (len(late_s) // 2, len(late_s) * 99 // 100, -1)
    p50, p99, most = (round(late_s[place] * 1e3, 2) for place in at)
    caught_up = None if unseen or not last_s else round(max(last_s) * 1e3, 2)
    return Delays(len(late_s), unseen, p50, p99, most, caught_up)
