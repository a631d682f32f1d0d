"""The sites of the lab: a SK TU4-CAO on vcan0, one drive for each protocol."""

from __future__ import annotations

from dataclasses import dataclass
from pathlib import Path

from tests.support.process import free_port

_SITE = """
[site]
name = "lab"
state_dir = "{folder}/state"
runtime_dir = "{folder}/run"

[[bus]]
name = "can0"
interface = "socketcan"
channel = "vcan0"
bitrate = 1000000
{bus}

[[bus.node]]
name = "conveyor"
id = 5
mapping = "nord/sk-tu4-cao"
{drives}

[modbus]
listen = "127.0.0.1:{modbus}"

[opcua]
listen = "127.0.0.1:{opcua}"
no_security = true
anonymous = "operator"

[zenoh]
listen = ["tcp/127.0.0.1:{zenoh}"]
"""

_DRIVE = """
[[bus.node.drive]]
slot = "{slot}"
unit_id = {unit}
control = "{control}"
fieldbus_timeout_ms = {timeout_ms}
parameters = {{ P105 = 50.0, P112 = 10.0 }}
"""


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
) -> LabSite:
    """Write a site with fu1, fu2, fu3 controlled as ``controls`` says, on free ports."""
    site = LabSite(folder / "site.toml", free_port(), free_port(), free_port())
    drives = "".join(
        _DRIVE.format(slot=f"fu{n}", unit=n, control=control, timeout_ms=timeout_ms)
        for n, control in enumerate(controls, 1)
    )
    text = _SITE.format(
        folder=folder,
        bus=bus,
        drives=drives,
        modbus=site.modbus_port,
        opcua=site.opcua_port,
        zenoh=site.zenoh_port,
    )
    site.path.write_text(text, encoding="utf-8")
    return site
