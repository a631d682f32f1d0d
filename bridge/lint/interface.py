"""The interface of a bus: whose bytes it reads."""

from __future__ import annotations

from typing import Final

from bridge.lint.bus import BusView
from bridge.lint.report import LintReport

_BY_NETWORK: Final = frozenset({"udp_multicast", "socketcand"})
"""Of python-can. What they read is no CAN frame of 8 bytes at most, but what anybody sends."""


def check_interface(bus: BusView, report: LintReport) -> None:
    """Name an interface whose frames come over a network (docs/adr/0017-strangers-bytes.md)."""
    if bus.table.interface in _BY_NETWORK:
        report.warning(
            (*bus.key, "interface"),
            "frames come over the network from whoever reaches it, into the process that moves drives",
            "for simulations and tests; a CAN interface of this machine for real drives",
        )
