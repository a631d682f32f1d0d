"""The fault that a drive itself reports while the points show the bridge's: after a trip. Sans-IO."""

from __future__ import annotations

from bridge.config import Site
from bridge.drive import FAULTED, Explained, FaultWords, StatusWords
from bridge.mapping import Family
from bridge.northbound.page.findings import OwnFault


def own_faults(site: Site, families: dict[str, Family]) -> dict[str, OwnFault]:
    """For each drive, ``<node>/<drive>``."""
    of_family = {name: _own_fault(family) for name, family in families.items() if not family.is_device}
    return {
        f"{node.name}/{families[node.mapping].leaf_of(drive)}": of_family[node.mapping]
        for bus in site.bus
        for node in bus.node
        for drive in node.drive
    }


def _own_fault(family: Family) -> OwnFault:
    status, faults = StatusWords(family.status_word), FaultWords(family)

    def own_fault(status_word: int, emcy_code: int) -> Explained | None:
        if status.state(status_word) not in FAULTED:
            return None
        return faults.of_code(emcy_code) if emcy_code else Explained(text="fault")

    return own_fault
