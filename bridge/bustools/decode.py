"""Meaning of the frames on a CANopen bus, for ``monitor``: COB-ID, contents, drive words. Sans-IO.

COB-IDs are those of the pre-defined connection set (CiA 301 §7.3.3) and, for the nodes of a site,
those of their mapping files. Nothing is asked of anybody: a node that has been given other COB-IDs or
another mapping is shown as if it had not.
"""

from __future__ import annotations

from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass
from datetime import UTC, datetime, timedelta
from enum import StrEnum
from typing import Final

from bridge.bustools.decode_device import DevicePdoView
from bridge.bustools.decode_pdo import PdoView
from bridge.bustools.pdo_views import pdo_views
from bridge.canopen import cobid, decode_lss, emcy, lss, nmt, time_stamp
from bridge.canopen.decode_sdo import SdoListener, Value
from bridge.canopen.frame import EXTENDED, REMOTE, STANDARD_MASK, Frame
from bridge.canopen.nmt import NmtState
from bridge.config import NodeTable
from bridge.drive import EmergencyReader
from bridge.eds import Description
from bridge.mapping import emcy_codes
from bridge.mapping.model import Family

_EPOCH: Final = datetime(1970, 1, 1, tzinfo=UTC)
_LSS: Final = {lss.REPLY_ID: "LSS slave", lss.REQUEST_ID: "LSS master"}
_PDOS: Final = {
    0x180: "TPDO1",
    0x200: "RPDO1",
    0x280: "TPDO2",
    0x300: "RPDO2",
    0x380: "TPDO3",
    0x400: "RPDO3",
    0x480: "TPDO4",
    0x500: "RPDO4",
}


_OTHERS: Final = (
    (0x001, 0x001, "global fail-safe command"),
    (0x071, 0x076, "flying master"),
    (0x101, 0x180, "SRDO"),
    (0x6E0, 0x6E0, "SDO manager"),
)
"""First and last COB-ID of services that the bridge has no part in (CiA 301 §7.3.5)."""


class FrameKind(StrEnum):
    NMT = "nmt"
    SYNC = "sync"
    TIME = "time"
    EMCY = "emcy"
    PDO = "pdo"
    SDO = "sdo"
    HEARTBEAT = "heartbeat"
    """Boot-up, heartbeat and node guarding."""
    LSS = "lss"
    OTHER = "other"


@dataclass(frozen=True, slots=True)
class FrameMeaning:
    """Meaning of one frame. ``node`` is the node id that it is about, 0 for all or none; ``label`` the name
    of its COB-ID; ``values`` the facts by name, for scripts."""

    kind: FrameKind
    node: int
    label: str
    text: str
    values: tuple[tuple[str, Value | float], ...] = ()


class Decoder:
    """Decodes the frames of one bus, given in the order of the wire."""

    def __init__(
        self,
        nodes: Sequence[NodeTable] = (),
        families: Mapping[str, Family] | None = None,
        own_id: int | None = None,
        descriptions: Mapping[str, Description] | None = None,
    ) -> None:
        """``nodes`` with their ``families`` are those of a site, where there is one; ``own_id`` is the
        address that the bridge of this site has on the bus. ``descriptions`` are those of mappings that say
        nothing of PDOs: of nodes that are no drives."""
        self._names: dict[int, str] = {} if own_id is None else {own_id: "the bridge"}
        self._families: dict[int, Family] = {}
        self._pdos: dict[int, PdoView | DevicePdoView] = {}
        self._sdo: dict[int, SdoListener] = {}
        for node in nodes:
            self._names[node.id] = node.name
            family = (families or {}).get(node.mapping_key)
            if family:
                self._families[node.id] = family
                self._pdos.update(pdo_views(node, family, (descriptions or {}).get(node.mapping_key)))

    def decode(self, frame: Frame) -> FrameMeaning:
        """Meaning of ``frame``; every frame has one."""
        cob_id = frame.can_id & STANDARD_MASK
        if frame.can_id & EXTENDED:
            return FrameMeaning(FrameKind.OTHER, 0, "29-bit", frame.data.hex(" ").upper())
        if frame.can_id & REMOTE:
            return self._remote(cob_id)
        view = self._pdos.get(cob_id)
        if view is not None:
            text, values = view.said(frame.data)
            return FrameMeaning(FrameKind.PDO, view.node_id, view.label, text, values)
        if cob_id == cobid.NMT:
            return self._nmt(frame.data)
        if cob_id == cobid.SYNC:
            return _sync(frame.data)
        if cob_id == cobid.TIME:
            return _time(frame.data)
        if cob_id in _LSS:
            return _lss(cob_id, frame.data)
        return self._of_node(cob_id & ~0x7F, cob_id & 0x7F, frame.data)

    def tpdo_bytes(self, cob_id: int) -> int | None:
        """Length of a TPDO in bytes by the mapping file; None for identifiers that are none of the site's."""
        view = self._pdos.get(cob_id)
        return view.codec.length if view is not None and view.label.startswith("TPDO") else None

    def rpdos(self) -> dict[int, str]:
        """Labels of the RPDOs of the site's drives, by COB-ID."""
        return {can_id: view.label for can_id, view in self._pdos.items() if view.label.startswith("RPDO")}

    def name(self, node_id: int) -> str:
        """The node as the site calls it, or its address."""
        return self._names.get(node_id, f"node {node_id}")

    def _of_node(self, base: int, node_id: int, data: bytes) -> FrameMeaning:
        """A COB-ID of the pre-defined connection set: function code and node id."""
        decoders: dict[int, Callable[[int, bytes], FrameMeaning]] = {
            cobid.EMCY: self._emcy,
            cobid.SDO_REPLY: self._sdo_reply,
            cobid.SDO_REQUEST: self._sdo_request,
            cobid.ERROR_CONTROL: self._error_control,
        }
        if node_id and base in decoders:
            return decoders[base](node_id, data)
        raw = data.hex(" ").upper()
        if node_id and base in _PDOS:
            return FrameMeaning(FrameKind.PDO, node_id, f"{_PDOS[base]} {self.name(node_id)}", raw)
        for first, last, label in _OTHERS:
            if first <= base + node_id <= last:
                return FrameMeaning(
                    FrameKind.OTHER, 0, label, f"{raw} (the bridge has no part in it)".lstrip()
                )
        return FrameMeaning(FrameKind.OTHER, 0, "unknown", raw)

    def _remote(self, cob_id: int) -> FrameMeaning:
        base, node_id = cob_id & ~0x7F, cob_id & 0x7F
        if base == cobid.ERROR_CONTROL and node_id:
            return FrameMeaning(
                FrameKind.HEARTBEAT, node_id, f"guarding {self.name(node_id)}", "asked for its NMT state"
            )
        view, asked = self._pdos.get(cob_id), "asked for by remote frame"
        if view is not None:
            return FrameMeaning(FrameKind.PDO, view.node_id, view.label, asked)
        if base in _PDOS and node_id:
            return FrameMeaning(FrameKind.PDO, node_id, f"{_PDOS[base]} {self.name(node_id)}", asked)
        return FrameMeaning(FrameKind.OTHER, 0, "remote frame", "asked for")

    def _nmt(self, data: bytes) -> FrameMeaning:
        if len(data) != 2:
            return FrameMeaning(FrameKind.NMT, 0, "NMT", f"{len(data)} bytes instead of 2")
        target = "all nodes" if data[1] == 0 else self.name(data[1])
        command = nmt.command_name(data[0])
        return FrameMeaning(FrameKind.NMT, data[1], "NMT", f"{command}: {target}", (("command", command),))

    def _emcy(self, node_id: int, data: bytes) -> FrameMeaning:
        label = f"EMCY {self.name(node_id)}"
        found = emcy.decode(data)
        if found is None:
            return FrameMeaning(FrameKind.EMCY, node_id, label, f"{len(data)} bytes are no emergency message")
        family = self._families.get(node_id)
        if family:
            text = EmergencyReader(family).read(found.code, found.vendor).text
        else:
            text = str(emcy_codes.text(found.code))
        vendor = found.vendor.hex(" ").upper()
        values = (
            ("code", f"{found.code:04X}"),
            ("register", found.register),
            ("vendor", vendor),
            ("text", text),
        )
        drive = self._emcy_drive(family, data)
        sentence = f"{found.code:04X}h {text}{drive}, register {found.register:02X}h, {vendor}"
        return FrameMeaning(FrameKind.EMCY, node_id, label, sentence, values)

    @staticmethod
    def _emcy_drive(family: Family | None, data: bytes) -> str:
        """Drive of the node that an emergency message is about, where the family has a byte for it."""
        byte = family.emcy.drive_byte if family else None
        if family is None or byte is None or byte >= len(data):
            return ""
        slots = [slot.name for slot in family.slot if slot.emcy_drive == data[byte]]
        return f" ({slots[0]})" if slots else ""

    def _sdo_request(self, node_id: int, data: bytes) -> FrameMeaning:
        said = self._sdo.setdefault(node_id, SdoListener()).request(data)
        return FrameMeaning(FrameKind.SDO, node_id, f"SDO → {self.name(node_id)}", said.text, said.values)

    def _sdo_reply(self, node_id: int, data: bytes) -> FrameMeaning:
        said = self._sdo.setdefault(node_id, SdoListener()).reply(data)
        return FrameMeaning(FrameKind.SDO, node_id, f"SDO ← {self.name(node_id)}", said.text, said.values)

    def _error_control(self, node_id: int, data: bytes) -> FrameMeaning:
        name = self.name(node_id)
        if len(data) != 1:
            return FrameMeaning(
                FrameKind.HEARTBEAT, node_id, f"heartbeat {name}", f"{len(data)} bytes instead of 1"
            )
        state = nmt.state_of(data[0])
        if state is NmtState.INITIALISING:
            return FrameMeaning(
                FrameKind.HEARTBEAT, node_id, f"boot-up {name}", "has started", (("nmt_state", "boot_up"),)
            )
        is_known = state is not NmtState.UNKNOWN
        text = state.label.replace("_", " ") if is_known else f"unknown state {data[0]:02X}h"
        toggle = ", toggle bit 1" if data[0] & 0x80 else ""
        return FrameMeaning(
            FrameKind.HEARTBEAT, node_id, f"heartbeat {name}", text + toggle, (("nmt_state", state.label),)
        )


def _sync(data: bytes) -> FrameMeaning:
    if not data:
        return FrameMeaning(FrameKind.SYNC, 0, "SYNC", "")
    return FrameMeaning(FrameKind.SYNC, 0, "SYNC", f"counter {data[0]}", (("counter", data[0]),))


def _time(data: bytes) -> FrameMeaning:
    epoch_ms = time_stamp.decode(data)
    if epoch_ms is None:
        return FrameMeaning(FrameKind.TIME, 0, "TIME", f"{len(data)} bytes instead of 6")
    moment = _EPOCH + timedelta(milliseconds=epoch_ms)
    # Whose time zone it is, the message does not say.
    text = moment.replace(tzinfo=None).isoformat(" ", "milliseconds")
    return FrameMeaning(FrameKind.TIME, 0, "TIME", text, (("time", text),))


def _lss(cob_id: int, data: bytes) -> FrameMeaning:
    text, values = decode_lss.said(data, by_master=cob_id == lss.REQUEST_ID)
    return FrameMeaning(FrameKind.LSS, 0, _LSS[cob_id], text, values)
