"""Output of ``drivebridge lss scan``: devices found, those that keep answering, and why there may be more."""

from __future__ import annotations

import json
from collections.abc import Callable
from typing import Any

import pytest
from typer.testing import CliRunner

from bridge.base.errors import OperationFailed
from bridge.cli import lss_command
from bridge.cli.app import make_app
from tests.support.lss_slave import LssSlave
from tests.unit.canopen.test_lss import NORD, OTHER, LssBus

SCAN = ["lss", "scan", "--interface", "socketcan", "--channel", "can0"]


def scan(
    monkeypatch: pytest.MonkeyPatch, slaves: list[LssSlave], *options: str, until: int | None = None
) -> Any:
    """``until``: the scan is interrupted after so many steps."""

    def carry_out(line: object, make: Callable[[float], Any], watch: object) -> Any:
        bus = LssBus(*slaves)
        task = make(bus.now)
        steps = 0
        while not task.is_finished(bus.now) and (until is None or steps < until):
            steps += 1
            frames = task.take_frames()
            for frame in frames:
                for answer in [one for one in (slave.on_request(frame.data) for slave in slaves) if one]:
                    task.on_frame(frame._replace(can_id=0x7E4, data=answer, time=bus.now))
            if not frames:
                bus.now = task.next_deadline() or bus.now
                task.on_time(bus.now)
        return task

    monkeypatch.setattr(lss_command, "carry_out", carry_out)
    return CliRunner().invoke(make_app("lss"), [*SCAN, *options])


def test_who_keeps_answering_is_named_beside_the_list(monkeypatch: pytest.MonkeyPatch) -> None:
    slaves = [LssSlave(one, talks_when_found=True) for one in (NORD, OTHER)]
    done = scan(monkeypatch, slaves, "--json")
    assert done.exit_code == 0, done.output
    devices = json.loads(done.stdout)
    assert [(device["serial"], device["keeps_answering"]) for device in devices] == [
        (NORD.serial, True),
        (OTHER.serial, False),
    ]
    assert "00000038:00010203:00000007:12345678 keeps answering after it was found" in done.stderr


def test_what_was_found_is_listed_where_the_scan_cannot_be_ended(monkeypatch: pytest.MonkeyPatch) -> None:
    done = scan(monkeypatch, [LssSlave(NORD), LssSlave(OTHER)], until=400)
    assert "00000038:00010203:00000007:12345678" in done.stdout
    assert isinstance(done.exception, OperationFailed)
    assert "interrupted; what is listed was not checked" in str(done.exception)


def test_nobody_is_no_failure(monkeypatch: pytest.MonkeyPatch) -> None:
    done = scan(monkeypatch, [])
    assert (done.exit_code, done.stdout) == (0, "no device without a node id\n")
