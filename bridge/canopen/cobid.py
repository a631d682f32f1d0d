"""COB-IDs of the pre-defined connection set (CiA 301 §7.3.3)."""

from __future__ import annotations

from typing import Final

NMT: Final = 0x000
SYNC: Final = 0x080
EMCY: Final = 0x080  # + node id
TIME: Final = 0x100
SDO_REPLY: Final = 0x580  # server to client, + node id
SDO_REQUEST: Final = 0x600  # client to server, + node id
ERROR_CONTROL: Final = 0x700  # boot-up, heartbeat, node guarding, + node id
RPDOS: Final = (0x200, 0x300, 0x400, 0x500)
"""RPDO1 … RPDO4, + node id."""

PDO_DISABLED: Final = 0x8000_0000
"""Bit 31 of a PDO's COB-ID entry: the PDO does not exist (CiA 301 §7.5.2.35)."""
NO_REMOTE: Final = 0x4000_0000
"""Bit 30 of a TPDO's COB-ID entry: it is not sent on a remote frame (CiA 301 §7.5.2.37)."""
PDO_EXTENDED: Final = 0x2000_0000
"""Bit 29: a 29-bit identifier."""
COB_ID_MASK: Final = 0x7FF


def is_for_emcy(can_id: int) -> bool:
    """Whether emergency messages may have this identifier (CiA 301 §7.3.5)."""
    return 0x081 <= can_id <= 0x0FF or is_for_pdos(can_id)


def is_for_pdos(can_id: int) -> bool:
    """Whether a PDO may have this identifier: not one of those with a fixed or restricted use (CiA 301
    §7.3.5)."""
    return 0x181 <= can_id <= 0x57F or 0x680 <= can_id <= 0x6DF
