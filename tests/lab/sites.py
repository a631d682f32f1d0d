"""The sites of the lab: a SK TU4-CAO on vcan0, one drive for each protocol."""

from __future__ import annotations

import json
import time
from dataclasses import dataclass
from pathlib import Path
from typing import Final

from tests.support import sites
from tests.support.process import free_port, peer_called

_FRONT_S: Final = 30.0
"""So late the front of zenoh may be on a slow machine."""


@dataclass(frozen=True, slots=True)
class LabSite:
    path: Path
    modbus_port: int
    opcua_port: int
    zenoh_port: int

    @property
    def opcua_url(self) -> str:
        return f"opc.tcp://127.0.0.1:{self.opcua_port}"

    @property
    def zenoh_endpoint(self) -> str:
        return f"tcp/127.0.0.1:{self.zenoh_port}"


def ask(site: LabSite, *questions: str) -> list[list[dict[str, object]]]:
    """Questions to zenoh from a second process: ``KEY=PAYLOAD``, or ``KEY=`` for the point itself. The front
    that answers may be there later than the bus process."""
    end = time.monotonic() + _FRONT_S
    while True:
        done = peer_called("zenoh_ask", site.zenoh_endpoint, *questions)
        answers = [json.loads(line) for line in done.stdout.splitlines()]
        if done.returncode == 0 and all(answers):
            return answers
        assert time.monotonic() < end, f"no answer within {_FRONT_S} s: {answers} {done.stderr}"


def values(site: LabSite, *points: str) -> list[object]:
    """The values of points, such as ``conveyor/fu1/status/state``."""
    return [answer["v"] for [answer] in ask(site, *(f"drives/lab/{point}=" for point in points))]


def lab_site(
    folder: Path,
    *,
    timeout_ms: int,
    controls: tuple[str, ...] = ("modbus", "opcua", "zenoh"),
    bus: str = "",
    node: str = "",
    drives: tuple[str, ...] = (),
    more: str = "",
    recorded: bool = False,
) -> LabSite:
    """Write a site with fu1, fu2, fu3 controlled as ``controls`` says, on free ports.

    ``bus``, ``node`` and ``drives`` (for each) are further keys, ``more`` further nodes of the bus. Nothing
    is recorded unless it is to be: in a user-mode kernel each page that a process writes after it has made
    another one takes a hundred times as long.
    """
    ports = free_port(), free_port(), free_port()
    keys = (*drives, *[""] * len(controls))
    tables = [
        sites.drive(f"fu{n}", control, timeout_ms, f"unit_id = {n}\n{sites.SCALED}\n{keys[n - 1]}")
        for n, control in enumerate(controls, 1)
    ]
    servers = sites.modbus(ports[0]), sites.opcua(ports[1]), sites.zenoh(ports[2])
    on_vcan0 = sites.socketcan(sites.node(*tables, more=node), more, more=bus)
    recorder = f"[recorder]\nenabled = {'true' if recorded else 'false'}\n"
    path = sites.write(folder, on_vcan0, *servers, recorder, name="lab")
    return LabSite(path, *ports)
