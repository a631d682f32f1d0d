"""Site files for tests, put together from their tables.

``site(bus(node(drive("fu1", "modbus", 200))), modbus())`` is the text of one with a single drive. ``more`` is
TOML text with further keys of the same table.
"""

from __future__ import annotations

import tomllib
from functools import cache
from pathlib import Path

from bridge.catalogue import Catalogue
from bridge.command import Plant
from bridge.config import Site
from bridge.mapping import load_family

FAMILY = "nord/sk-tu4-cao"
SCALED = "parameters = { P105 = 50.0, P112 = 10.0 }"
"""Scales of setpoints and currents: P105 in Hz, P112 in A."""

ACCEPTED = 'accepts = { runs_on = "nothing moves in a test" }'
"""Acceptance of a drive whose simulation does not watch the bridge: as it leaves the works."""

family = cache(load_family)


def drive(slot: str, control: str, timeout_ms: int, more: str = SCALED) -> str:
    return f"""
[[bus.node.drive]]
slot = "{slot}"
control = "{control}"
fieldbus_timeout_ms = {timeout_ms}
{more}
"""


def node(
    *drives: str, name: str = "conveyor", node_id: int = 5, mapping: str = FAMILY, more: str = ""
) -> str:
    """A SK TU4-CAO, node 5 of its bus, where nothing else is said."""
    return f"""
[[bus.node]]
name = "{name}"
id = {node_id}
mapping = "{mapping}"
{more}
{"".join(drives)}"""


BESIDE_A_BROWSER = "deadman_ms = 1000"
"""A browser that starts leaves the bridge without a CPU for longer than the default lets it hang."""


def bus(*nodes: str, name: str = "can0", interface: str = "virtual", more: str = "") -> str:
    return f"""
[[bus]]
name = "{name}"
interface = "{interface}"
{more}
{"".join(nodes)}"""


def socketcan(*nodes: str, number: int = 0, more: str = "") -> str:
    """can0 on vcan0, can1 on vcan1, at 1 Mbit/s."""
    channel = f'channel = "vcan{number}"\nbitrate = 1000000\n{more}'
    return bus(*nodes, name=f"can{number}", interface="socketcan", more=channel)


def modbus(port: int | None = None) -> str:
    return f"[modbus]\n{_listen(port)}"


def opcua(port: int | None = None) -> str:
    """Without security, every client an operator."""
    return f'[opcua]\n{_listen(port)}no_security = true\nanonymous = "operator"\n'


def zenoh(port: int | None = None) -> str:
    return "[zenoh]\n" + ("" if port is None else f'listen = ["tcp/127.0.0.1:{port}"]\n')


def _listen(port: int | None) -> str:
    return "" if port is None else f'listen = "127.0.0.1:{port}"\n'


def site(*tables: str, name: str = "hall", folder: Path | None = None) -> str:
    """``folder`` takes what the service keeps and its sockets."""
    folders = "" if folder is None else f'state_dir = "{folder}/state"\nruntime_dir = "{folder}/run"\n'
    return f'[site]\nname = "{name}"\n{folders}' + "".join(tables)


def write(folder: Path, *tables: str, name: str = "hall") -> Path:
    """The site as ``folder/site.toml``."""
    path = folder / "site.toml"
    path.write_text(site(*tables, name=name, folder=folder), encoding="utf-8")
    return path


def catalogue_of(text: str, mapping: str = FAMILY) -> Catalogue:
    """The catalogue of a site's text, all of whose nodes have this mapping."""
    return Catalogue.of(Site.model_validate(parsed(text)), {mapping: family(mapping)})


def plant_of(text: str, mapping: str = FAMILY) -> Plant:
    """The plant of a site's text, all of whose nodes have this mapping, without a bus."""
    plant = Plant(catalogue_of(text, mapping), "1.2.3")
    has_default_meanings(plant)
    return plant


def has_default_meanings(plant: Plant) -> None:
    """Mark the drives as asked, and as their mapping takes them to be."""
    for drive in plant.drives.values():
        drive.channel.meanings.take_defaults()
        drive.compile()
        drive.refresh(0.0)


def parsed(text: str) -> dict[str, object]:
    return tomllib.loads(text)
