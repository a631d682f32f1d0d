"""A plant of this process as its servers see it, and its Modbus units."""

from __future__ import annotations

import time
from collections.abc import Callable

from bridge.command import Plant, PlantView
from bridge.config import WordOrder
from bridge.northbound.modbus.dispatch import Dispatcher
from bridge.northbound.modbus.units import units_of


def view_of(
    plant: Plant,
    clock: Callable[[], float] = time.monotonic,
    epoch_ns: Callable[[float], int] = lambda at: round(at * 1e9),
) -> PlantView:
    """Without a bus."""
    return PlantView(plant, clock, epoch_ns)


def dispatcher_of(
    plant: Plant,
    clock: Callable[[], float],
    word_order: WordOrder = "ABCD",
    view: PlantView | None = None,
) -> Dispatcher:
    return Dispatcher(view or view_of(plant, clock), units_of(plant.catalogue), word_order, clock)
