"""Errors that a node reports of itself, and the one remedy that is tried where they keep it from starting.

Objects 1001h and 1003h (CiA 301 §7.5.2.2, §7.5.2.4). A slave may keep a communication error, such as one SYNC
of a wrong length, and refuse *operational* until its communication is reset (1029h, CiA 301 §7.5.2.32).
"""

from __future__ import annotations

from typing import Final

from bridge.canopen import width
from bridge.command.node import Node
from bridge.mapping import emcy_codes
from bridge.node.boot.actions import (
    U8,
    U32,
    BootResult,
    BootStep,
    DeviceErrors,
    Do,
    Pause,
    ResetCommunication,
    wish,
)
from bridge.node.boot.error_status import BootError
from bridge.text import Said, Text

_REGISTER: Final = 0x1001
_HISTORY: Final = 0x1003
_MOST: Final = 4
"""Number of errors shown, the newest in 1003h."""
_LONGEST: Final = 4
_RESTARTS_S: Final = 2.0
"""Time in seconds within which a reset node sends its boot-up message; a slower one is booted when it
does."""


def read_errors(node: Node, result: BootResult) -> Do:
    """Read, note and show the error register, and the newest errors if there is one."""
    yield BootStep(Text.of("boot_step.errors"), "J")
    register = _number((yield from wish(result, _REGISTER)), U8)
    codes: list[int] = []
    count = _number((yield from wish(result, _HISTORY)), U8) if register else 0
    for sub in range(1, min(count, _MOST) + 1):
        error = yield from wish(result, _HISTORY, sub)
        if error is None:
            break
        # The low word is the code, the high one the manufacturer's.
        codes.append(_number(error, U32) & 0xFFFF)
    result.errors = DeviceErrors(register, tuple(codes), _text(node, register, codes))
    yield result.errors


def reset_once(node: Node, result: BootResult) -> Do:
    """Reset the communication of a node that did not start and has an error: once for each error, and not
    while a drive may be running."""
    errors, memory = result.errors, result.memory
    if not errors.register or node.table.on_failed_start != "reset_communication":
        return
    if not memory.may_reset_for(errors.cause):
        return
    memory.note_reset(errors.cause)
    yield BootStep(Text.of("boot_step.reset"), "J", needed_by="on_failed_start")
    yield ResetCommunication(Text.of("boot.did_not_start", errors=errors.said))
    # Its boot-up message ends this boot-up, and begins the next one.
    yield Pause(_RESTARTS_S)
    raise BootError("J", Text.of("boot.no_boot_up", errors=errors.said), absent=False)


def _number(data: bytes | None, size: int) -> int:
    """Number in an answer, 0 for an odd one: the node's errors are only shown."""
    return width.unsigned(data, size) if data and len(data) <= _LONGEST else 0


def _text(node: Node, register: int, codes: list[int]) -> Said:
    if not register:
        return ""
    bits = emcy_codes.register_text(register)
    if not codes:
        return Text.of("boot.error_register", register=register, bits=bits)
    named = tuple(Text.of("boot.kept_error", number=code, text=node.family.emcy.text(code)) for code in codes)
    return Text.of("boot.kept_errors", register=register, bits=bits, errors=named)
