"""Entries of a mapping file that do not go together: words, names and SDO servers."""

from __future__ import annotations

from pathlib import Path

import pytest

from bridge.base.errors import FileFaults
from bridge.mapping import read_family
from bridge.text import render
from tests.support.sample_family import FAMILY, told


def test_a_valid_bit_belongs_into_every_word_the_bridge_sends(tmp_path: Path):
    found = told(tmp_path, FAMILY.replace("acknowledge_bit = 7", "acknowledge_bit = 7\nvalid_bit = 10"))
    assert [line.split(": ")[1] for line in found] == [
        "control_word.stopped",
        "control_word.ready",
        "control_word.run",
    ]


def test_what_is_there_twice_is_told_with_where_it_is_first(tmp_path: Path):
    parameter = FAMILY[FAMILY.index("[[parameter]]") : FAMILY.index("[[poll]]")]
    poll = FAMILY[FAMILY.index("[[poll]]") : FAMILY.index("[control_word]")]
    slot = FAMILY[FAMILY.index("[[slot]]") : FAMILY.index("[[value]]")]
    value = FAMILY[FAMILY.index("[[value]]") : FAMILY.index("[[parameter]]")]
    found = told(tmp_path, FAMILY + parameter + poll + slot + value)
    assert [line.split(": ", 1)[1] for line in found] == [
        "parameter[1].name: parameter 'P1' is there twice (first in line 25)",
        "poll[1].name: poll 'inputs' is there twice (first in line 30)",
        "slot[1].name: slot 'one' is there twice (first in line 9)",
        "value[1].name: point 'command/velocity' is there twice (first in line 19)",
    ]


@pytest.mark.parametrize(
    ("texts", "where", "fault"),
    [
        (
            'states = { 0 = "off", 1 = "on" }\ngerman_states = { 0 = "aus" }',
            30,
            "parameter[0].german_states: has no 1, which states has",
        ),
        (
            'states = { 0 = "off" }\ngerman_states = { 0 = "aus", 1 = "ein" }',
            29,
            "parameter[0].states: has no 1, which german_states has",
        ),
        ('german_states = { 0 = "aus" }', 24, "parameter[0].states: has no 0, which german_states has"),
    ],
)
def test_a_parameter_has_the_same_states_in_german(tmp_path: Path, texts: str, where: int, fault: str):
    described = 'object = "2001:00"\ndata_type = "uint16"\n'
    found = told(tmp_path, FAMILY.replace(f"{described}[[poll]]", f"{described}{texts}\n[[poll]]"))
    assert found == [f"{where}: {fault}"]


@pytest.mark.parametrize(
    ("more", "fault"),
    [
        ('slot = "two"', "sdo[0].slot: there is no slot 'two' (known: one)"),
        ("after_stop = 1", "sdo[0].after_stop: must be true or false, not 1"),
        (
            "[[sdo]]\nnumber = 2\nrequest = 0x640\nreply = 0x5C0",
            "sdo[1].number: SDO server '2' is there twice",
        ),
    ],
)
def test_a_wrong_sdo_server_is_named(tmp_path: Path, more: str, fault: str):
    server = f"[[sdo]]\nnumber = 2\nrequest = 0x340\nreply = 0x2C0\n{more}\n[control_word]"
    assert fault in told(tmp_path, FAMILY.replace("[control_word]", server))[0]


def test_an_sdo_server_leaves_room_for_the_node_id(tmp_path: Path):
    server = "[[sdo]]\nnumber = 2\nrequest = 0x7FF\nreply = 0x2C0\n[control_word]"
    [fault] = told(tmp_path, FAMILY.replace("[control_word]", server))
    assert "sdo[0].request: 7FFh leaves no room for the node id" in fault


def test_a_finding_is_told_in_german_too(tmp_path: Path):
    slot = FAMILY[FAMILY.index("[[slot]]") : FAMILY.index("[[value]]")]
    path = tmp_path / "one.toml"
    path.write_text(FAMILY + slot)
    with pytest.raises(FileFaults) as caught:
        read_family(path)
    (fault,) = caught.value.faults
    said, advice = render(fault.said, "de"), render(fault.advice, "de")
    assert (said, advice) == ("Slot 'one' ist doppelt vorhanden", "zuerst in Zeile 9")
