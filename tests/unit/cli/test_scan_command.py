"""``drivebridge scan``: how many of its requests went out, and a bus that is slower than assumed."""

from __future__ import annotations

import errno
import json
from collections.abc import Callable
from typing import Any

import pytest
from click.testing import Result
from typer.testing import CliRunner

from bridge.base.errors import OperationFailed, Unavailable
from bridge.can.cansockets import CanSockets
from bridge.can.netlink import Link
from bridge.canopen.frame import Frame
from bridge.cli.app import make_app
from tests.support.bench import ClockBus

BUS = ["--interface", "socketcan", "--channel", "can7"]
HEARTBEAT = Frame(0x705, b"\x05")


class CountingBus(ClockBus):
    """A bus that takes the first ``takes`` frames and drops the others; ``heard`` is what is on it."""

    def __init__(self, takes: int, heard: tuple[Frame, ...] = ()) -> None:
        super().__init__(lambda frame: None)
        self.takes, self.heard = takes, heard

    def open(self, wake: Callable[[], None]) -> None:
        self.inbox += self.heard

    def send(self, frame: Frame, now: float, deadline: float) -> None:
        if self.takes:
            self.takes -= 1
        else:
            self.status.frames_expired += 1


def scan(monkeypatch: pytest.MonkeyPatch, bus: CountingBus, *more: str) -> Result:
    def open_bus(*arguments: Any, **options: Any) -> CountingBus:
        del arguments, options
        return bus

    monkeypatch.setattr("bridge.cli.bus_runner.open_bus", open_bus)
    return CliRunner().invoke(make_app("scan"), ["scan", *BUS, "--timeout-ms", "10", *more])


@pytest.mark.landing(2)
@pytest.mark.parametrize("takes", [1, 40, 10_000])
def test_how_many_requests_went_out_is_said(monkeypatch: pytest.MonkeyPatch, takes: int) -> None:
    done = scan(monkeypatch, CountingBus(takes, (HEARTBEAT,)), "--json")
    assert done.exit_code == 0, done.output
    (said,) = [line for line in done.stderr.splitlines() if "went out" in line]
    went, _, asked, *_ = said.split()
    assert int(went) == min(takes, int(asked))
    assert int(asked) >= 127
    assert [one["id"] for one in json.loads(done.stdout)] == [5]


def test_a_bus_that_takes_nothing_is_not_empty(monkeypatch: pytest.MonkeyPatch) -> None:
    done = scan(monkeypatch, CountingBus(0))
    assert isinstance(done.exception, OperationFailed), done.output
    assert str(done.exception).startswith("none of ")
    assert "no nodes" not in done.stdout


def test_what_is_heard_on_a_bus_that_takes_nothing_is_listed(monkeypatch: pytest.MonkeyPatch) -> None:
    done = scan(monkeypatch, CountingBus(0, (HEARTBEAT,)))
    assert done.exit_code == 0
    assert "0 of " in done.stderr
    assert "operational" in done.stdout


def test_who_only_listens_asks_nothing(monkeypatch: pytest.MonkeyPatch) -> None:
    done = scan(monkeypatch, CountingBus(0), "--passive", "--seconds", "0.1")
    assert done.exit_code == 0
    assert "went out" not in done.stderr


class Passed(OSError):
    """The link was accepted, and sockets were asked for."""


@pytest.mark.parametrize(
    ("actual", "options", "refusal"),
    [
        (50_000, [], "can7 runs at 50000 bit/s, and requests at the pace of the assumed 250000"),
        (50_000, ["--bitrate", "50000"], ""),
        (50_000, ["--passive"], ""),
        (250_000, [], ""),
        (1_000_000, [], ""),
        (None, [], ""),
        (50_000, ["--bitrate", "125000"], "can7 runs at 50000 bit/s, the site file says 125000"),
    ],
)
def test_a_bus_slower_than_assumed_is_refused(
    monkeypatch: pytest.MonkeyPatch, actual: int | None, options: list[str], refusal: str
) -> None:
    def raw(self: CanSockets) -> None:
        raise Passed(errno.EPERM, "accepted")

    monkeypatch.setattr(CanSockets, "link", lambda self: Link(is_up=True, kind="can", bitrate=actual))
    monkeypatch.setattr(CanSockets, "raw", raw)
    done = CliRunner().invoke(make_app("scan"), ["scan", *BUS, *options])
    assert isinstance(done.exception, Unavailable), done.output
    assert (refusal or "no permission to open can7") in str(done.exception)
    if "assumed" in refusal:
        assert "--bitrate 50000" in str(done.exception)
