"""Many cases of one service set, from a seed: what was compared, which known differences there were, and the
shortest case that shows one which is not known."""

from __future__ import annotations

from collections import Counter
from collections.abc import Sequence
from contextlib import suppress
from dataclasses import dataclass, field
from typing import Any

from hypothesis import HealthCheck, Phase, given, seed, settings

from tests.compare.cases import SETS
from tests.compare.differences import DIFFERENCES, differing, explanation, unexplained
from tests.compare.play import EndOfCaseError, Play, Seen, playing
from tests.compare.servers import NAMES, NODE_OPCUA, OURS, Servers

_WITHOUT_SESSION = ("Discovery", "Session")
_ASKED = {"Alarm": (OURS, NODE_OPCUA)}
"""Servers of the sets that not all of them have."""


@dataclass
class Report:
    """``rows`` counts the known differences by their place in the table, ``told`` the values and events of
    items, ``once`` the differences that were not there when the case was played again. ``fault`` is the
    shortest case that nothing explains."""

    service_set: str
    cases: int = 0
    requests: int = 0
    told: int = 0
    rows: Counter[int] = field(default_factory=Counter[int])
    once: int = 0
    fault: str = ""

    def add(self, other: Report) -> None:
        self.cases += other.cases
        self.requests += other.requests
        self.told += other.told
        self.rows += other.rows
        self.once += other.once
        self.fault = self.fault or other.fault


class UnknownDifferenceError(AssertionError):
    """A difference that no row explains."""


def compare(servers: Servers, service_set: str, cases: int, first: int) -> Report:
    """So many cases from the seed ``first``."""
    report = Report(service_set)

    @seed(first)
    @settings(
        max_examples=cases,
        deadline=None,
        database=None,
        phases=[Phase.generate, Phase.shrink],
        suppress_health_check=list(HealthCheck),
        print_blob=False,
    )
    @given(SETS[service_set]())
    def each(case: Sequence[Any]) -> None:
        unknown = _unknown(_played(servers, service_set, case, report))
        if not unknown:
            return
        # A machine that stood still for a moment makes no difference of this kind twice.
        paths = {(seen.service, seen.path) for seen in unknown}
        again = _unknown(_played(servers, service_set, case, report))
        lasting = [seen for seen in again if (seen.service, seen.path) in paths]
        report.once += len(unknown) - len(lasting)
        if lasting:
            raise UnknownDifferenceError(_told(case, lasting))

    try:
        each()
    except UnknownDifferenceError as error:
        report.fault = str(error)
    return report


def _played(servers: Servers, service_set: str, case: Sequence[Any], report: Report) -> Play:
    servers.refresh()
    logged_in = service_set not in _WITHOUT_SESSION
    asked = _ASKED.get(service_set, NAMES)
    with playing(servers.ports, asked, logged_in=logged_in) as play, suppress(EndOfCaseError):
        play.run(case)
    for name in _closing(play):
        servers.await_end(name)
    report.cases += 1
    report.requests += play.asked
    report.told += play.told
    for seen in play.seen:
        for server in differing(seen):
            row = explanation(seen, server)
            if row:
                report.rows[DIFFERENCES.index(row)] += 1
    return play


def _closing(play: Play) -> set[str]:
    return {name for seen in play.seen for name, value in seen.values.items() if value == "closes"}


def _unknown(play: Play) -> list[Seen]:
    return [seen for seen in play.seen if unexplained(seen)]


def _told(case: Sequence[Any], unknown: Sequence[Seen]) -> str:
    steps = [f"{number}. {step!r}" for number, step in enumerate(case, 1)]
    return "\n".join([*steps, "", *map(str, unknown)])
