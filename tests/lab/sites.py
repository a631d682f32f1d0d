"""The sites of the lab: a SK TU4-CAO on vcan0, one drive for each protocol."""

from __future__ import annotations

from dataclasses import dataclass
from pathlib import Path

from tests.support import sites
from tests.support.process import free_port


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


def lab_site(
    folder: Path,
    *,
    timeout_ms: int,
    controls: tuple[str, ...] = ("modbus", "opcua", "zenoh"),
    bus: str = "",
    node: str = "",
) -> LabSite:
    """Write a site with fu1, fu2, fu3 controlled as ``controls`` says, on free ports."""
    ports = free_port(), free_port(), free_port()
    drives = [
        sites.drive(f"fu{n}", control, timeout_ms, f"unit_id = {n}\n{sites.SCALED}")
        for n, control in enumerate(controls, 1)
    ]
    servers = sites.modbus(ports[0]), sites.opcua(ports[1]), sites.zenoh(ports[2])
    on_vcan0 = sites.socketcan(sites.node(*drives, more=node), more=bus)
    path = sites.write(folder, on_vcan0, *servers, name="lab")
    return LabSite(path, *ports)
