"""Own supervision in a mapping file: what names no object, no whole number, or nothing that counts."""

from __future__ import annotations

from pathlib import Path

import pytest

from tests.support.invented import SPIN
from tests.support.sample_family import told

ENTRY = '\n[[own_supervision]]\nname = "P7"\nwatches = "process_data"\n'


@pytest.mark.parametrize(
    ("more", "fault"),
    [
        ("", "own_supervision[0]: has a parameter or an object, one of the two"),
        ('parameter = "P7"\nobject = "2000:00"\n', "has a parameter or an object, one of the two"),
        ('parameter = "P8"\n', "own_supervision[0].parameter: there is no parameter 'P8'"),
        (
            'object = "2000:00"\ndata_type = "real32"\n',
            "own_supervision[0].data_type: is a real32, no whole number",
        ),
        (
            'parameter = "P7"\nreaction = { object = "6007:00", stop = 0 }\n',
            "own_supervision[0].reaction.stop: is one of those with which the drive runs on",
        ),
    ],
)
def test_what_cannot_be_is_named(tmp_path: Path, more: str, fault: str) -> None:
    assert any(fault in one for one in told(tmp_path, SPIN + ENTRY + more))


@pytest.mark.parametrize(
    ("watches", "more", "fault"),
    [
        ("heartbeat", "per_drive = true\n", "heartbeat is of the node, and counts in ms (CiA 301)"),
        ("guarding", "unit_ms = 10.0\n", "guarding is of the node, and counts in ms (CiA 301)"),
        ("link", 'reaction = { object = "6007:00" }\n', "has no meaning: a link says nothing of the bridge"),
    ],
)
def test_what_cia_301_watches_is_of_the_node(tmp_path: Path, watches: str, more: str, fault: str) -> None:
    entry = ENTRY.replace("process_data", watches) + 'object = "1016:01"\ndata_type = "uint32"\n' + more
    assert any(fault in one for one in told(tmp_path, SPIN + entry))


def test_two_of_one_name_are_told(tmp_path: Path) -> None:
    entry = ENTRY + 'parameter = "P7"\n'
    assert any("own supervision 'P7' is there twice" in one for one in told(tmp_path, SPIN + entry + entry))
