"""Settings in a mapping file that decide the meaning of its values, and the demands of `check` on them."""

from __future__ import annotations

from pathlib import Path

import pytest

from bridge.base.errors import FileFaults
from bridge.mapping import family_names, load_family, read_family
from bridge.mapping.model import Family

BIT_8 = """
extends = "nord/sk-tu4-cao-posicon"
[[value]]
name = "{name}"
group = "actual"
word = "status_word"
bit = {bit}
{more}
"""


def faults(folder: Path, text: str) -> str:
    path = folder / "own.toml"
    path.write_text(text, encoding="utf-8")
    with pytest.raises(FileFaults) as caught:
        read_family(path)
    return "\n".join(f"{one.line} {one.key}: {one.message} ({one.hint})" for one in caught.value.faults)


@pytest.mark.landing(8)
@pytest.mark.parametrize(
    ("more", "fault"),
    [
        ("", "value[5].bit: is target_reached, too, and nothing says when"),
        ("when = { P6000 = [0] }", "when.P6000: there is no parameter 'P6000' (known: "),
        ("when = { P112 = [0] }", "when.P112: P112 cannot be read (name one that the drive tells)"),
        ("when = { P600 = [] }", "when.P600"),
        ('needs = "command/way"', "needs: there is no value 'command/way'"),
        ('needs = "actual/at_speed"', "needs: needs itself"),
        ('steady = ["P9"]', "steady[0]: there is no parameter 'P9'"),
        ('otherwise = "is not said"\nneeds = "command/position"', "otherwise: has no meaning without when"),
    ],
)
def test_what_decides_a_bit_is_known_and_said(tmp_path: Path, more: str, fault: str) -> None:
    found = faults(tmp_path, BIT_8.format(name="at_speed", bit=8, more=more))
    assert fault.partition("].")[2] in found and fault.partition(": ")[2] in found, found


def test_a_bit_may_mean_another_thing_with_another_setting(tmp_path: Path) -> None:
    path = tmp_path / "own.toml"
    path.write_text(BIT_8.format(name="at_speed", bit=8, more="when = { P600 = [0] }"), encoding="utf-8")
    assert read_family(path).value[-1].when == {"P600": [0.0]}


@pytest.mark.parametrize("bit", [10, 12, 13])
def test_a_bit_of_the_mode_needs_its_mode(tmp_path: Path, bit: int) -> None:
    text = BIT_8.format(name="it", bit=bit, more="").replace("nord/sk-tu4-cao-posicon", "cia402/homing")
    assert "bit: " in faults(tmp_path, text)


def families() -> list[Family]:
    return [load_family(name) for name in family_names()]


def test_no_bit_of_a_family_has_two_meanings_at_once() -> None:
    """NORD's bit 8 (BU 2500 §6.5.2) and those of CiA 402's modes say when they are meant."""
    for family in families():
        for value in family.value:
            is_of_posicon = "POSICON" in family.family.name and value.word == "status_word"
            is_of_mode = family.family.name.startswith("CiA 402") and value.bit in (10, 12, 13)
            if is_of_posicon or is_of_mode:
                assert value.is_conditional, (family.family.name, value.leaf)


def test_bit_10_is_no_target_where_cia_402_reserves_it() -> None:
    """Cyclic synchronous position and velocity."""
    for name in ("cia402/cyclic-position", "cia402/cyclic-velocity"):
        assert not [one for one in load_family(name).value if one.bit == 10]
