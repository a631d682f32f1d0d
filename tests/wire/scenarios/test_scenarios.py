"""Days of three OPC UA clients that we did not write, at one server, step by step.

The scripts run beside each other, each on a part of the plant that is its own; the end of the server is announced
to all of them.
"""

from __future__ import annotations

import json
import os
import subprocess
import sys
import time
from collections.abc import Iterator, Mapping
from contextlib import ExitStack
from dataclasses import dataclass
from pathlib import Path

import pytest

from tests.support import scenario_plant
from tests.support.process import REPOSITORY, free_port, until

PYTHON = {"asyncua": "a"}
LIMIT_S = 100.0


@dataclass
class Client:
    """A client's script, and where its output is."""

    process: subprocess.Popen[bytes]
    log: Path

    def said(self) -> list[dict[str, object]]:
        """Clients write what they think of certificates to the standard output, too."""
        lines = self.log.read_text(encoding="utf-8", errors="replace").splitlines()
        return [json.loads(line) for line in lines if line.startswith("{")]

    def is_at_the_end(self) -> bool:
        return self.process.poll() is not None or {"waiting": "end"} in self.said()


@pytest.fixture(scope="module")
def clients(tmp_path_factory: pytest.TempPathFactory) -> Iterator[Mapping[str, Client]]:
    """All three, when they have ended."""
    folder, port = tmp_path_factory.mktemp("scenarios"), free_port()
    scenario_plant.lay_out(folder)
    site = scenario_plant.write_site(folder, port, [scenario_plant.nodes_of(bus, 11, 2) for bus in range(3)])
    with ExitStack() as stack, scenario_plant.serving(site, port, 6) as plant:
        started = {
            name: stack.enter_context(_started(folder, name, letter, plant.url, str(plant.commands)))
            for name, letter in PYTHON.items()
        }
        until(lambda: all(one.is_at_the_end() for one in started.values()), LIMIT_S, "all are at the end")
        time.sleep(0.2)
        plant.end()
        for one in started.values():
            one.process.wait(30)
        yield started


def _started(folder: Path, name: str, letter: str, *more: str) -> _Started:
    command = [sys.executable, "-m", f"tests.wire.scenarios.{name}_scenario", letter, str(folder), *more]
    return _Started(command, folder / f"{name}.log")


class _Started:
    """A script that is killed where the test fails."""

    def __init__(self, command: list[str], log: Path) -> None:
        self.command, self.log = command, log

    def __enter__(self) -> Client:
        environment = {**os.environ, "PYTHONPATH": str(REPOSITORY), "PYTHONUNBUFFERED": "1"}
        with self.log.open("wb") as output:
            self._process = subprocess.Popen(
                self.command, stdout=output, stderr=output, env=environment, cwd=REPOSITORY
            )
        return Client(self._process, self.log)

    def __exit__(self, *_: object) -> None:
        self._process.kill()
        self._process.wait()


@pytest.mark.parametrize("name", PYTHON)
def test_each_step_is_answered_as_it_is_written(clients: Mapping[str, Client], name: str) -> None:
    client = clients[name]
    steps = [one["step"] for one in client.said() if "step" in one]
    assert client.process.returncode == 0, client.log.read_text(errors="replace")[-3000:]
    assert len(steps) >= 60
