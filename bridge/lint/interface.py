"""The interface of a bus: whose bytes it reads."""

from __future__ import annotations

from typing import Final

from bridge.lint.bus import BusView
from bridge.lint.report import LintReport
from bridge.text import Text

_BY_NETWORK: Final = frozenset({"udp_multicast", "socketcand"})
"""Of python-can. What they read is no CAN frame of 8 bytes at most, but what anybody sends."""


def check_interface(bus: BusView, report: LintReport) -> None:
    """Name an interface whose frames come over a network (docs/adr/0017-strangers-bytes.md)."""
    if bus.table.interface in _BY_NETWORK:
        report.warning(
            (*bus.key, "interface"),
            Text.of("check.by_network"),
            Text.of("check.by_network_advice"),
        )
