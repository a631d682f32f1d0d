"""LSS master (CiA 305): node ids and bit rates of devices that are identified by object 1018h.

Each service is a generator. It yields ``LssExchange``s and is sent the reply's eight bytes, or None if none
came in time; its return value is the result. Services that need a device in configuration state say so:
``switch_selective``, ``switch_global`` or ``fastscan`` come first.
"""

from __future__ import annotations

import struct
from collections.abc import Generator
from dataclasses import dataclass
from typing import Final, NamedTuple, TypeVar

REQUEST_ID: Final = 0x7E5
REPLY_ID: Final = 0x7E4
NO_NODE_ID: Final = 0xFF
"""The node id of a device that has none."""

BIT_RATES: Final = (1_000_000, 800_000, 500_000, 250_000, 125_000, None, 50_000, 20_000, 10_000)
"""Bit rates in bit/s by index in table 0 (CiA 305 §6.4.3; 5 is reserved)."""
AUTOMATIC: Final = 9

SWITCH_GLOBAL: Final = 0x04
NODE_ID: Final = 0x11
BIT_TIMING: Final = 0x13
ACTIVATE: Final = 0x15
STORE: Final = 0x17
SELECT: Final = (0x40, 0x41, 0x42, 0x43)
SELECTED: Final = 0x44
IDENTIFIED: Final = 0x4F
"""Reply of every device that matches a fastscan query."""
FASTSCAN: Final = 0x51
INQUIRE: Final = (0x5A, 0x5B, 0x5C, 0x5D)
INQUIRE_NODE_ID: Final = 0x5E
CONFIRM: Final = 0x80

FIELDS: Final = ("vendor id", "product code", "revision number", "serial number")
_SERIAL: Final = 3
U32: Final = struct.Struct("<I")
U16: Final = struct.Struct("<H")
QUESTION: Final = struct.Struct("<IBBB")
"""Question of a fastscan: number, lowest bit that is compared, field, next field (CiA 305 §6.7)."""
_STANDARD_ERRORS: Final = {
    NODE_ID: {1: "a node id must be 1…127 or 255"},
    BIT_TIMING: {1: "this bit rate is not supported"},
    STORE: {1: "the device cannot store", 2: "access to its memory failed"},
}


class LssError(Exception):
    """A device refused a request, or did not answer."""


class LssAddress(NamedTuple):
    """Object 1018h: the LSS address."""

    vendor: int
    product: int
    revision: int
    serial: int


@dataclass(frozen=True, slots=True)
class LssExchange:
    """One request, empty if nothing is sent; ``reply`` is the command specifier of the expected answer, None
    if there is none.

    ``step`` says in words what is being done. ``fails`` false: silence is an answer, too. ``by_many``: any
    number of devices may answer, or be late with an earlier answer, so the whole time is waited lest that be
    taken for an answer to the next request.
    """

    request: bytes
    reply: int | None
    step: str
    fails: bool = True
    by_many: bool = False
    is_first: bool = False
    """The first query of a scan: how fast the devices answer is not known yet."""


_R = TypeVar("_R")
Service = Generator[LssExchange, bytes | None, _R]


def _message(command: int, rest: bytes = b"") -> bytes:
    return bytes((command,)) + rest.ljust(7, b"\0")


def settle() -> Service[None]:
    """Send nothing for a whole answer time, so that late answers are not taken for those of the next
    query."""
    yield LssExchange(b"", None, "waiting for late answers", by_many=True)


def switch_global(*, configuration: bool) -> Service[None]:
    """Switch all devices to configuration or waiting state; none answers."""
    name = "configuration" if configuration else "waiting"
    yield LssExchange(_message(SWITCH_GLOBAL, bytes((configuration,))), None, f"all devices to {name} state")


def to_waiting() -> Service[None]:
    """Switch all devices to waiting state."""
    return switch_global(configuration=False)


def switch_selective(identity: LssAddress) -> Service[None]:
    """Switch the device with this identity to configuration state. Raises LssError if there is none."""
    for command, value, name in zip(SELECT, identity, FIELDS, strict=True):
        last = command == SELECT[-1]
        reply = SELECTED if last else None
        answer = yield LssExchange(
            _message(command, U32.pack(value)), reply, f"selecting by {name}", fails=False
        )
        if last and answer is None:
            raise LssError("no device has this identity, or it does not know LSS")


def inquire_identity() -> Service[LssAddress]:
    """The identity of the device in configuration state; several would answer at once."""
    values: list[int] = []
    for command, name in zip(INQUIRE, FIELDS, strict=True):
        answer = yield LssExchange(_message(command), command, f"asking for its {name}")
        values.append(U32.unpack_from(answer or bytes(8), 1)[0])
    return LssAddress(*values)


def inquire_node_id() -> Service[int]:
    """Present node id of the device, ``NO_NODE_ID`` if it has none."""
    answer = yield LssExchange(_message(INQUIRE_NODE_ID), INQUIRE_NODE_ID, "asking for its node id")
    return answer[1] if answer else NO_NODE_ID


def configure_node_id(node_id: int) -> Service[None]:
    """Set its node id, 1…127 or ``NO_NODE_ID``, valid from its next reset communication."""
    answer = yield LssExchange(_message(NODE_ID, bytes((node_id,))), NODE_ID, f"setting node id {node_id}")
    _check(answer)


def configure_bit_rate(bit_rate: int | None) -> Service[None]:
    """Set its bit rate in bit/s, valid after activation or its next start; None: automatic detection."""
    index = AUTOMATIC if bit_rate is None else BIT_RATES.index(bit_rate)
    step = "setting automatic bit rate" if bit_rate is None else f"setting {bit_rate} bit/s"
    answer = yield LssExchange(_message(BIT_TIMING, bytes((0, index))), BIT_TIMING, step)
    _check(answer)


def activate_bit_rate(delay_ms: int) -> Service[None]:
    """All devices in configuration state change their bit rate: they are silent for ``delay_ms``, switch, and
    are silent for as long again. None answers."""
    request = _message(ACTIVATE, U16.pack(delay_ms))
    yield LssExchange(request, None, f"activating the bit rate within {delay_ms} ms")


def store() -> Service[None]:
    """Save node id and bit rate in the device's non-volatile memory."""
    answer = yield LssExchange(_message(STORE), STORE, "storing")
    _check(answer)


def _check(answer: bytes | None) -> None:
    """Raises LssError if a configuration service was refused."""
    if answer and (text := error_text(answer)):
        raise LssError(f"the device refused: {text}")


def error_text(answer: bytes) -> str:
    """The error of a configuration service in words, empty if there is none."""
    if answer[1] == 0xFF:
        return f"its own error {answer[2]}"
    default = f"error {answer[1]}" if answer[1] else ""
    return _STANDARD_ERRORS.get(answer[0], {}).get(answer[1], default)


def is_anybody_there(*, is_first: bool = False) -> Service[bool]:
    """Begin a scan: whether any device without a node id answers. All start at the vendor id."""
    request = QUESTION.pack(0, CONFIRM, 0, 0)
    return (yield _question(request, "is anybody there?", is_first=is_first)) is not None


def answers_everything() -> Service[bool]:
    """Right after the beginning of a scan: whether a device answers queries that none should answer yet, for
    both values of a serial number's first bit. CANopenNode does, once it has been found and is in
    configuration state."""
    for value in (0, 1 << 31):
        request = QUESTION.pack(value, 31, _SERIAL, _SERIAL)
        if (yield _question(request, "does somebody answer everything?")) is None:
            return False
    return True


def fastscan(known: LssAddress | None = None) -> Service[LssAddress]:
    """After ``is_anybody_there``: find one of the devices and leave it in configuration state (CiA 305 §6.7).

    Each of the 132 queries takes a whole reply time. ``known`` has the fields that are the same for all
    devices (not 0). Raises LssError if no device confirms what was found.
    """
    found: list[int] = []
    for sub, name in enumerate(FIELDS):
        value = known[sub] if known else 0
        if not value:
            value = yield from _find_number(sub)
        if not (yield from enter(sub, value)):
            raise LssError(f"a device answered and confirmed no {name} {value:08X}h: allow it more time")
        found.append(value)
    return LssAddress(*found)


def enter(sub: int, value: int) -> Service[bool]:
    """Devices whose field ``sub`` is ``value`` go on to the next field, and after the last to configuration
    state. False: there are none."""
    request = QUESTION.pack(value, 0, sub, (sub + 1) % len(FIELDS))
    return (yield _question(request, f"{FIELDS[sub]} is {value:08X}h")) is not None


def has(sub: int, value: int, bit: int = 0) -> Service[bool]:
    """Whether a device that is at field ``sub`` has this ``value`` there, from ``bit`` upwards. It stays at
    that field."""
    request = QUESTION.pack(value, bit, sub, sub)
    return (yield _question(request, f"{FIELDS[sub]}, bit {bit}")) is not None


def _question(request: bytes, step: str, *, is_first: bool = False) -> LssExchange:
    message = _message(FASTSCAN, request)
    return LssExchange(message, IDENTIFIED, step, fails=False, by_many=True, is_first=is_first)


def _find_number(sub: int) -> Service[int]:
    value = 0
    for bit in range(31, -1, -1):
        if not (yield from has(sub, value, bit)):
            value |= 1 << bit
    return value
