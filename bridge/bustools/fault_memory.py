"""Fault memory of a drive: the numbers that it keeps itself, and the error list of its node, 1003h (CiA 301
§7.5.2.4)."""

from __future__ import annotations

from collections.abc import Generator
from dataclasses import dataclass
from typing import Final

from bridge.canopen import width
from bridge.drive import Explained, FaultWords
from bridge.mapping.model import Family, ObjectRef
from bridge.parameter import DriveParameters, ParameterEntry, ParameterError, Transfer, TransferFailed, Why
from bridge.text import Text

_HISTORY: Final = 0x1003
_MOST: Final = 254
_WORD: Final = 0xFFFF


@dataclass(frozen=True, slots=True)
class Remembered:
    """One remembered fault. ``where`` is a parameter such as P701[1], or the entry of 1003h, which has 16
    bits of the maker's beside the code: ``information``."""

    where: str
    explained: Explained
    information: int | None = None


Asks = Generator[Transfer, tuple[bytes, float], list[Remembered]]


def fault_memory(access: DriveParameters, family: Family, words: FaultWords, now: float) -> Asks:
    """Read the fault memory of a drive, each list with the newest first. Lists that it does not have are left
    out. Raises ``ParameterError`` where it does not answer."""
    found: list[Remembered] = []
    event = family.emcy.event
    for entry in fault_parameters(access, family):
        try:
            reading = yield from access.read(entry, now)
        except ParameterError as error:
            if not error.abort_code:
                raise
            continue
        value = float(reading.value) if not isinstance(reading.value, str) else 0.0
        if value and not (event and value == event.gone):
            found.append(Remembered(entry.name, words.of_drive(value)))
    return found + (yield from _history(words))


def fault_parameters(access: DriveParameters, family: Family) -> list[ParameterEntry]:
    """The parameter with the present fault, and the last one with what stands beside it in its array."""
    faults = family.faults
    found = [access.names.resolve(faults.current.parameter)] if faults.current else []
    if faults.last:
        last = access.names.resolve(faults.last.parameter)
        found += [one for one in access.names.entries() if one.address.index == last.address.index]
    return found


def _history(words: FaultWords) -> Asks:
    found: list[Remembered] = []
    try:
        data, _ = yield Transfer(ObjectRef(_HISTORY, 0), of_node=True)
        for sub in range(1, min(_number(data, 1), _MOST) + 1):
            data, _ = yield Transfer(ObjectRef(_HISTORY, sub), of_node=True)
            number = _number(data, 4)
            if number & _WORD:
                found.append(
                    Remembered(f"1003:{sub:02X}", words.of_code(number & _WORD), number >> 16 & _WORD)
                )
    except TransferFailed as failure:
        if not failure.by_drive:
            said = Text.of("parameter.of", owner="1003h", what=failure.said)
            raise ParameterError(Why.NO_ANSWER, said) from None
    return found


def _number(data: bytes, size: int) -> int:
    return width.unsigned(data, size)
