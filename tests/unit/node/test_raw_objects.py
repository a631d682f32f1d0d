"""Objects as their bytes, through the queue, rights and protection of parameters."""

from __future__ import annotations

from pathlib import Path

import pytest

from bridge.command import Action, Code
from bridge.image import Quality
from tests.unit.node.parameters.test_service import OBSERVER, OPERATOR, READ, WRITE, Parameters


@pytest.fixture
def parameters(tmp_path: Path) -> Parameters:
    return Parameters(tmp_path)


def test_bytes_of_a_parameter_are_read_as_the_drive_sends_them(parameters: Parameters) -> None:
    plain = parameters.ask(READ, OBSERVER, parameter="P105.2")
    raw = parameters.ask(READ, OBSERVER, parameter="P105.2", raw=True)
    assert (plain.value, raw.code, raw.value) == (50.0, Code.OK, "F4 01")


@pytest.mark.landing
def test_bytes_of_an_object_that_no_file_lists_keep_their_length(parameters: Parameters) -> None:
    assert parameters.ask(READ, OBSERVER, parameter="1018:00", raw=True).value == "04"


def test_whoever_reads_a_value_meanwhile_gets_the_value(parameters: Parameters) -> None:
    raw = parameters.begin(READ, parameter="P105.2", raw=True)
    plain = parameters.begin(READ, parameter="P105.2")
    parameters.bench.run(0.6)
    assert (raw[0].value, plain[0].value) == ("F4 01", 50.0)


def test_bytes_are_written_and_the_point_shows_the_value(parameters: Parameters) -> None:
    outcome = parameters.write("P102", "67 00", raw=True)
    assert (outcome.code, outcome.value) == (Code.OK, "67 00")
    assert parameters.point("p102") == (1.03, Quality.GOOD)


@pytest.mark.landing(4)
@pytest.mark.parametrize("value", ["6", "xy", 103, "FF 7F"])
def test_what_the_parameter_does_not_take_is_not_sent(parameters: Parameters, value: str | int) -> None:
    outcome = parameters.ask(WRITE, parameter="P102", value=value, raw=True)
    assert outcome.code is Code.OUT_OF_RANGE
    assert parameters.downloads(0x2066) == []


@pytest.mark.landing(4)
@pytest.mark.parametrize("address", ["3000:01", "1017:00", "1400:01", "1010:01"])
def test_what_is_protected_is_protected_as_bytes(parameters: Parameters, address: str) -> None:
    index = int(address[:4], 16)
    at_boot = parameters.downloads(index)
    outcome = parameters.write(address, "00 00", raw=True)
    assert outcome.code is Code.NOT_ALLOWED
    assert parameters.downloads(index) == at_boot


def test_rights_are_those_of_a_parameter(parameters: Parameters) -> None:
    assert parameters.write("P102", "67 00", raw=True, identity=OPERATOR).code is Code.NOT_ALLOWED


@pytest.mark.landing
def test_a_node_that_is_held_in_pre_operational_is_asked_and_not_written(parameters: Parameters) -> None:
    assert parameters.ask(Action.ENTER_PRE_OPERATIONAL, target="conveyor").ok
    assert parameters.ask(READ, OBSERVER, parameter="1018:00", raw=True).value == "04"
    assert parameters.write("P102", "67 00", raw=True).code is Code.NOT_READY
    assert parameters.downloads(0x2066) == []


def test_a_node_in_stopped_does_not_answer_and_everybody_is_told(parameters: Parameters) -> None:
    assert parameters.ask(Action.STOP_NODE, target="conveyor").ok
    outcomes = parameters.begin(READ, OBSERVER, parameter="1018:00", raw=True)
    parameters.bench.run(5.0)
    assert [outcome.code for outcome in outcomes] == [Code.TIMED_OUT]


def test_a_question_that_a_boot_up_ends_is_answered(parameters: Parameters) -> None:
    parameters.ask(Action.STOP_NODE, target="conveyor")
    outcomes = parameters.begin(READ, OBSERVER, parameter="1018:00", raw=True)
    parameters.ask(Action.START_NODE, target="conveyor")
    parameters.bench.run(2.0)
    assert len(outcomes) == 1
    assert not outcomes[0].ok
    assert parameters.ask(READ, OBSERVER, parameter="1018:00", raw=True).value == "04"
