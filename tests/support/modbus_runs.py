"""Rows of a Modbus map as a tool reads them: neighbours in one request."""

from __future__ import annotations

from collections.abc import Iterable, Iterator
from dataclasses import dataclass
from itertools import groupby
from typing import Final

from bridge.northbound.modbus.registers import RegisterTable, Row

FUNCTIONS: Final = {
    RegisterTable.COIL: 1,
    RegisterTable.DISCRETE_INPUT: 2,
    RegisterTable.HOLDING_REGISTER: 3,
    RegisterTable.INPUT_REGISTER: 4,
}
_MOST: Final = {RegisterTable.COIL: 2000, RegisterTable.DISCRETE_INPUT: 2000}
_MOST_REGISTERS: Final = 124
"""Registers of one request: 125, and an even number for values of two registers."""


@dataclass(frozen=True, slots=True)
class Run:
    """Rows of one table that follow each other without a gap."""

    table: RegisterTable
    rows: tuple[Row, ...]

    @property
    def function(self) -> int:
        return FUNCTIONS[self.table]

    @property
    def start(self) -> int:
        return self.rows[0].address

    @property
    def count(self) -> int:
        return self.rows[-1].address + self.rows[-1].size - self.start


def runs_of(rows: Iterable[Row]) -> Iterator[Run]:
    """Every maximal run, as long as one request may be."""
    ordered = sorted(rows, key=lambda row: (row.table, row.address))
    for table, of_table in groupby(ordered, lambda row: row.table):
        run: list[Row] = []
        for row in of_table:
            end = run[-1].address + run[-1].size if run else row.address
            most = _MOST.get(table, _MOST_REGISTERS)
            if run and (row.address != end or row.address + row.size - run[0].address > most):
                yield Run(table, tuple(run))
                run = []
            run.append(row)
        if run:
            yield Run(table, tuple(run))
