"""Objects of codes: index = 5FFFh − code, sub-index = sub-code (EDS84DMOTCAN 3.0, §9.2.2)."""

from __future__ import annotations

from collections.abc import Callable, Collection
from dataclasses import replace
from functools import partial

from bridge.sim.core.dictionary import Dictionary, Entry, IntegerType, Number, item, variable
from bridge.sim.core.sdo_abort import AbortCode, SdoAbort
from bridge.sim.core.store import Store
from bridge.sim.lenze.lenze_settings import CODE_BASE, LenzeCodes

Values = Callable[[], list[int]]


class CodeTable:
    """Adds codes; ``number`` is that of the code; sub-code 0 means that it has none."""

    def __init__(self, dictionary: Dictionary, codes: Store[LenzeCodes]) -> None:
        self._dictionary = dictionary
        self._codes = codes

    def put(self, number: int, sub_code: int, entry: Entry) -> None:
        self._dictionary.add(CODE_BASE - number, sub_code, entry)

    def count(self, number: int, sub_codes: int) -> None:
        """Sub-index 0 of a code with sub-codes. The manual does not describe it; CiA 301 wants it."""
        self.add(number, 0, IntegerType.UNSIGNED8, lambda: sub_codes)

    def add(
        self,
        number: int,
        sub_code: int,
        data_type: IntegerType,
        read: Callable[[], int],
        write: Callable[[int], None] | None = None,
        limits: tuple[int, int] | None = None,
    ) -> None:
        low, high = limits or (None, None)
        self.put(number, sub_code, Number(data_type, read, write, low, high))

    def setting(
        self, number: int, sub_code: int, data_type: IntegerType, name: str, limits: tuple[int, int]
    ) -> None:
        """A code that is just stored, under ``name`` in ``LenzeCodes``."""
        self.put(number, sub_code, variable(data_type, lambda: self._codes.current, name, *limits))

    def choice(self, number: int, sub_code: int, entry: Number, choices: Collection[int]) -> None:
        """A code with a list to choose from."""
        write = entry.write

        def choose(value: int) -> None:
            if value not in choices or write is None:
                raise SdoAbort(AbortCode.VALUE_RANGE)
            write(value)

        self.put(number, sub_code, replace(entry, write=choose))

    def displays(self, number: int, data_type: IntegerType, count: int, read: Callable[[int], int]) -> None:
        """Sub-codes 1…``count`` that can only be read; ``read`` counts from 0."""
        self.count(number, count)
        for place in range(count):
            self.add(number, place + 1, data_type, lambda place=place: read(place))

    def array(
        self,
        number: int,
        data_type: IntegerType,
        values: Values,
        limits: tuple[int, int],
        write: Callable[[int, int], None] | None = None,
    ) -> None:
        """Sub-codes from 1 on; ``write`` gets the place (from 0) and the value; without it the value is just
        stored."""

        self.count(number, len(values()))
        for place in range(len(values())):
            entry = item(data_type, values, place, *limits)
            if write is not None:
                entry = replace(entry, write=partial(write, place))
            self.put(number, place + 1, entry)
