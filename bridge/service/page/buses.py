"""Buses of a site for the page: taps, decoded frames, layouts of the PDOs."""

from __future__ import annotations

import asyncio
from collections.abc import Callable, Iterator
from itertools import accumulate
from pathlib import Path
from typing import Any, Final

from bridge.base.errors import OperationFailed
from bridge.bustools.decode import Decoder
from bridge.bustools.decode_device import DevicePdoView
from bridge.bustools.decode_pdo import PdoView
from bridge.bustools.pdo_views import pdo_views, without_pdos
from bridge.can.listener import Listener, listener_of
from bridge.can.wirebits import exact_bits
from bridge.canopen.frame import EXTENDED, REMOTE, Frame
from bridge.config import BusTable
from bridge.lint import family_dictionaries
from bridge.mirror.endpoint import tap_path
from bridge.northbound.page.bus_page import Captured, IsGone
from bridge.northbound.page.traffic import BusTap, ShownFrame
from bridge.project import Project
from bridge.service.page.capture import CaptureFile
from bridge.text import Text

_IDENTIFIER: Final = 0x1FFF_FFFF
_PERIOD_S: Final = 0.1
MOST_CAPTURED: Final = 270_000
Epoch = Callable[[float], int]
"""Turns monotonic seconds into ns since 1970."""


class Buses:
    """All buses of ``project``."""

    def __init__(self, project: Project, epoch_ns: Epoch) -> None:
        self._project = project
        self._epoch_ns = epoch_ns
        self._tables = {table.name: table for table in project.site.bus}
        self._descriptions = family_dictionaries(without_pdos(project.families), project.path)

    def taps(self) -> list[tuple[str, int, BusTap]]:
        """Name, bit rate in bit/s and tap of each bus."""
        return [(name, table.bitrate, self._tap(table)) for name, table in self._tables.items()]

    def layouts(self) -> dict[str, Any]:
        """Nodes of each bus with the parts of their PDOs, for JSON."""
        return {
            name: {
                "master": table.master_node_id,
                "nodes": [
                    {"name": node.name, "id": node.id, "pdos": list(self._pdos(table, node.name))}
                    for node in table.node
                ],
            }
            for name, table in self._tables.items()
        }

    async def capture(self, bus: str, seconds: float, form: str, is_gone: IsGone) -> Captured:
        """A file, ``candump`` or ``asc``, with what passes in the next ``seconds``, or until ``is_gone``: so
        many frames at most as a minute of a half-full bus at 1 Mbit/s has. Raises ``OperationFailed``."""
        table = self._tables[bus]
        listener = self._listener(table)
        file = await asyncio.to_thread(CaptureFile, table.channel or bus, form, self._epoch_ns)
        _open(listener, table)
        loop = asyncio.get_running_loop()
        until = loop.time() + seconds
        is_cut = False
        try:
            while not listener.failure and not is_cut and loop.time() < until and not await is_gone():
                await asyncio.sleep(min(_PERIOD_S, max(0.0, until - loop.time())))
                frames = listener.take()
                is_cut = file.frames + len(frames) > MOST_CAPTURED
                await asyncio.to_thread(file.add, frames[: MOST_CAPTURED - file.frames])
        finally:
            listener.close()
        if listener.failure:
            raise OperationFailed(Text.of("page.bus_ended", bus=bus, why=listener.failure))
        return Captured(await asyncio.to_thread(file.content), is_cut)

    def _tap(self, table: BusTable) -> BusTap:
        return _ListenerTap(table, lambda: self._listener(table), self._decoder(table), self._epoch_ns)

    def _listener(self, table: BusTable) -> Listener:
        site = self._project.site.site
        tap = tap_path(Path(site.runtime_dir), site.name, table.name)
        return listener_of(table.interface, table.channel or "", tap)

    def _decoder(self, table: BusTable) -> Callable[[], Decoder]:
        families, descriptions = self._project.families, self._descriptions
        return lambda: Decoder(table.node, families, table.master_node_id, descriptions)

    def _pdos(self, table: BusTable, name: str) -> Iterator[dict[str, Any]]:
        node = next(node for node in table.node if node.name == name)
        family = self._project.families[node.mapping_key]
        found = pdo_views(node, family, self._descriptions.get(node.mapping_key))
        for cob_id, view in sorted(found.items(), key=lambda pair: pair[1].label):
            parts = _words(view) if isinstance(view, PdoView) else _signals(view)
            yield {"cob_id": f"{cob_id:03X}", "label": view.label, "bytes": view.codec.length, "parts": parts}


class _ListenerTap:
    """Tap of one bus that decodes its frames; each opening begins with a fresh decoder."""

    def __init__(
        self,
        table: BusTable,
        listener: Callable[[], Listener],
        decoder: Callable[[], Decoder],
        epoch_ns: Epoch,
    ) -> None:
        self._table = table
        self._make_listener, self._make_decoder = listener, decoder
        self._epoch_ns = epoch_ns
        self._listener: Listener | None = None
        self._decoder = decoder()

    def open(self) -> None:
        listener = self._make_listener()
        _open(listener, self._table)
        self._listener, self._decoder = listener, self._make_decoder()

    def close(self) -> None:
        if self._listener:
            self._listener.close()

    @property
    def lost(self) -> int:
        return self._listener.lost if self._listener else 0

    def take(self) -> list[ShownFrame]:
        listener = self._listener
        if listener is None:
            return []
        heard = [self._say(frame) for frame in listener.take()]
        if listener.failure and not heard:
            raise OperationFailed(Text.of("page.bus_ended", bus=self._table.name, why=listener.failure))
        return heard

    def _say(self, frame: Frame) -> ShownFrame:
        meaning = self._decoder.decode(frame)
        return ShownFrame(
            round(self._epoch_ns(frame.time) / 1e6, 3),
            _identifier(frame),
            "R" if frame.can_id & REMOTE else frame.data.hex(" ").upper(),
            str(meaning.kind),
            meaning.node,
            meaning.label,
            meaning.text,
            exact_bits(frame),
        )


def _open(listener: Listener, table: BusTable) -> None:
    """Open a bus to listen. Raises ``OperationFailed``."""
    try:
        listener.open()
    except OSError as error:
        reason = error.strerror or str(error)
        raise OperationFailed(Text.of("page.bus_deaf", bus=table.name, why=reason.lower())) from None


def _identifier(frame: Frame) -> str:
    digits = 8 if frame.can_id & EXTENDED else 3
    mark = " R" if frame.can_id & REMOTE else ""
    return f"{frame.can_id & _IDENTIFIER:0{digits}X}{mark}"


def _words(view: PdoView) -> list[dict[str, Any]]:
    """The words of a drive's PDO, with the values that they carry."""
    begins = [0, *accumulate(entry.bits for entry in view.codec.entries)]
    parts: list[dict[str, Any]] = []
    for (place, name), end in zip(view.words, view.ends, strict=True):
        entry = max(begin for begin in begins if begin < end)
        carried = [
            f"{codec.model.name} {codec.model.unit}".rstrip()
            for codec in view.values
            if place in codec.places
        ]
        part = {"from": max(entry, end - 16), "bits": end - max(entry, end - 16), "name": name}
        parts.append(part | ({"carries": carried} if carried else {}))
    return sorted(parts, key=lambda part: part["from"])


def _signals(view: DevicePdoView) -> list[dict[str, Any]]:
    """The entries of another node's PDO."""
    parts: list[dict[str, Any]] = []
    begin = 0
    for entry, signal in zip(view.codec.entries, view.signals, strict=True):
        if not entry.is_dummy:
            name = signal.name if signal else f"{entry.index:04X}:{entry.sub:02X}"
            parts.append({"from": begin, "bits": entry.bits, "name": name})
        begin += entry.bits
    return parts
