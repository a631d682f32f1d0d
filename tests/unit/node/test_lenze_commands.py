"""Device commands of an 8400 motec: what is written starts something, and is not what is read afterwards."""

from __future__ import annotations

from collections.abc import Callable
from pathlib import Path

import pytest

from bridge.command import Action, Code, EventKind, Identity, Outcome, Request, Role, Source, command_of
from bridge.config import load_site
from bridge.mapping import load_family
from bridge.sim.lenze.lenze_motec import LenzeMotec
from bridge.sim.lenze.lenze_settings import LenzeCodes
from tests.support.bench import Bench
from tests.unit.node.test_lenze_node import DRIVE, SITE, start

NAME = "lenze/8400-motec"
ENGINEER = Identity(Source.OPCUA, "eve", Role.ENGINEER)
SAVE, RESET_NODE = "C00002/11", "C00002/26"


@pytest.fixture
def bench(tmp_path: Path) -> Bench:
    path = tmp_path / "site.toml"
    path.write_text(SITE.format(node=""), encoding="utf-8")
    drive = LenzeMotec(5, codes=LenzeCodes(5))
    bench = Bench(load_site(path), family=load_family(NAME), mapping=NAME, node=drive)
    bench.run(2.0)
    return bench


@pytest.fixture
def ask(bench: Bench) -> Callable[..., Outcome]:
    def asked(action: Action, **more: object) -> Outcome:
        outcomes: list[Outcome] = []
        bench.view.submit(Request(ENGINEER, DRIVE, command_of(action, **more)), outcomes.append)
        bench.run(0.6)
        (outcome,) = outcomes
        return outcome

    return asked


def after_the_mains_were_off(bench: Bench, ask: Callable[..., Outcome]) -> object:
    bench.node.power_cycle()
    bench.run(5.0)
    return ask(Action.READ_PARAMETER, parameter="C00593/1").value


def test_a_command_is_done_when_the_drive_has_answered(bench: Bench, ask: Callable[..., Outcome]) -> None:
    assert ask(Action.WRITE_PARAMETER, parameter="C00593/1", value=1).ok
    outcome = ask(Action.WRITE_PARAMETER, parameter=SAVE, value=1)
    assert outcome.ok, outcome.message
    assert ask(Action.READ_PARAMETER, parameter=SAVE).value == 0  # off, ready
    assert after_the_mains_were_off(bench, ask) == 1


def test_a_command_is_given_again_and_again(bench: Bench, ask: Callable[..., Outcome]) -> None:
    """Whatever the drive holds: nothing is compared, so the second time is not taken for written."""
    for _ in range(2):
        before = len(bench.sent(0x605))
        assert ask(Action.WRITE_PARAMETER, parameter=SAVE, value=1).ok
        about_it = [f.data.hex() for f in bench.sent(0x605)[before:] if f.data[1:4] == b"\xfd\x5f\x0b"]
        assert about_it == ["2ffd5f0b01000000"]


def test_the_parameters_of_a_lenze_are_saved(bench: Bench, ask: Callable[..., Outcome]) -> None:
    """EDS84DMOTCAN 3.0 §7.1.2: by C00002/11, since there is no "save" in 1010h."""
    assert ask(Action.WRITE_PARAMETER, parameter="C00593/1", value=1).ok
    outcome = ask(Action.SAVE_PARAMETERS)
    assert outcome.ok, outcome.message
    assert after_the_mains_were_off(bench, ask) == 1


@pytest.mark.landing(3)
@pytest.mark.parametrize(
    ("action", "more"),
    [
        (Action.SAVE_PARAMETERS, {}),
        (Action.WRITE_PARAMETER, {"parameter": SAVE, "value": 1}),
        (Action.WRITE_PARAMETER, {"parameter": RESET_NODE, "value": 1}),
    ],
)
def test_an_enabled_drive_gets_no_device_command(
    bench: Bench, ask: Callable[..., Outcome], action: Action, more: dict[str, object]
) -> None:
    start(bench)
    outcome = ask(action, **more)
    assert outcome.code is Code.NOT_ALLOWED
    assert "not written while the drive is enabled" in outcome.message


def test_a_node_that_was_told_to_reset_is_brought_back(bench: Bench, ask: Callable[..., Outcome]) -> None:
    """§7.2.3: C00002/26."""
    assert ask(Action.WRITE_PARAMETER, parameter=RESET_NODE, value=1).ok
    bench.run(5.0)
    assert str(bench.value("conveyor/node/boot_status")).startswith("ok")
    assert any(event.kind is EventKind.NODE_BACK for event in bench.events)
