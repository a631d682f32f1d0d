"""The core of a bus process for a site file, on buses where nothing is."""

from __future__ import annotations

from collections.abc import Callable
from pathlib import Path
from typing import NamedTuple

from bridge.can import Bus
from bridge.can.virtual import VirtualWire
from bridge.catalogue import Catalogue
from bridge.command import Plant, PlantView
from bridge.master.master import Master
from bridge.master.network import Network
from bridge.project import load_project
from bridge.recorder.tape import RecordingTape, TapedBus


class Core(NamedTuple):
    master: Master
    view: PlantView
    plant: Plant


def core_of(site: Path, tape: RecordingTape, taped: Callable[[Bus], Bus] | None = None) -> Core:
    """``taped`` puts its buses on the tape."""
    project = load_project(site)
    plant = Plant(Catalogue.of(project.site, project.families), "0", 0.0, tape)
    plant.on_event(tape.on_event)
    lines = [
        (
            taped(VirtualWire().end(table.name)) if taped else TapedBus(VirtualWire().end(table.name), tape),
            Network(table, plant.side_of(table), tape.epoch_ns, project.downloads),
        )
        for table in project.site.bus
    ]
    master = Master([*lines], plant, tape.now)
    view = PlantView(plant, tape.now, tape.epoch_ns, master.carry_out, master.wake)
    return Core(master, view, plant)
