"""One bad item ends nobody's work on the others."""

from __future__ import annotations

import asyncio
import logging
import os
import socket
from pathlib import Path

import pytest

from bridge.base.guard import Guard
from bridge.base.notify import Notifier
from bridge.command import Event, EventKind
from bridge.service.front_process import give_reason
from tests.support import sites


def test_what_is_raised_is_counted_and_goes_no_further(caplog: pytest.LogCaptureFixture) -> None:
    guard = Guard("mirror")
    with caplog.at_level(logging.ERROR):
        for number in range(1000):
            with guard:
                raise ValueError(f"item {number}")
    assert guard.faults == 1000
    told = [(record.getMessage(), bool(record.exc_info)) for record in caplog.records]
    assert [has_traceback for _, has_traceback in told] == [True, False, False, False], "1, 10, 100, 1000"
    assert "item 0" in told[0][0]
    assert "1000 so far" in told[-1][0]


@pytest.mark.parametrize("passing", [asyncio.CancelledError, KeyboardInterrupt])
def test_who_is_ended_ends(passing: type[BaseException]) -> None:
    with pytest.raises(passing), Guard("mirror"):
        raise passing


def test_a_listener_that_fails_keeps_an_event_from_nobody() -> None:
    plant = sites.plant_of(sites.site(sites.bus(sites.node(sites.drive("fu1", "modbus", 0))), sites.modbus()))
    heard: list[Event] = []

    def fail(event: Event) -> None:
        raise UnicodeEncodeError("utf-8", event.message, 0, 1, "surrogates not allowed")

    plant.on_event(fail)
    plant.on_event(heard.append)
    event = Event(1.0, EventKind.REFUSED, "bridge", 300, "\udcff")
    plant.report(event)
    assert heard == [event]


def test_words_of_others_end_neither_status_nor_reason(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    """A file name that is no UTF-8 is in the message of an error."""
    path = str(tmp_path / "notify")
    with socket.socket(socket.AF_UNIX, socket.SOCK_DGRAM) as systemd:
        systemd.bind(path)
        monkeypatch.setenv("NOTIFY_SOCKET", path)
        Notifier().status("not served: /state/\udcff")
        assert systemd.recv(1000) == b"STATUS=not served: /state/?"
    ear, mouth = os.pipe()
    give_reason(mouth, "cannot read /state/\udcff")
    assert os.read(ear, 1000) == b"!cannot read /state/?"
    os.close(ear)
    os.close(mouth)
