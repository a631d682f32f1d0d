"""``drivebridge nmt``: which command is sent to whom, what is said of the nodes, and the exit code."""

from __future__ import annotations

import json
from collections.abc import Callable
from typing import Any

import pytest
from typer.testing import CliRunner, Result

from bridge.base.errors import OperationFailed
from bridge.bustools.single import NmtTask
from bridge.canopen.frame import Frame
from bridge.cli import nmt_command
from bridge.cli.app import make_app

BUS = ["--interface", "virtual", "--channel", "x"]


class Bus:
    """Runs the task on a bus on which these nodes answer so."""

    def __init__(self, **answers: int) -> None:
        self.answers = {int(node.removeprefix("n")): octet for node, octet in answers.items()}
        self.sent: list[Frame] = []

    def __call__(
        self, line: Any, make: Callable[[float], NmtTask], watch: Callable[[NmtTask], None]
    ) -> NmtTask:
        task = make(10.0)
        self.sent = task.take_frames()
        for node, octet in self.answers.items():
            task.on_frame(Frame(0x700 + node, bytes((octet,)), 10.1))
        watch(task)
        return task


def run(monkeypatch: pytest.MonkeyPatch, bus: Bus, *arguments: str) -> Result:
    monkeypatch.setattr(nmt_command, "carry_out", bus)
    monkeypatch.setattr(nmt_command, "choose_bus", lambda site, which: Line())
    return CliRunner().invoke(
        make_app(), ["nmt", *arguments, "--interface", "socketcan", "--channel", "can0"]
    )


class Line:
    class table:
        master_node_id = 127

    def node_id(self, text: str) -> int:
        return int(text)


@pytest.mark.parametrize(
    ("name", "octet"),
    [("start", 1), ("stop", 2), ("pre-operational", 128), ("reset-node", 129), ("reset-communication", 130)],
)
def test_the_commands_of_the_standard(monkeypatch: pytest.MonkeyPatch, name: str, octet: int) -> None:
    """CiA 301 §7.2.8.2.1."""
    bus = Bus()
    run(monkeypatch, bus, name, "5")
    assert bus.sent == [Frame(0, bytes((octet, 5)))]


def test_a_node_that_follows_is_told(monkeypatch: pytest.MonkeyPatch) -> None:
    done = run(monkeypatch, Bus(n5=5), "start", "5")
    assert (done.exit_code, done.stdout) == (0, "node 5: operational\n")


def test_one_that_does_not_is_an_error(monkeypatch: pytest.MonkeyPatch) -> None:
    done = run(monkeypatch, Bus(n5=127), "start", "5")
    assert isinstance(done.exception, OperationFailed)
    assert str(done.exception) == "did not follow start: node 5"
    assert done.stdout == "node 5: pre operational\n"


def test_where_nothing_is_heard_it_says_so(monkeypatch: pytest.MonkeyPatch) -> None:
    done = run(monkeypatch, Bus(), "start", "5")
    assert done.exit_code == 0
    assert done.stdout.startswith("sent; nothing was heard within 2 s")


def test_a_command_to_all_is_not_for_the_one_who_gives_it(monkeypatch: pytest.MonkeyPatch) -> None:
    bus = Bus(n5=5, n127=127)
    done = run(monkeypatch, bus, "start", "all", "--json")
    assert bus.sent == [Frame(0, b"\x01\x00")]
    assert json.loads(done.stdout) == {
        "command": "start",
        "node": "all",
        "nodes": [{"id": 5, "nmt_state": "operational", "reached": True}],
    }


def test_what_is_no_command_is_bad_usage(monkeypatch: pytest.MonkeyPatch) -> None:
    assert run(monkeypatch, Bus(), "sleep", "5").exit_code == 2
