"""Objects of a simulated drive that a site file may set."""

from __future__ import annotations

from bridge.base.errors import OperationFailed
from bridge.sim.core.dictionary import Dictionary, Number
from bridge.sim.core.sdo_abort import SdoAbort


def settable(objects: Dictionary, name: str, index: int, sub: int, what: str, is_command: bool) -> Number:
    """The object for a parameter called ``name``; ``what`` is the word for it. Raises ``OperationFailed`` for
    one that is not there, and for one that commands the drive or only tells."""
    try:
        entry = objects.find(index, sub)
    except SdoAbort:
        raise OperationFailed(f"{name}: the simulated drive has no such {what}") from None
    if not isinstance(entry, Number) or entry.write is None or is_command:
        raise OperationFailed(f"{name} of the simulated drive cannot be set")
    return entry


def put_in(entry: Number, name: str, value: float, wire: int) -> None:
    """Write ``wire`` to the object. Raises ``OperationFailed`` where the drive refuses it."""
    try:
        entry.download(entry.data_type.encode(wire))
    except SdoAbort as abort:
        raise OperationFailed(f"{name} = {value:g}: {abort}") from None
