"""Check of a bus's interface: the origin of the bytes that it reads."""

from __future__ import annotations

from typing import Final

from bridge.lint.checked_bus import CheckedBus
from bridge.lint.report import LintReport
from bridge.text import Text

_BY_NETWORK: Final = frozenset({"udp_multicast", "socketcand"})
"""Interfaces of python-can that read from a network: anybody can send there, and not only CAN frames of 8
bytes at most."""


def check_interface(bus: CheckedBus, report: LintReport) -> None:
    """Report an interface whose frames come over a network (docs/adr/0017-strangers-bytes.md)."""
    if bus.table.interface in _BY_NETWORK:
        report.warning(
            (*bus.key, "interface"),
            Text.of("check.by_network"),
            Text.of("check.by_network_advice"),
        )
