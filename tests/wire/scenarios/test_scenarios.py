"""Days of three OPC UA clients that we did not write, at one server, step by step.

The scripts run beside each other, each on a part of the plant that is its own; then the server is ended,
which is announced to all of them.
"""

from __future__ import annotations

import json
import os
import shutil
import subprocess
import sys
from collections.abc import Iterator, Mapping, Sequence
from contextlib import ExitStack, contextmanager
from dataclasses import dataclass
from pathlib import Path

import pytest

from tests.support import scenario_plant
from tests.support.process import REPOSITORY, free_port, until
from tests.wire.scenarios.node_steps import STEPS

NODE = REPOSITORY / "tests" / "wire" / "node"
HAS_NODE = shutil.which("node") is not None and (NODE / "node_modules" / "node-opcua-client").is_dir()
pytestmark = [pytest.mark.landing, pytest.mark.timeout(300)]
SCRIPTS = {
    "asyncua": [sys.executable, "-m", "tests.wire.scenarios.asyncua_scenario", "a"],
    "o6": [sys.executable, "-m", "tests.wire.scenarios.o6_scenario", "b"],
    "node-opcua": ["node", str(NODE / "scenario.mjs"), "c"],
}
LIMIT_S = 150.0
LEAST = 60


@dataclass(frozen=True)
class Client:
    """A client's script, and where its output is."""

    process: subprocess.Popen[bytes]
    log: Path

    def said(self) -> list[dict[str, object]]:
        """Clients write what they think of certificates to the standard output, too."""
        lines = self.log.read_text(encoding="utf-8", errors="replace").splitlines()
        return [json.loads(line) for line in lines if line.startswith("{") and line.endswith("}")]

    def steps(self) -> list[dict[str, object]]:
        """What it has said, when it has ended by itself."""
        assert self.process.returncode == 0, self.log.read_text(errors="replace")[-3000:]
        return [one for one in self.said() if "step" in one]

    def has_come_to_the_end(self) -> bool:
        return self.process.poll() is not None or {"waiting": "end"} in self.said()


@contextmanager
def started(name: str, folder: Path, arguments: Sequence[str]) -> Iterator[Client]:
    log = folder / f"{name}.log"
    more = {"PYTHONPATH": str(REPOSITORY), "PYTHONUNBUFFERED": "1", "HOME": str(folder)}
    with log.open("wb") as output:
        process = subprocess.Popen(
            [*SCRIPTS[name], *arguments],
            stdin=subprocess.DEVNULL,
            stdout=output,
            stderr=output,
            env=os.environ | more,
            cwd=REPOSITORY,
        )
    try:
        yield Client(process, log)
    finally:
        process.kill()
        process.wait()


@pytest.fixture(scope="module")
def clients(tmp_path_factory: pytest.TempPathFactory) -> Iterator[Mapping[str, Client]]:
    """All of them, when they have ended."""
    folder, port = tmp_path_factory.mktemp("scenarios"), free_port()
    scenario_plant.lay_out(folder)
    site = scenario_plant.write_site(folder, port, [scenario_plant.nodes_of(bus, 11, 2) for bus in range(3)])
    names = [name for name in SCRIPTS if HAS_NODE or name != "node-opcua"]
    with ExitStack() as stack, scenario_plant.serving(site, port, 6) as plant:
        arguments = (str(folder), plant.url, str(plant.commands))
        running = {name: stack.enter_context(started(name, folder, arguments)) for name in names}
        until(lambda: all(one.has_come_to_the_end() for one in running.values()), LIMIT_S, "the end", 0.2)
        plant.end()
        for one in running.values():
            one.process.wait(30)
        yield running


@pytest.mark.parametrize("name", ["asyncua", "o6"])
def test_each_step_is_answered_as_the_script_has_it(clients: Mapping[str, Client], name: str) -> None:
    assert len(clients[name].steps()) >= LEAST


@pytest.mark.skipif(
    not HAS_NODE, reason="node-opcua is not there: install nodejs and npm, then `make clients`"
)
def test_each_step_of_node_opcua_is_answered_as_the_table_has_it(clients: Mapping[str, Client]) -> None:
    assert [(one["step"], one["got"]) for one in clients["node-opcua"].steps()] == STEPS
    assert len(STEPS) >= LEAST
