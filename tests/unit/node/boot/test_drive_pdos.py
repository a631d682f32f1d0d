"""The boot-up against nodes that answer oddly: told in ``boot_status``, never an exception, never a
process datum on an identifier that belongs to something else."""

from __future__ import annotations

import struct
from pathlib import Path

import pytest

from bridge.canopen.sdo import SdoError
from bridge.catalogue import Catalogue
from bridge.command import Plant
from bridge.node import boot
from bridge.text import render
from tests.support.bench import NORD, write_site

NOT_THERE = 0x0602_0000
Answers = dict[tuple[int, int], bytes]


def u32(value: int) -> bytes:
    return struct.pack("<I", value)


def good() -> Answers:
    """A node with the factory mapping of FU1 and FU2."""
    answers: Answers = {(0x1000, 0): u32(0x00010192), (0x1017, 0): b"\x00\x00"}
    for number in (1, 2):
        entries = {0x1600: (0x3000, 0x3002), 0x1A00: (0x3001, 0x3003)}
        for base, (word, value) in entries.items():
            mapping = base + number - 1
            answers[mapping, 0] = b"\x04"
            answers[mapping, 1] = u32(word << 16 | number << 8 | 16)
            for n in (1, 2, 3):
                answers[mapping, n + 1] = u32(value << 16 | (3 * (number - 1) + n) << 8 | 16)
        answers[0x1400 + number - 1, 1] = u32((0x100, 0x200, 0x300)[number] + 5)
        answers[0x1800 + number - 1, 1] = u32((0x080, 0x180, 0x280)[number] + 5)
    return answers


def run(folder: Path, answers: Answers) -> boot.BootResult:
    plant = Plant(Catalogue.of(write_site(folder), {"nord/sk-tu4-cao": NORD}), "0")
    generator = boot.boot(plant.nodes["conveyor"])
    try:
        action = next(generator)
        while True:
            if not isinstance(action, boot.SdoRead):
                if isinstance(action, boot.SdoWrite):
                    answers[action.index, action.sub] = action.data
                action = generator.send(None)
            elif (action.index, action.sub) in answers:
                action = generator.send(answers[action.index, action.sub])
            else:
                error = SdoError(action.index, action.sub, NOT_THERE, by_server=True)
                action = generator.throw(error)
    except StopIteration as end:
        return end.value


def test_a_good_node_has_a_plan_for_each_drive(tmp_path: Path) -> None:
    result = run(tmp_path, good())
    assert [plan.problem for plan in result.drives.values()] == ["", ""]


@pytest.mark.landing(18)
@pytest.mark.parametrize("cob_id", [0x000, 0x080, 0x085, 0x100, 0x585, 0x605, 0x705, 0x7E5, 0x2000_0205])
@pytest.mark.parametrize("parameter", [0x1400, 0x1800])
def test_an_identifier_that_belongs_to_something_else_is_used_for_no_pdo(
    tmp_path: Path, parameter: int, cob_id: int
) -> None:
    result = run(tmp_path, good() | {(parameter, 1): u32(cob_id)})
    first, second = result.drives.values()
    assert render(first.problem) == f"{parameter:04X}h:01 is {cob_id:08X}h: no identifier for a PDO"
    assert second.problem == ""


def test_two_drives_on_one_identifier_are_both_not_served(tmp_path: Path) -> None:
    result = run(tmp_path, good() | {(0x1401, 1): u32(0x205)})
    assert {render(plan.problem) for plan in result.drives.values()} == {
        "205h is the identifier of more than one PDO"
    }


@pytest.mark.parametrize("where", [(0x1017, 0), (0x1600, 0), (0x1018, 3), (0x1400, 1)])
def test_an_answer_of_three_thousand_bytes_is_no_number(tmp_path: Path, where: tuple[int, int]) -> None:
    with pytest.raises(boot.BootError, match="3000 bytes"):
        run(tmp_path, good() | {where: b"\x01" * 3000})


def test_a_name_of_a_hundred_kilobytes_is_cut(tmp_path: Path) -> None:
    result = run(tmp_path, good() | {(0x1008, 0): b"X" * 100_000})
    assert result.identification.device_name == "X" * 64


def test_a_switched_off_pdo_is_told(tmp_path: Path) -> None:
    result = run(tmp_path, good() | {(0x1801, 1): u32(0xC000_0285)})
    assert "1801h:01: the PDO is switched off in the node" in render(result.drives["conveyor/fu2"].problem)


def test_a_pdo_of_two_words_is_not_evaluated_by_the_interface(tmp_path: Path) -> None:
    """BU 2500 §6.4, note."""
    result = run(tmp_path, good() | {(0x1600, 0): b"\x02"})
    assert "evaluates only 4 words" in render(result.drives["conveyor/fu1"].problem)
