"""Buses that cannot be opened: all of them are named at once, whichever command wants them."""

from __future__ import annotations

import errno
from collections.abc import Callable
from pathlib import Path

import pytest
from typer.testing import CliRunner

from bridge.base.errors import Unavailable
from bridge.can import open_all
from bridge.cli.app import make_app
from bridge.master.master import Master
from bridge.witness import shell
from tests.support import sites
from tests.support.bench import Bench, ClockBus, write_site

NOWHERE = "carrier_pigeon"
"""An interface that python-can does not have."""


class ShutBus(ClockBus):
    """``why`` it cannot be opened, if it cannot."""

    def __init__(self, why: str = "") -> None:
        super().__init__(lambda frame: None)
        self.why = why
        self.is_open = False

    def open(self, wake: Callable[[], None]) -> None:
        if self.why:
            raise Unavailable(self.why)
        self.is_open = True

    def close(self) -> None:
        self.is_open = False


def test_all_are_tried_and_all_that_fail_are_named() -> None:
    opened: list[str] = []

    def failing(why: str) -> Callable[[], None]:
        def fail() -> None:
            raise Unavailable(why)

        return fail

    with pytest.raises(Unavailable) as raised:
        open_all([failing("can0 is away"), lambda: opened.append("can1"), failing("can2 is away")])
    assert str(raised.value).splitlines() == ["can0 is away", "can2 is away"]
    assert opened == ["can1"]
    open_all([])


async def test_a_master_names_all_and_leaves_none_open(tmp_path: Path) -> None:
    bench = Bench(write_site(tmp_path))
    buses = [ShutBus("can0 is away"), ShutBus(), ShutBus("can2 is away")]
    master = Master([(bus, bench.network) for bus in buses], bench.plant, bench.clock)
    with pytest.raises(Unavailable, match=r"can0 is away\ncan2 is away"):
        await master.start()
    assert not any(bus.is_open for bus in buses)


def two_buses(folder: Path) -> Path:
    drive = sites.drive("fu1", "none", 0)
    return sites.write(
        folder,
        *(
            sites.bus(
                sites.node(drive, name=f"n{number}"),
                name=f"can{number}",
                interface=NOWHERE,
                more=f'channel = "loft{number}"',
            )
            for number in (0, 1)
        ),
    )


@pytest.mark.landing(2)
@pytest.mark.parametrize("command", ["simulate", "audit"])
def test_a_command_for_all_buses_names_all_that_are_missing(tmp_path: Path, command: str) -> None:
    done = CliRunner().invoke(make_app(command), [command, str(two_buses(tmp_path))])
    assert isinstance(done.exception, Unavailable), done.exception
    assert done.exception.exit_code == 3
    lines = str(done.exception).splitlines()
    assert [line.partition(":")[0] for line in lines] == ["bus can0", "bus can1"]
    assert all(NOWHERE in line for line in lines)


def test_a_witness_names_those_that_are_missing_and_no_others(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    class Listener:
        def __init__(self, channel: str, can_ids: object) -> None:
            if channel != "good":
                raise OSError(errno.ENODEV, "No such device")

        def close(self) -> None: ...

    monkeypatch.setattr(shell, "CanSocket", Listener)
    drive = sites.drive("fu1", "none", 0)
    buses = (
        sites.bus(sites.node(drive, name=name), name=name, interface="socketcan", more=f'channel = "{name}"')
        for name in ("one", "good", "two")
    )
    site = sites.write(tmp_path, *buses)
    done = CliRunner().invoke(make_app("witness"), ["witness", str(site), "--seconds", "0.1"])
    assert isinstance(done.exception, Unavailable), (done.exception, done.output)
    assert str(done.exception).splitlines() == [
        "cannot listen on one: No such device",
        "cannot listen on two: No such device",
    ]


ON_ONE = {
    "scan": ["scan", "SITE", "--bus", "can1"],
    "scan --passive": ["scan", "SITE", "--bus", "can1", "--passive"],
    "sdo read": ["sdo", "read", "SITE", "n1", "1000", "--bus", "can1"],
    "sdo write": ["sdo", "write", "SITE", "n1", "2000", "1", "--type", "uint8", "--yes", "--bus", "can1"],
    "nmt": ["nmt", "SITE", "stop", "n1", "--bus", "can1"],
    "monitor": ["monitor", "SITE", "--bus", "can1"],
    "lss scan": ["lss", "scan", "SITE", "--bus", "can1"],
    "lss inquire": ["lss", "inquire", "SITE", "--only", "--bus", "can1"],
    "lss set-id": ["lss", "set-id", "SITE", "--only", "--id", "5", "--bus", "can1"],
    "lss set-bitrate": ["lss", "set-bitrate", "SITE", "--only", "--new", "auto", "--bus", "can1"],
    "lss store": ["lss", "store", "SITE", "--only", "--bus", "can1"],
    "parameters read": ["parameters", "read", "SITE", "n1/fu1", "P105"],
    "parameters write": ["parameters", "write", "SITE", "n1/fu1", "P105", "50", "--yes"],
    "faults --drive": ["faults", "SITE", "--drive", "n1/fu1"],
    "drop-test": ["drop-test", "SITE", "n1", "--yes-i-am-at-the-machine"],
    "conformance": ["conformance", "SITE", "n1", "--yes"],
    "audit --bus": ["audit", "SITE", "--bus", "can1"],
}


@pytest.mark.landing(17)
@pytest.mark.parametrize("name", ON_ONE)
def test_a_command_for_one_bus_names_it_and_ends_with_3(tmp_path: Path, name: str) -> None:
    site = str(two_buses(tmp_path))
    words = [site if word == "SITE" else word for word in ON_ONE[name]]
    done = CliRunner().invoke(make_app(words[0]), words)
    assert isinstance(done.exception, Unavailable), (done.exception, done.output)
    assert done.exception.exit_code == 3
    assert str(done.exception).startswith(f"bus can1: interface '{NOWHERE}', channel 'loft1': ")
    assert "\n" not in str(done.exception)
