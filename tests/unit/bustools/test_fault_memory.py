"""Fault memory of a drive, read as a list, as far as it has one."""

from __future__ import annotations

from collections.abc import Callable

import pytest

from bridge.bustools.fault_memory import Remembered, fault_memory
from bridge.drive import FaultWords
from bridge.mapping import load_family
from bridge.parameter import DriveParameters, Ledger, Names, ParameterError, TransferFailed
from bridge.sim.catalogue import simulate_node
from bridge.sim.core.sdo_abort import SdoAbort
from bridge.text import Text
from tests.unit.sim.conftest import Bench

Answers = Callable[[int, int], bytes]


def asked(mapping: str, answers: Answers) -> list[Remembered]:
    family = load_family(mapping)
    access = DriveParameters("node/drive", "node", family, Names(family), Ledger())
    steps = fault_memory(access, family, FaultWords(family), 0.0)
    try:
        transfer = next(steps)
        while True:
            try:
                data = answers(transfer.address.index, transfer.address.sub)
            except SdoAbort as abort:
                transfer = steps.throw(TransferFailed(Text.plain("refused"), abort.code, by_drive=True))
            except TimeoutError:
                transfer = steps.throw(TransferFailed(Text.plain("no answer"), 0, by_drive=False))
            else:
                transfer = steps.send((data, 0.0))
    except StopIteration as end:
        return end.value


def of(mapping: str, happens: Callable[[Bench], None]) -> list[tuple[str, str, int | None]]:
    bench = Bench(simulate_node(mapping, 5, {}))
    bench.nmt(1)
    bench.run(2.0)
    happens(bench)
    bench.run(2.0)

    def answers(index: int, sub: int) -> bytes:
        low, high = index & 0xFF, index >> 8
        answer = bytes.fromhex(bench.sdo(f"40{low:02x}{high:02x}{sub:02x}00000000"))
        if answer[0] == 0x80:
            raise SdoAbort(int.from_bytes(answer[4:], "little"))
        return answer[4 : 8 - (answer[0] >> 2 & 3)]

    return [(one.where, str(one.explained), one.information) for one in asked(mapping, answers)]


def test_a_lenze_has_ten_errors_in_1003h() -> None:
    """EDS84DMOTCAN 3.0 §13, I-1003: a code and 16 bits of the maker's; no time."""

    def happens(bench: Bench) -> None:
        for _ in range(12):
            bench.put(0x205, "00")  # PDO too short, §10.4
            bench.run(1.0)
            bench.put(0x205, "0000000000000000")
            bench.run(1.0)
        bench.node.fail(0x047F_0002)

    found = of("lenze/8400-motec", happens)
    assert found[0] == ("C00168", "01.0127.00002 CE04: communication error of the MCI", None)
    assert [where for where, _, _ in found[1:]] == sorted(where for where, _, _ in found[1:])
    assert len(found) == 1 + 10
    assert found[1][1].startswith("F000h error of the drive unit")
    assert any(text == "8210h PDO shorter than expected" for _, text, _ in found)


def test_a_nord_has_its_last_five_faults_and_the_list_of_its_interface() -> None:
    def happens(bench: Bench) -> None:
        for tenths in (30, 20, 51):
            bench.node.fail_drive(1, tenths)
            bench.run(0.5)
            bench.command(0x047E)
            bench.command(0x04FE)
            bench.run(0.5)
        bench.node.fail_drive(1, 101)

    found = of("nord/sk-tu4-cao", happens)
    texts = {where: text for where, text, _ in found}
    assert texts["P700[1]"].startswith("E010/10.1 ")
    assert [texts[f"P701[{n}]"].split()[0] for n in range(1, 5)] == [
        *("E010/10.1", "E005/5.1", "E002/2.0", "E003/3.0")
    ]
    assert texts["1003:01"].startswith("8100h ")


def test_a_drive_without_a_list_tells_its_event() -> None:
    """ID 441684.06 §11.1 has no 1003h."""
    assert of("stoeber/5000", lambda bench: bench.node.fail(41, 2)) == [
        ("E82", "41 temperature of the motor, sensor", None)
    ]
    assert of("stoeber/5000", lambda bench: None) == []


@pytest.mark.parametrize("silent", [0x1003, 0x22BC])
def test_a_drive_that_does_not_answer_is_said(silent: int) -> None:
    def answers(index: int, sub: int) -> bytes:
        if index == silent:
            raise TimeoutError
        return bytes(2)

    with pytest.raises(ParameterError, match="no answer"):
        asked("nord/sk-tu4-cao", answers)
