"""How codes become objects: index = 5FFFh − code, sub-index = sub-code (EDS84DMOTCAN 3.0, §9.2.2)."""

from __future__ import annotations

from collections.abc import Callable, Collection

from bridge.sim.abort import AbortCode, SdoAbort
from bridge.sim.dictionary import DataType, Dictionary, Number, Text
from bridge.sim.lenze_settings import CODE_BASE

Values = Callable[[], list[int]]


class CodeTable:
    """Adds codes; ``number`` is that of the code; sub-code 0 means that it has none."""

    def __init__(self, dictionary: Dictionary) -> None:
        self._dictionary = dictionary

    def text(self, number: int, text: str) -> None:
        self._dictionary.add(CODE_BASE - number, 0, Text(text))

    def count(self, number: int, sub_codes: int) -> None:
        """Sub-index 0 of a code with sub-codes. The manual does not describe it; CiA 301 wants it."""
        self.add(number, 0, DataType.UNSIGNED8, lambda: sub_codes)

    def add(
        self,
        number: int,
        sub_code: int,
        data_type: DataType,
        read: Callable[[], int],
        write: Callable[[int], None] | None = None,
        limits: tuple[int, int] | None = None,
    ) -> None:
        low, high = limits or (None, None)
        self._dictionary.add(CODE_BASE - number, sub_code, Number(data_type, read, write, low, high))

    def choice(
        self,
        number: int,
        sub_code: int,
        read: Callable[[], int],
        write: Callable[[int], None],
        choices: Collection[int],
    ) -> None:
        """A code with a list to choose from."""

        def choose(value: int) -> None:
            if value not in choices:
                raise SdoAbort(AbortCode.VALUE_RANGE)
            write(value)

        self.add(number, sub_code, DataType.UNSIGNED8, read, choose)

    def displays(self, number: int, data_type: DataType, count: int, read: Callable[[int], int]) -> None:
        """Sub-codes 1…``count`` that can only be read; ``read`` counts from 0."""
        self.count(number, count)
        for place in range(count):
            self.add(number, place + 1, data_type, lambda place=place: read(place))

    def array(
        self,
        number: int,
        data_type: DataType,
        values: Values,
        limits: tuple[int, int],
        write: Callable[[int, int], None] | None = None,
    ) -> None:
        """Sub-codes from 1 on; ``write`` gets the place (from 0) and the value; without it the value is just
        stored."""

        def keep(place: int, value: int) -> None:
            values()[place] = value

        change = write or keep
        self.count(number, len(values()))
        for place in range(len(values())):
            self.add(
                number,
                place + 1,
                data_type,
                lambda place=place: values()[place],
                lambda value, place=place: change(place, value),
                limits,
            )
