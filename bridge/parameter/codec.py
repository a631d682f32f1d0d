"""Values of parameters and their bytes: value = wire × factor, little-endian (CiA 301 §7.1.4).

An object that no file describes is a whole number without sign of as many bytes as the node sends, or a
text where it sends another length.
"""

from __future__ import annotations

import math
from collections.abc import Iterator
from typing import Final

from bridge.base.data_type_texts import text_of_misfit
from bridge.canopen import datatypes, width
from bridge.canopen.datatypes import INTEGERS, NUMBERS, REALS, DataTypeError, Integer, Misfit
from bridge.image import Value
from bridge.image.limits import shown_range
from bridge.parameter.definition import ParameterEntry
from bridge.parameter.error import ParameterError, Why
from bridge.parameter.number_text import NumberError, command_line_number
from bridge.text import Text

_RAW_SIZES: Final = (1, 2, 4, 8)
_DIGITS: Final = 9
"""Behind the point: what a factor such as 0.01 makes of a whole number is that number of hundredths."""


def decode(entry: ParameterEntry, data: bytes) -> Value:
    """The value in ``data``. Raises ``ParameterError`` where the node has sent another type.

    Bytes beyond the type's are left out: some servers answer every read with four.
    """
    definition = entry.definition
    if definition is None:
        return _raw(data)
    kind = definition.data_type
    if kind in NUMBERS and len(data) < NUMBERS[kind].size:
        said = Text.of(
            "parameter.too_short",
            parameter=entry.name,
            type=kind,
            size=NUMBERS[kind].size,
            count=len(data),
            data=data.hex(" ").upper(),
        )
        raise ParameterError(Why.NOT_CONFIGURED, said)
    value = datatypes.decode(kind, data)
    if isinstance(value, str | bool) or (definition.factor == 1.0 and isinstance(value, int)):
        return value
    if isinstance(value, int):
        return round(value * definition.factor, _DIGITS)
    if not math.isfinite(value):
        raise ParameterError(Why.REFUSED, _of(entry, Text.of("parameter.no_number", value=str(value))))
    return value * definition.factor


def encode_value(entry: ParameterEntry, value: Value, held: bytes | None) -> bytes:
    """The bytes of ``value``, the nearest that the parameter can hold.

    ``held`` is what the drive holds now; for an object that no file describes it gives the length.
    Raises ``ParameterError`` with what the parameter takes.
    """
    definition = entry.definition
    if definition is None:
        return _encode_raw(entry, value, held)
    kind = definition.data_type
    try:
        if kind in ("string", "bytes", "bool"):
            return datatypes.encode(kind, value)
        number = _number(entry, value)
        if kind in REALS:
            _check_range(entry, number)
            return datatypes.encode(kind, number / definition.factor)
        # A number of 64 bits has more digits than a division leaves it.
        raw = round(number if definition.factor == 1.0 else number / definition.factor)
        if definition.factor == 1.0 and raw != number:
            raise _not_taken(entry, Text.of("takes.whole_numbers", value=str(value)))
        _check_range(entry, raw if definition.factor == 1.0 else round(raw * definition.factor, _DIGITS))
        if definition.is_enumeration and raw not in definition.states:
            raise _not_taken(entry, Text.of("takes.one_of", choices=_shown_states(entry)))
        return datatypes.encode(kind, raw)
    except DataTypeError as error:
        raise _misfit(entry, value, error) from None
    except OverflowError:  # an integer of more than 308 digits
        raise _misfit(entry, value, DataTypeError(Misfit.TOO_LARGE, kind, str(value))) from None


def matches(entry: ParameterEntry, held: bytes, wanted: bytes) -> bool:
    """Whether the drive holds what was to be written."""
    if entry.definition and entry.definition.data_type == "string":
        return datatypes.text(held) == datatypes.text(wanted)
    # Longer than any number: zeros behind it are no other value.
    padded = len(held) > width.LONGEST and held == wanted.ljust(len(held), b"\0")
    return padded or width.holds(held, wanted, signed=_is_signed(entry))


def forms(entry: ParameterEntry, data: bytes, held: bytes | None) -> Iterator[bytes]:
    """The bytes in which the drive may take a value, the likeliest first; ``held`` is its last answer."""
    if held is None or (entry.definition and entry.definition.data_type not in NUMBERS):
        return iter((data,))
    return width.forms(data, held, signed=_is_signed(entry))


def _is_signed(entry: ParameterEntry) -> bool:
    kind = entry.definition.data_type if entry.definition else ""
    return kind in INTEGERS and INTEGERS[kind].signed


def parse(entry: ParameterEntry, text: str) -> Value:
    """A value as it is typed on the command line. Raises ``ParameterError``; whether it is in range,
    ``encode_value`` says."""
    definition = entry.definition
    kind = definition.data_type if definition else ""
    if kind in ("string", "bytes"):
        return text
    bare = text.strip()
    if kind == "bool" and bare.lower() in ("0", "1", "false", "true"):
        return bare.lower() in ("1", "true")
    if definition and bare.lower() in (state.lower() for state in definition.states.values()):
        return bare
    try:
        return command_line_number(bare, is_code=not entry.unit)
    except NumberError as error:
        if definition is None and error.why == "no_number":
            return text
        if definition and (definition.states or kind == "bool"):
            given, choices = repr(text), _shown_states(entry)
            if not choices:
                raise _not_taken(entry, Text.of("takes.bool", value=given)) from None
            raise _not_taken(entry, Text.of("takes.choices", choices=choices, value=given)) from None
        raise ParameterError(Why.OUT_OF_RANGE, _of(entry, error.said)) from None


def check_raw(entry: ParameterEntry, value: Value) -> None:
    """Raises ``ParameterError`` where ``value`` is not bytes in hexadecimal that the parameter takes."""
    try:
        if not isinstance(value, str):
            raise DataTypeError(Misfit.NO_BYTES, "bytes", value)
        data = datatypes.encode("bytes", value)
    except DataTypeError as error:
        raise ParameterError(Why.OUT_OF_RANGE, _of(entry, text_of_misfit(error))) from None
    if entry.definition is not None:
        encode_value(entry, decode(entry, data), data)


def shown(entry: ParameterEntry, value: Value) -> str:
    """``1.03 s``, ``1 (automatic)``."""
    definition = entry.definition
    if definition is None or isinstance(value, str | bool):
        return str(value)
    text = f"{value:.{_DIGITS + 1}g}" if isinstance(value, float) else str(value)
    state = definition.states.get(int(value))
    return f"{text} ({state})" if state else f"{text} {definition.unit}".rstrip()


def _raw(data: bytes) -> Value:
    if len(data) in _RAW_SIZES:
        return int.from_bytes(data, "little")
    text = datatypes.text(data)
    return text if text.isprintable() else data.hex(" ").upper()


def _encode_raw(entry: ParameterEntry, value: Value, held: bytes | None) -> bytes:
    if isinstance(value, str):
        try:
            return datatypes.encode("string", value)
        except DataTypeError as error:
            raise ParameterError(Why.OUT_OF_RANGE, _of(entry, text_of_misfit(error))) from None
    whole = isinstance(value, bool | int) or value.is_integer()
    size = len(held) if held is not None else 0
    number = Integer(size, signed=value < 0) if size in _RAW_SIZES else None
    if number is None:
        raise _not_taken(entry, Text.of("takes.text", value=str(value)))
    if not whole or not number.low <= value <= number.high:
        raise _not_taken(entry, Text.of("takes.bytes", size=size, value=str(value)))
    return number.encode(int(value))


def _number(entry: ParameterEntry, value: Value) -> int | float:
    """``value`` as a number; the text of a state is taken for its code."""
    definition = entry.definition
    if isinstance(value, str) and definition:
        for code, state in definition.states.items():
            if state.lower() == value.strip().lower():
                return code
    if isinstance(value, bool | str):
        given, choices = repr(value), _shown_states(entry)
        if not choices:
            raise _not_taken(entry, Text.of("takes.number_not", value=given))
        raise _not_taken(entry, Text.of("takes.choices", choices=choices, value=given))
    if isinstance(value, float) and not math.isfinite(value):
        raise _not_taken(entry, Text.of("takes.finite_number"))
    return value


def _check_range(entry: ParameterEntry, number: int | float) -> None:
    definition = entry.definition
    if definition is None:
        return
    low, high = definition.low, definition.high
    if (low is not None and number < low) or (high is not None and number > high):
        allowed, unit, value = shown_range(low, high), definition.unit, f"{number:.10g}"
        if not unit:
            raise _not_taken(entry, Text.of("takes.range", range=allowed, value=value))
        raise _not_taken(entry, Text.of("takes.range_in", range=allowed, unit=unit, value=value))


def _shown_states(entry: ParameterEntry) -> tuple[str | Text, ...]:
    """Choices of a parameter with states, behind its range where they are only some of it."""
    definition = entry.definition
    if definition is None or not definition.states:
        return ()
    choices = tuple(f"{code} ({state})" for code, state in definition.states.items())
    return choices if definition.is_enumeration else (shown_range(definition.low, definition.high), *choices)


def _not_taken(entry: ParameterEntry, takes: Text) -> ParameterError:
    return ParameterError(Why.OUT_OF_RANGE, Text.of("value.of", name=entry.name, said=takes))


def _misfit(entry: ParameterEntry, value: Value, error: DataTypeError) -> ParameterError:
    why = text_of_misfit(error)
    said = Text.of("parameter.value_does_not_fit", parameter=entry.name, value=repr(value), why=why)
    return ParameterError(Why.OUT_OF_RANGE, said)


def _of(entry: ParameterEntry, what: Text) -> Text:
    return Text.of("parameter.of", owner=entry.name, what=what)
