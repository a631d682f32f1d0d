"""One row of the table of known differences, and what it explains."""

from __future__ import annotations

import re
from collections.abc import Callable, Mapping
from dataclasses import dataclass, field
from typing import Any, Final

from tests.compare import faults
from tests.compare.faults import Faults
from tests.compare.play import Seen
from tests.compare.servers import NODE_OPCUA, OPEN62541, OURS

Codes = tuple[str, ...]
ANYTHING: Final = ("anything",)


@dataclass(frozen=True, slots=True, eq=False)
class Difference:
    """``asked`` and ``why`` are for integrators. ``ours`` and ``theirs`` are the values that differ, ``path``
    is where, and ``when`` says whether a request is meant."""

    service: str
    asked: str
    ours: Codes
    theirs: Mapping[str, Codes]
    clause: str
    why: str
    path: str = r"result|.*\.StatusCode|Results\[\d+\]"
    when: Callable[[Seen, str], bool] = field(default=lambda seen, server: True)

    def explains(self, seen: Seen, server: str) -> bool:
        """Whether this is why ``server`` differs from ours."""
        return (
            seen.service in self.service.split(", ")
            and server in self.theirs
            and re.fullmatch(self.path, seen.path) is not None
            and _is_one(seen.values[OURS], self.ours)
            and _is_one(seen.values[server], self.theirs[server])
            and self.when(seen, server)
        )


def _is_one(value: Any, codes: Codes) -> bool:
    return codes is ANYTHING or str(value) in codes


When = Callable[[Seen, str], bool]
"""Whether the row is about this difference of this server."""


def both(*codes: str) -> Mapping[str, Codes]:
    return {OPEN62541: codes, NODE_OPCUA: codes}


def open62541(*codes: str) -> Mapping[str, Codes]:
    return {OPEN62541: codes}


def node_opcua(*codes: str) -> Mapping[str, Codes]:
    return {NODE_OPCUA: codes}


def several(faults_of: Callable[[Any], Faults], *also: str) -> When:
    """Whether both servers tell one of several faults, or ``also``."""

    def is_one_of_several(seen: Seen, server: str) -> bool:
        asked = seen.step if faults_of is faults.of_step else seen.operation
        found = faults_of(asked) if asked is not None else []
        codes = set(also).union(*found)
        return len(found) > 1 and {str(seen.values[OURS]), str(seen.values[server])} <= codes

    return is_one_of_several


def of_operation(test: Callable[[Any], bool]) -> When:
    return lambda seen, server: seen.operation is not None and test(seen.operation)


def of_step(test: Callable[[Any], bool]) -> When:
    return lambda seen, server: test(seen.step)


def target_of(operation: Any) -> Any:
    return getattr(operation, "ItemToMonitor", operation)


def has_encoding(operation: Any) -> bool:
    return bool(target_of(operation).DataEncoding.Name)


ANY: Final = {OPEN62541: ANYTHING, NODE_OPCUA: ANYTHING}
FIRST_FAULT: Final = "Part 4 §7.38"
ANY_ORDER: Final = "Which of several faults is told is not laid down."
