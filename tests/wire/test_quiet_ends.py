"""A process of ours ends without noise, whoever ends it and whatever a library is doing."""

from __future__ import annotations

import os
import signal
import sys
import time
from pathlib import Path

import pytest

from tests.support import sites
from tests.support.process import catches, drivebridge, free_port, peer, running, until

NOISE = ("Traceback", "KeyboardInterrupt", "FATAL", "rethrown", "Fatal Python error")
COMMANDS = (
    ("version",),
    ("check", "SITE"),
    ("audit", "SITE"),
    ("export", "zenoh", "SITE"),
    ("simulate", "SITE"),
    ("scan", "--interface", "virtual", "--channel", "x"),
    ("demo-controller", "tcp/127.0.0.1:1", "drives/demo/fan/drive/command/velocity=1"),
    ("--help",),
)


def is_quiet(output: str) -> bool:
    return not any(word in output for word in NOISE)


def many_nodes(folder: Path, port: int) -> Path:
    nodes = [
        sites.node(*(sites.drive(f"fu{d}", "none", 0) for d in range(1, 5)), name=f"n{i}", node_id=10 + i)
        for i in range(5)
    ]
    zenoh = f'[zenoh]\nlisten = ["tcp/127.0.0.1:{port}#so_sndbuf=32768"]\n'
    return sites.write(folder, sites.bus(*nodes), zenoh, name="demo")


@pytest.mark.landing
def test_the_service_ends_though_its_zenoh_clients_hang(tmp_path: Path) -> None:
    port = free_port()
    with drivebridge(tmp_path, "run", "run", str(many_nodes(tmp_path, port)), notify=True) as bridge:
        bridge.wait_ready()
        with peer(tmp_path, "zenoh_crowd", f"tcp/127.0.0.1:{port}", "drives/demo", "6") as crowd:
            crowd.wait_output("stopping")
            begin = time.monotonic()
            bridge.signal(signal.SIGTERM)
            assert bridge.popen.wait(20) == 0, bridge.output()
            assert time.monotonic() - begin < 20
        assert is_quiet(bridge.output()), bridge.output()


@pytest.mark.landing(9)
@pytest.mark.parametrize("after_s", [0.0, 0.1, 0.4])
@pytest.mark.parametrize("command", COMMANDS, ids=lambda command: command[0])
def test_ctrl_c_while_a_command_starts_prints_no_traceback(
    tmp_path: Path, command: tuple[str, ...], after_s: float
) -> None:
    path = sites.write(tmp_path, sites.bus(sites.node(sites.drive("fu1", "none", 0))), sites.zenoh())
    words = [str(path) if word == "SITE" else word for word in command]
    with running(tmp_path, "command", sys.executable, "-m", "bridge", *words) as process:
        until(lambda: catches(process.pid, signal.SIGINT), 5.0, "Python runs", pause_s=0.001)
        # What comes before our first line is Python's.
        until(lambda: not catches(process.pid, signal.SIGINT), 5.0, "ours begins", pause_s=0.001)
        time.sleep(after_s)
        if process.popen.poll() is None:
            os.kill(process.pid, signal.SIGINT)
        process.popen.wait(15)
        assert is_quiet(process.output()), process.output()
