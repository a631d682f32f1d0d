"""The faults that a drive itself reports: the one that it has while the points show the bridge's, after a
trip, and those with which it answers a silent bus. Sans-IO."""

from __future__ import annotations

from dataclasses import replace

from bridge.catalogue import Catalogue
from bridge.condition.plant_layout import PlantLayout
from bridge.condition.point_troubles import OwnFault
from bridge.drive import FAULTED, Explained, FaultWords, StatusWords
from bridge.mapping import Family
from bridge.text import Text


def with_faults(layout: PlantLayout, catalogue: Catalogue) -> PlantLayout:
    """``layout`` with what its drives say of their faults."""
    drives = catalogue.drives.values()
    families = {node.table.mapping_key: node.family for node in catalogue.nodes.values() if node.drives}
    own = {name: _own_fault(family) for name, family in families.items()}
    of_bus = {name: _bus_faults(family) for name, family in families.items()}
    return replace(
        layout,
        own_faults={drive.name: own[drive.node.mapping_key] for drive in drives},
        bus_faults={drive.name: of_bus[drive.node.mapping_key] for drive in drives},
    )


def _own_fault(family: Family) -> OwnFault:
    status, faults = StatusWords(family.status_word), FaultWords(family)

    def own_fault(status_word: int, emcy_code: int) -> Explained | None:
        if status.state(status_word) not in FAULTED:
            return None
        return faults.of_code(emcy_code) if emcy_code else Explained(text=Text.word("drive_state", "fault"))

    return own_fault


def _bus_faults(family: Family) -> frozenset[str]:
    """Numbers of faults by a silent bus, in the maker's form: those of the drive, and those that the bridge
    reports in its place."""
    words, faults = FaultWords(family), family.faults
    own = (words.own(one).number for one in (faults.telegram_downtime, faults.node_missing))
    return frozenset([*own, *(words.listed(name).number for name in faults.silent_bus)])
