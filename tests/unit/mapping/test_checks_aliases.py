"""Aliases and starts of a mapping file: what is no communication object, what no boot-up may write."""

from __future__ import annotations

from pathlib import Path

import pytest

from tests.support.invented import SPIN
from tests.support.sample_family import told


@pytest.mark.parametrize(
    ("aliases", "fault"),
    [
        ('same = { P7 = "2000:00" }', "2000:00 is no communication object (those are 1000 … 1FFF)"),
        ('related = { X7 = "1400:02" }', "aliases.related.X7: "),
    ],
)
def test_an_alias_is_a_parameter_that_stands_for_a_communication_object(
    tmp_path: Path, aliases: str, fault: str
) -> None:
    assert any(fault in one for one in told(tmp_path, f"{SPIN}\n[aliases]\n{aliases}\n"))


def test_what_the_boot_up_sets_by_itself_is_not_written_beside_it(tmp_path: Path) -> None:
    text = SPIN.replace('object = "6060:00", type = "int8"', 'object = "1017:00", type = "uint16"')
    assert text != SPIN
    assert any("1017:00 belongs to the communication" in one for one in told(tmp_path, text))


def test_nor_is_it_under_another_name(tmp_path: Path) -> None:
    text = SPIN.replace('object = "6060:00", type = "int8"', 'object = "2007:00", type = "uint16"')
    text += '\n[aliases]\nsame = { P7 = "1017:00" }\n'
    assert any(
        "2007:00 stands for 1017:00, which belongs to the communication" in one
        for one in told(tmp_path, text)
    )
