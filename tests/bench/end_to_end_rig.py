"""A bridge with its plant and its clients, each a process, on a bus of their own."""

from __future__ import annotations

import contextlib
import sys
import time
from collections.abc import Callable, Iterator, Mapping, Sequence
from dataclasses import dataclass
from pathlib import Path

from tests.bench.pair import managers, named, wire
from tests.bench.reference.command_line import Ports
from tests.support.process import REPOSITORY, Process, free_port, peer, running

NODES = 10
LIMIT_S = 60.0


@dataclass(frozen=True, slots=True)
class Traffic:
    """What the plant sends once it is told to: PDOs a second, percent of them new, and for how long."""

    rate: int
    changed: int
    seconds: float


@dataclass(frozen=True, slots=True)
class Client:
    """A script of ``tests/peers``, its arguments, and what it prints when it is there."""

    script: str
    arguments: Sequence[object]
    is_there: str


@dataclass(frozen=True, slots=True)
class Rig:
    bridge: Process
    plant: Process
    clients: dict[str, Process]

    def wait(self, process: Process, text: str, limit_s: float = LIMIT_S) -> None:
        """Until the process says so. Raises TimeoutError; RuntimeError where it or the bridge has ended."""
        end = time.monotonic() + limit_s
        while True:
            ended = [one for one in (self.bridge, process) if one.popen.poll() is not None]
            if text in process.output():
                return
            for one in ended:
                raise RuntimeError(f"ended with {one.popen.returncode}:\n{one.output()}")
            if time.monotonic() > end:
                said = f"{process.output()}\n{self.bridge.output()}"
                raise TimeoutError(f"no {text!r} within {limit_s:g} s:\n{said}")
            time.sleep(0.05)


@contextlib.contextmanager
def rig(
    name: str, traffic: Traffic, folder: Path, clients: Callable[[Ports], Mapping[str, Client]]
) -> Iterator[Rig]:
    """All of them, running and connected. The plant's report is ``plant.json`` in ``folder``, once it has
    ended."""
    with wire() as (near, far), managers() as (manager, kernel), contextlib.ExitStack() as stack:
        at = Ports(f"{named(near)},{manager.fileno()}", NODES, *(free_port() for _ in range(3)))
        what = traffic.rate, traffic.changed, traffic.seconds
        sends = (named(far), kernel.fileno(), NODES, *what, folder / "plant.json")
        files = [far.fileno(), kernel.fileno()]
        plant = stack.enter_context(peer(folder, "traffic", *map(str, sends), files=files))
        plant.wait_output("are there", LIMIT_S)
        script = REPOSITORY / "tests" / "bench" / "reference" / f"{name}.py"
        command = [sys.executable, str(script), *at.arguments]
        bridge = stack.enter_context(running(folder, name, *command, files=[near.fileno(), manager.fileno()]))
        made = Rig(bridge, plant, {})
        made.wait(plant, "all operational")
        for title, client in clients(at).items():
            # Each has a log of its own, also where several run one script.
            script = REPOSITORY / "tests" / "peers" / f"{client.script}.py"
            command = [sys.executable, str(script), *map(str, client.arguments)]
            made.clients[title] = stack.enter_context(running(folder, title, *command))
        for title, client in clients(at).items():
            made.wait(made.clients[title], client.is_there)
        yield made
