"""Mapping files of devices that are no drives: what goes together, and what has no effect there."""

from __future__ import annotations

from pathlib import Path

import pytest

from bridge.base.errors import FileFaults
from bridge.mapping import read_family
from tests.support.devices import IO_BLOCK


def told(folder: Path, old: str, new: str) -> list[str]:
    assert old in IO_BLOCK
    path = folder / "block.toml"
    path.write_text(IO_BLOCK.replace(old, new, 1))
    with pytest.raises(FileFaults) as caught:
        read_family(path)
    return [f"{fault.key}: {fault.message}" for fault in caught.value.faults]


def test_the_block_itself_is_fine(tmp_path: Path) -> None:
    path = tmp_path / "block.toml"
    path.write_text(IO_BLOCK)
    assert read_family(path).is_device


@pytest.mark.parametrize(
    ("old", "new", "fault"),
    [
        ("factor = 0.1", "factor = 0", "output[1].factor: must not be 0"),
        ("factor = 0.1", "factor = 0.1\nlow = 5\nhigh = 1", "output[1].low: is above high, 1"),
        (
            "factor = 0.1",
            'factor = 0.1\nbits = ["a"]',
            "output[1]: states and bits are of numbers",
        ),
        (
            'bits = ["inlet", "outlet"]',
            'bits = ["inlet", "inlet"]',
            "output[0].bits[1]: bit 'inlet' is",
        ),
        (
            'bits = ["inlet", "outlet"]',
            f"bits = {[f'b{n}' for n in range(9)]}".replace("'", '"'),
            "output[0].bits: a uint8 has 8 bits",
        ),
        ('name = "lamp"', 'name = "speed"', "output[2].name: output 'speed' is there twice"),
        ("on_expiry = 5", "on_expiry = 1e9", "output[1].on_expiry: "),
    ],
)
def test_a_signal_that_cannot_be_is_named(tmp_path: Path, old: str, new: str, fault: str) -> None:
    assert any(one.startswith(fault) for one in told(tmp_path, old, new))


def test_what_is_only_read_has_no_outputs(tmp_path: Path) -> None:
    found = told(tmp_path, "[family]\n", '[family]\nread_only = "nobody may"\n')
    assert any("is of a device without outputs" in one for one in found)


def test_what_is_of_drives_has_no_effect(tmp_path: Path) -> None:
    process = '[process]\nrpdo = ["control_word"]\ntpdo = ["status_word"]\n'
    found = told(tmp_path, "[family]\n", f"{process}[family]\n")
    assert "process: has no effect without a [[slot]]" in found
