"""Texts for values that do not fit their data type: ``canopen`` has them in English only."""

from __future__ import annotations

from bridge.canopen.datatypes import INTEGERS, NUMBERS, DataTypeError, Misfit
from bridge.text import Text


def text_of_misfit(error: DataTypeError) -> Text:
    """The kind of value that the data type takes."""
    kind, value = error.kind, error.value
    match error.misfit:
        case Misfit.NO_BOOL:
            return Text.of("data_type.bool")
        case Misfit.NOT_WHOLE:
            return Text.of("data_type.whole_number", type=kind)
        case Misfit.NO_NUMBER:
            return Text.of("data_type.number", type=kind)
        case Misfit.NO_TEXT:
            return Text.of("data_type.text", type=kind)
        case Misfit.NO_BYTES:
            return Text.of("data_type.bytes")
        case Misfit.OUT_OF_RANGE:
            number = INTEGERS[kind]
            return Text.of("data_type.range", type=kind, low=number.low, high=number.high)
        case Misfit.TOO_LARGE:
            return Text.of("data_type.too_large", type=kind, value=str(value))
        case Misfit.NOT_LATIN:
            return Text.of("data_type.latin")
        case Misfit.TOO_SHORT:
            return Text.of("data_type.size", type=kind, size=NUMBERS[kind].size, count=int(value))
