"""What a family needs written for each drive at boot-up, such as its mode of operation."""

from __future__ import annotations

from bridge.canopen.pdo import MappingError
from bridge.command import Drive
from bridge.node.boot.actions import BootResult, Do
from bridge.node.boot.configuration import download
from bridge.node.boot.status import BootError


def write_start(drive: Drive, result: BootResult) -> Do:
    """Bring the objects of ``[[slot.start]]`` to their values, in order; only what differs is written.

    Raises MappingError where the node refuses: that is this drive's problem.
    """
    for start in drive.slot.start:
        try:
            written = yield from download(start.download(drive.sync_period_ms), result.memory)
        except BootError as error:
            raise MappingError(f"J: {error.detail}") from None
        if written and start.read_back:
            result.notes.append(
                f"{drive.slot.name}: {start.object} = {start.value_with(drive.sync_period_ms)}"
            )
