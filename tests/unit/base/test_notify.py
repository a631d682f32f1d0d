"""Messages to systemd (sd_notify(3)): readiness, status, and signs of life three times a watchdog period."""

from __future__ import annotations

import os
import socket
from collections.abc import Iterator
from pathlib import Path

import pytest

from bridge.base.notify import Notifier


class Systemd:
    def __init__(self, path: Path) -> None:
        self.socket = socket.socket(socket.AF_UNIX, socket.SOCK_DGRAM)
        self.socket.bind(str(path))
        self.socket.setblocking(False)

    def heard(self) -> list[str]:
        found: list[str] = []
        while True:
            try:
                found.append(self.socket.recv(4096).decode())
            except BlockingIOError:
                return found


@pytest.fixture
def systemd(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> Iterator[Systemd]:
    systemd = Systemd(tmp_path / "notify")
    monkeypatch.setenv("NOTIFY_SOCKET", str(tmp_path / "notify"))
    monkeypatch.delenv("WATCHDOG_USEC", raising=False)
    monkeypatch.delenv("WATCHDOG_PID", raising=False)
    yield systemd
    systemd.socket.close()


def close(notifier: Notifier) -> None:
    if notifier._socket:
        notifier._socket.close()


def test_what_it_says(systemd: Systemd) -> None:
    notifier = Notifier()
    notifier.ready("3 drives")
    notifier.status("2 drives")
    notifier.stopping()
    assert systemd.heard() == ["READY=1\nSTATUS=3 drives", "STATUS=2 drives", "STOPPING=1"]
    close(notifier)


def test_signs_of_life_come_three_times_in_the_watchdogs_period(
    systemd: Systemd, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setenv("WATCHDOG_USEC", "3000000")
    monkeypatch.setenv("WATCHDOG_PID", str(os.getpid()))
    notifier, at = Notifier(), list[float]()
    for step in range(40):
        notifier.alive(100.0 + step / 10)
        at += [step / 10 for text in systemd.heard() if text == "WATCHDOG=1"]
    assert at == pytest.approx([0.0, 1.0, 2.0, 3.0])
    close(notifier)


@pytest.mark.parametrize(("microseconds", "pid"), [("0", None), ("", None), ("3000000", "1")])
def test_without_a_watchdog_of_ours_there_are_none(
    systemd: Systemd, monkeypatch: pytest.MonkeyPatch, microseconds: str, pid: str | None
) -> None:
    monkeypatch.setenv("WATCHDOG_USEC", microseconds)
    if pid:
        monkeypatch.setenv("WATCHDOG_PID", pid)
    notifier = Notifier()
    notifier.alive(100.0)
    assert systemd.heard() == []
    close(notifier)


def test_a_systemd_that_is_not_there_stops_nothing(monkeypatch: pytest.MonkeyPatch, tmp_path: Path) -> None:
    monkeypatch.setenv("NOTIFY_SOCKET", str(tmp_path / "gone"))
    notifier = Notifier()
    notifier.ready("3 drives")
    close(notifier)
    monkeypatch.delenv("NOTIFY_SOCKET")
    Notifier().stopping()


def test_an_address_may_be_abstract(monkeypatch: pytest.MonkeyPatch) -> None:
    name = f"drivebridge-test-{os.getpid()}"
    with socket.socket(socket.AF_UNIX, socket.SOCK_DGRAM) as systemd:
        systemd.bind(f"\0{name}")
        monkeypatch.setenv("NOTIFY_SOCKET", f"@{name}")
        notifier = Notifier()
        notifier.stopping()
        assert systemd.recv(100) == b"STOPPING=1"
        close(notifier)
