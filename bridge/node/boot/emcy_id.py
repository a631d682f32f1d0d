"""COB-ID of the node's emergency messages: object 1014h (CiA 301)."""

from __future__ import annotations

from bridge.canopen import cobid
from bridge.node.boot.actions import BootResult, BootStep, Do, number, wish
from bridge.text import Text


def read_emcy_id(node_id: int, result: BootResult) -> Do:
    """Read the COB-ID. A node without the object uses 80h + node id; one that names an invalid one is noted,
    and taken to do the same."""
    default = cobid.EMCY + node_id
    result.emcy_id = default
    yield BootStep(Text.of("boot_step.emergency_id"), "J")
    value = number((yield from wish(result, 0x1014)), default)
    cob_id = value & cobid.COB_ID_MASK
    if value & cobid.PDO_DISABLED:  # bit 31 means the same here
        result.emcy_id = None
        result.notes.append(Text.of("boot.emergencies_off"))
    elif value & cobid.PDO_EXTENDED or not cobid.is_for_emcy(cob_id):
        result.notes.append(Text.of("boot.no_emergency_id", id=value))
    elif cob_id != default:
        result.emcy_id = cob_id
        result.notes.append(Text.of("boot.emergency_id", id=f"{cob_id:03X}h"))
