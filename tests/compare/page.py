"""``docs/reference/opcua-differences.md``, which ``python -m tests.compare.page`` writes."""

from __future__ import annotations

from collections.abc import Sequence
from pathlib import Path
from typing import Final

from tests.compare.difference import ANYTHING, Codes, Difference
from tests.compare.differences import DIFFERENCES
from tests.compare.known_alarms import OF_ALARMS
from tests.compare.servers import NODE_OPCUA, OPEN62541
from tests.support.process import REPOSITORY

PAGE: Final[Path] = REPOSITORY / "docs" / "reference" / "opcua-differences.md"

_HEAD: Final = """\
# OPC UA: what differs from other servers

For integrators who know other OPC UA servers. {asked} {compared}

{left_out}

Cases of the runs that ended with no difference but these: {clean}.

Of a request with several faults each server tells another one first, which Part 4 leaves open.

A change that makes another difference fails `make wire`; `make compare` asks thousands of sequences.
"""
_ASKED: Final = (
    "The bridge's server, open62541 (PyPI `o6` 2.2.0) and node-opcua's (2.182.2) are asked the same: the"
    " [services](opcua.md#services) with sound and with wrong parameters, in sequences that a seed makes."
)
_COMPARED: Final = (
    "Codes, values and events are compared, but for what a server may choose: ids, times, revised values, and"
    " how notifications are spread over messages. All that was found to differ is below."
)
_LEFT_OUT: Final = (
    "`o6` has no alarms: their methods and a refresh are compared with node-opcua alone. Neither of the two"
    " reads history at times, or events of the past: of these the status codes are compared, and no values."
)
CLEAN: Final = {
    "Discovery": 2100,
    "Session": 2100,
    "View": 2100,
    "Attribute": 2100,
    "History": 2100,
    "Method": 2100,
    "Alarm": 2280,
    "MonitoredItem": 2290,
    "Subscription": 2021,
}
"""Cases by service set, of the runs that ended without an unknown difference."""

_COLUMNS: Final = ("service", "asked", "the bridge", OPEN62541, NODE_OPCUA, "why", "source")


_WORDS: Final = {
    "None": "nothing",
    "some": "endpoints",
    "none": "no endpoint",
    "does not end": "keep-alives of this one alone",
    "closes": "ends",
}


def page() -> str:
    clean = ", ".join(f"{name} {cases:,}" for name, cases in CLEAN.items())
    head = _HEAD.format(asked=_ASKED, compared=_COMPARED, left_out=_LEFT_OUT, clean=clean)
    lines = [head, _row(_COLUMNS), _row(["---"] * len(_COLUMNS))]
    return "\n".join([*lines, *(_row(_cells(one)) for one in DIFFERENCES if not _is_order(one))]) + "\n"


def _is_order(row: Difference) -> bool:
    return row.asked.startswith("several faults in")


def _cells(row: Difference) -> Sequence[str]:
    ours = _told(row.ours)
    theirs = [_told(row.theirs[name]) if name in row.theirs else _same(row, name) for name in _COLUMNS[3:5]]
    return [row.service, row.asked, ours, *theirs, row.why, row.clause]


def _same(row: Difference, server: str) -> str:
    return "not asked" if row in OF_ALARMS and server == OPEN62541 else "as the bridge"


def _told(codes: Codes) -> str:
    if codes is ANYTHING:
        return "differs"
    return ", ".join(_WORDS.get(one, one) for one in codes)


def _row(cells: Sequence[str]) -> str:
    return f"| {' | '.join(cells)} |"


if __name__ == "__main__":
    PAGE.write_text(page())
