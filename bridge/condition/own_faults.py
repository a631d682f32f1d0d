"""The faults that a drive itself reports: the one that it has while the points show the bridge's, after a
trip, and those with which it answers a silent bus. Sans-IO."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import replace
from typing import TypeVar

from bridge.condition.findings import OwnFault
from bridge.condition.layout import Layout
from bridge.config import Site
from bridge.drive import FAULTED, Explained, FaultWords, StatusWords
from bridge.mapping import Family

_Of = TypeVar("_Of")


def with_faults(layout: Layout, site: Site, families: Mapping[str, Family]) -> Layout:
    """``layout`` with what its drives say of their faults."""
    drives = {name: family for name, family in families.items() if not family.is_device}
    return replace(
        layout,
        own_faults=_by_drive(site, families, {name: _own_fault(family) for name, family in drives.items()}),
        bus_faults=_by_drive(site, families, {name: _bus_faults(family) for name, family in drives.items()}),
    )


def _by_drive(site: Site, families: Mapping[str, Family], of_family: Mapping[str, _Of]) -> dict[str, _Of]:
    return {
        f"{node.name}/{families[node.mapping_key].leaf_of(drive)}": of_family[node.mapping_key]
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


def _bus_faults(family: Family) -> frozenset[str]:
    """Numbers of faults by a silent bus, in the maker's form: those of the drive, and those that the bridge
    reports in its place."""
    words, faults = FaultWords(family), family.faults
    own = (words.own(one).number for one in (faults.telegram_downtime, faults.node_missing))
    return frozenset([*own, *(words.listed(name).number for name in faults.silent_bus)])
