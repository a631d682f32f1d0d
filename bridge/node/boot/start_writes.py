"""Objects that a family needs written for each drive at boot-up, such as its mode of operation."""

from __future__ import annotations

from bridge.command import Drive
from bridge.node.boot.actions import BootResult, Do
from bridge.node.boot.configuration_download import download
from bridge.node.boot.error_status import BootError
from bridge.node.boot.pdo_settings import NotTaken
from bridge.text import Text


def write_start(drive: Drive, result: BootResult) -> Do:
    """Bring the objects of ``[[slot.start]]`` to their values, in order; only what differs is written.

    Raises NotTaken where the node refuses: that is this drive's problem.
    """
    for start in drive.slot.start:
        try:
            written = yield from download(start.download(drive.sync_period_ms), result.memory)
        except BootError as error:
            raise NotTaken(error.what) from None
        if written and start.read_back:
            value = start.value_with(drive.sync_period_ms)
            note = Text.of("boot.started_with", slot=drive.slot.name, object=str(start.object), value=value)
            result.notes.append(note)
