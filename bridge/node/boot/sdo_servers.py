"""Opening the node's further SDO servers, where the site file asks for them (CiA 301 §7.5.2.33)."""

from __future__ import annotations

from collections.abc import Generator
from functools import partial
from typing import Final

from bridge.base.sdo_texts import text_of
from bridge.canopen import cobid
from bridge.canopen.dialogue import SdoRead, SdoWrite, optional
from bridge.canopen.nmt import NmtCommand
from bridge.canopen.sdo import SdoError
from bridge.catalogue import NodeSpec
from bridge.command.node import Node
from bridge.mapping.model import SdoServer
from bridge.node.boot.actions import Action, BootResult, BootStep, Do, SendNmt, number, told_as
from bridge.node.boot.error_status import BootError
from bridge.node.places.sdo_channels import opened_servers
from bridge.text import Text

_PARAMETER: Final = 0x1200
_OFF: Final = cobid.PDO_DISABLED
"""Bit 31, as in a PDO's COB-ID."""
_COMPARED: Final = _OFF | cobid.COB_ID_MASK


def open_sdo_servers(node: Node | NodeSpec, result: BootResult) -> Do:
    """Bring 120xh:1 (to the node) and :2 (from the node) to the COB-IDs of the mapping file, switched on.

    Written only where they differ, and read back. Raises BootError J where the node refuses.
    """
    must_stop = False
    for server in opened_servers(node):
        yield BootStep(Text.of("boot_step.channel", channel=server.number), "J", needed_by="sdo_channels")
        with told_as(partial(_not_opened, server.number)):
            changed = yield from _open(server, node.table.id, result)
        must_stop = must_stop or (changed and server.after_stop)
    if must_stop:
        yield SendNmt(NmtCommand.STOP)
        yield SendNmt(NmtCommand.ENTER_PRE_OPERATIONAL)


def _not_opened(channel: int, error: SdoError) -> BootError:
    return BootError("J", Text.of("boot.channel_not_opened", channel=channel, why=text_of(error)))


def _open(server: SdoServer, node_id: int, result: BootResult) -> Generator[Action, bytes | None, bool]:
    """Open one server; True where something was changed."""
    index = _PARAMETER + server.number - 1
    changed = False
    for sub, base in ((1, server.request), (2, server.reply)):
        want = base + node_id
        have = number((yield from optional(index, sub)), _OFF)
        if have & _COMPARED == want:
            continue
        changed = True
        if not have & _OFF:  # a COB-ID that is in use does not change
            yield SdoWrite(index, sub, _bytes(have | _OFF))
        yield SdoWrite(index, sub, _bytes(want))
        kept = number((yield SdoRead(index, sub)))
        if kept & _COMPARED != want:
            name = f"{index:04X}h:{sub:02X}"
            raise BootError("J", Text.of("boot.id_not_kept", object=name, read=kept, wanted=want))
    if changed:
        ids = f"{server.request + node_id:03X}h/{server.reply + node_id:03X}h"
        result.notes.append(Text.of("boot.channel_opened", channel=server.number, ids=ids))
    return changed


def _bytes(value: int) -> bytes:
    return value.to_bytes(4, "little")
