"""The plant of this process as its servers see it (``bridge.northbound.view``)."""

from __future__ import annotations

from collections.abc import Callable

from bridge.command.audit import Rejection
from bridge.command.plant import CarryOut, Plant, nobody
from bridge.command.request import Identity, Reply, Request
from bridge.image import Image


class PlantView:
    """``clock`` is the plant's, ``epoch_ns`` the wall clock at one of its times. ``carry_out`` is the
    master's, and ``wake`` has it send at once what has changed."""

    def __init__(
        self,
        plant: Plant,
        clock: Callable[[], float],
        epoch_ns: Callable[[float], int],
        carry_out: CarryOut = nobody,
        wake: Callable[[], None] = lambda: None,
    ) -> None:
        self._plant = plant
        self._clock = clock
        self._carry_out = carry_out
        self._wake = wake
        self.image: Image = plant.image
        self.epoch_ns = epoch_ns
        self.on_event, self.forget = plant.on_event, plant.forget

    def look(self, drive: str) -> None:
        self._plant.drives[drive].look(self._clock())

    def submit(self, request: Request, reply: Reply) -> None:
        is_changed = True
        try:
            later = self._plant.later(reply)
            is_changed = self._plant.submit(request, self._clock(), later, self._carry_out)
            # Of one telegram that is several requests, the bus gets what the last of them has left.
            self._plant.tell()
        finally:
            if is_changed:
                self._wake()

    def rejected(self, rejection: Rejection, at: float | None = None, count: int = 1) -> None:
        """``count`` of this kind, the last of them ``at`` a time of the plant's, or now."""
        self._plant.rejected(rejection, self._clock() if at is None else at, count)

    def count(self, leaf: str, by: int = 1) -> None:
        self._plant.count(leaf, self._clock(), by)

    def on_connection(self, identity: Identity, *, is_there: bool) -> None:
        self._plant.on_connection(identity, self._clock(), is_there=is_there)
