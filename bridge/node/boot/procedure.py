"""Boot-up of one node as a generator (after CiA 302-2): it yields requests, gets answers and returns a
plan."""

from __future__ import annotations

from collections.abc import Sequence
from typing import Final

from bridge.canopen.nmt import NmtCommand, NmtState
from bridge.command.node import Node
from bridge.command.worst_case import takeover_ms
from bridge.config import NodeTable
from bridge.config.download import Download
from bridge.node.boot.actions import (
    Await,
    Boot,
    BootResult,
    BootSignal,
    BootStep,
    Do,
    Pause,
    SendNmt,
)
from bridge.node.boot.configuration_download import configure
from bridge.node.boot.device_errors import read_errors, reset_once
from bridge.node.boot.device_pdos import plan_device
from bridge.node.boot.device_watch import judge_outputs, read_held
from bridge.node.boot.drive_pdos import plan_drive, plan_node_tpdos, refuse_doubles
from bridge.node.boot.emcy_id import read_emcy_id
from bridge.node.boot.error_control_setup import set_error_control
from bridge.node.boot.error_status import BootError
from bridge.node.boot.identity import identify, look_for
from bridge.node.boot.memory import BootMemory
from bridge.node.boot.own_supervision_setup import set_own_supervision
from bridge.node.boot.rpdo_discovery import find_rpdos
from bridge.node.boot.scales import read_words
from bridge.node.boot.sdo_servers import open_sdo_servers
from bridge.text import Text

_GOES_OPERATIONAL_S: Final = 2.0
_SYNCS: Final = 2
"""SYNC periods that contain at least one SYNC, however late that is."""


def boot(node: Node, downloads: Sequence[Download] = (), memory: BootMemory | None = None) -> Boot:
    """Boot ``node``; returns what was learned.

    Raises BootError if the node is another device, cannot be configured or does not go operational, SdoError
    if it does not answer. ``downloads`` come before the tables of the site file. ``memory`` is that of the
    node's earlier boot-ups.
    """
    result = BootResult(memory=memory or BootMemory())
    # Outside Operational it takes no RPDO: so first stop its drives, then do what may fail.
    yield BootSignal.SEND_STOPPED
    device_type = yield from look_for()
    yield BootSignal.FOUND
    if result.memory.may_run:
        yield from find_rpdos(node, result)
        yield BootSignal.SEND_STOPPED
        if result.memory.waits_for_sync:
            needed_ms = [takeover_ms(node.bus, kind) for kind in result.memory.rpdo_types]
            yield Pause(max(_SYNCS * node.bus.sync_period_ms, *needed_ms) / 1000)
    yield SendNmt(NmtCommand.ENTER_PRE_OPERATIONAL)
    yield from identify(node, device_type, result)
    yield from read_errors(node, result)
    yield from reset_once(node, result)
    wanted = (*downloads, *(entry.download for entry in node.table.configure))
    yield from configure(wanted, store=node.table.configuration_store, result=result)
    yield from read_emcy_id(node.table.id, result)
    yield from open_sdo_servers(node, result)
    yield from set_error_control(node.table, result)
    for drive in node.drives:
        result.drives[drive.name] = yield from plan_drive(node, drive, result)
    refuse_doubles(result)
    yield from plan_node_tpdos(node, result)
    for device in node.devices:
        result.devices[device.name] = yield from plan_device(node, result)
        for outputs in device.commanded:
            yield from read_held(outputs.words, result)
            yield from judge_outputs(node, outputs, result)
    yield from set_own_supervision(node, result)
    yield BootStep(Text.of("boot_step.words"), "J")
    for drive in node.drives:
        result.words[drive.name] = yield from read_words(node, drive, result)
    yield from _start(node.table, result)
    result.memory.boot_succeeded()
    return result


def _start(table: NodeTable, result: BootResult) -> Do:
    """Start error control, then the node by NMT; its own messages confirm both. Raises BootError if they do
    not come."""
    not_heard = "F" if table.supervision == "guarding" else "K"
    what = Text.of("boot_step.wait", supervision=Text.word("supervision", table.supervision))
    yield BootStep(what, not_heard, needed_by="supervision")
    yield BootSignal.START_SUPERVISION
    # It says its state when it is asked, or every so often.
    limit_s = max(_GOES_OPERATIONAL_S, 3 * table.supervision_ms / 1000)
    yield Await(None, limit_s)
    yield BootSignal.AWAIT_RELEASE
    yield BootStep(Text.of("boot_step.start"), "J")
    yield SendNmt(NmtCommand.START)
    try:
        yield Await(NmtState.OPERATIONAL, limit_s)
    except BootError as error:
        result.memory.did_not_start = True
        what = error.what
        if result.errors.said:
            what = Text.of("boot.with_errors", what=what, errors=result.errors.said)
        raise BootError(error.letter, what, absent=error.absent) from None
