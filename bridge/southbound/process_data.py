"""Process data of one drive: its two PDOs as the node has them."""

from __future__ import annotations

from collections.abc import Callable

from bridge.command import Drive
from bridge.southbound.boot import PdoPlan
from bridge.southbound.bus.frame import Frame


class DrivePdos:
    """Unpacks a drive's TPDO into its words and packs its RPDO from the channel's output."""

    __slots__ = (
        "_codec",
        "_drive",
        "_last",
        "_order",
        "_reject",
        "_rpdo",
        "_rpdo_words",
        "_tpdo_words",
        "_words",
    )

    def __init__(
        self, drive: Drive, rpdo: PdoPlan, tpdo: PdoPlan, reject: Callable[[Frame, str], None]
    ) -> None:
        self._drive = drive
        self._reject = reject
        self._codec = tpdo.codec
        self._tpdo_words = tpdo.words
        self._order = tpdo.words == tuple(range(len(drive.words)))
        self._words = [0] * len(drive.words)
        self._last = b""
        self._rpdo = rpdo
        self._rpdo_words = rpdo.words

    def on_tpdo(self, frame: Frame) -> None:
        data = frame.data
        if data == self._last:
            self._drive.on_unchanged_data(frame.time)
            return
        if len(data) != self._codec.length:
            self._reject(frame, f"{self._codec.length} bytes are mapped")
            return
        self._last = data
        values = self._codec.unpack(data)
        if self._order:
            self._drive.on_process_data(values, frame.time)
            return
        for place, value in zip(self._tpdo_words, values, strict=True):
            if place is not None:
                self._words[place] = value & 0xFFFF
        self._drive.on_process_data(self._words, frame.time)

    @property
    def is_silent(self) -> bool:
        return self._drive.channel.output.silent

    @property
    def cob_id(self) -> int:
        return self._rpdo.cob_id

    def rpdo(self) -> Frame:
        """The frame that belongs on the bus now."""
        words = self._drive.channel.output.words
        values = tuple(0 if place is None else words[place] for place in self._rpdo_words)
        return Frame(self._rpdo.cob_id, self._rpdo.codec.pack(values))
