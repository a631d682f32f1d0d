"""Nodes that are no drives: an encoder and an I/O block of nobody's make."""

from __future__ import annotations

from pathlib import Path

from bridge.eds import Description, read_device_file
from bridge.mapping.site_families import load_site_and_families
from tests.support.bench import Bench
from tests.support.pdo_node import PdoNode

DEVICES = Path(__file__).parents[1] / "devices"
"""Device descriptions of an I/O block and an encoder."""
ENCODER = """\
extends = "generic/device"
[family]
name = "Encoder"
vendor = "Acme"
source = "nobody's manual"

[identity]
vendor_id = 0xACE

[[input]]
name = "position"
object = "6004:00"
data_type = "int32"
factor = 0.001
unit = "rev"
description = "position of the shaft"

[[input]]
name = "speed"
object = "6030:01"
data_type = "int16"

[[input]]
name = "alarms"
object = "6503:00"
data_type = "uint16"
bits = ["position_error", "commissioning"]

[[parameter]]
name = "6000"
title = "operating parameters"
data_type = "uint16"
point = true
"""
SITE = """\
[site]
name = "hall"
[[bus]]
name = "can0"
interface = "virtual"
[[bus.node]]
name = "shaft"
id = 20
mapping = "acme/encoder"
{node}
"""


def encoder() -> PdoNode:
    """Position by timer, alarms by SYNC; no PDO carries the speed."""
    node = PdoNode(20)
    node.put("1018:01", 4, 0xACE)
    node.put("6000:00", 2, 4)
    node.pdo("tpdo", 1, 0x180, ["6004:00/32"], event_ms=100)
    node.pdo("tpdo", 2, 0x280, ["6503:00/16"], event_ms=100)
    node.put("6004:00", 4, -1500)
    return node


def device_bench(folder: Path, node: PdoNode, mapping: str = ENCODER, more: str = "") -> Bench:
    file = folder / "mappings" / "acme" / "encoder.toml"
    file.parent.mkdir(parents=True, exist_ok=True)
    file.write_text(mapping, encoding="utf-8")
    path = folder / "site.toml"
    path.write_text(SITE.format(node=more), encoding="utf-8")
    site, families = load_site_and_families(path)
    return Bench(site, family=families["acme/encoder"], mapping="acme/encoder", node=node)


IO_BLOCK = """\
extends = "generic/device"
[family]
name = "I/O block"
vendor = "Acme"
source = "nobody's manual"

[[input]]
name = "inputs"
object = "6000:01"
data_type = "uint8"

[[output]]
name = "valves"
object = "6200:01"
data_type = "uint8"
bits = ["inlet", "outlet"]
error_mode = "6206:01"
error_value = "6207:01"

[[output]]
name = "speed"
object = "6411:01"
data_type = "int16"
factor = 0.1
unit = "Hz"
on_expiry = 5
error_mode = "6443:01"
error_value = "6444:01"

[[output]]
name = "lamp"
object = "6411:02"
data_type = "int16"
on_expiry = "hold"
"""
OUTPUTS = """\
own_timeout_ms = 300
[bus.node.outputs]
control = "modbus"
fieldbus_timeout_ms = 200
[modbus]
listen = "127.0.0.1:1502"
"""


def io_block() -> PdoNode:
    """Two PDOs to it, digital and analogue; it holds 77 in what the lamp has."""
    node = PdoNode(20)
    node.put("6206:01", 1, 0xFF)
    node.put("6207:01", 1, 0)
    node.put("6443:01", 1, 1)
    node.put("6444:01", 4, 50)
    node.put("1016:01", 4, 127 << 16 | 300)
    node.pdo("tpdo", 1, 0x180, ["6000:01/8"], event_ms=100)
    node.pdo("rpdo", 1, 0x200, ["6200:01/8"])
    node.pdo("rpdo", 2, 0x300, ["6411:01/16", "6411:02/16"])
    node.put("6411:02", 2, 77)
    return node


def description_of(file: str) -> Description:
    """One of ``DEVICES``."""
    return read_device_file(DEVICES / file)
