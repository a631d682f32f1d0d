"""A drive of an invented maker: one mapping file and a slave of no maker."""

from __future__ import annotations

from pathlib import Path
from typing import Any

from bridge.mapping.site_families import load_site_and_families
from tests.support.bench import Bench
from tests.support.pdo_node import PdoNode

NAME = "acme/spin"
SPIN = """\
[family]
name = "Spin 3000"
vendor = "Acme"
source = "nobody's manual"

[identity]
vendor_id = 0xACE

[process]
rpdo = ["control_word", "speed", "target_low", "target_high", "modes", "valves"]
tpdo = ["status_word", "speed_now", "position_low", "position_high", "modes_now", "inputs"]

[[slot]]
name = "axis"
parameters_by_sdo = true
start = [{ object = "6060:00", type = "int8", value = 3 }]
[[slot.rpdo]]
number = 1
cob_id = 0x200
words = ["control_word", "speed"]
objects = [["6040:00"], ["6042:00"]]
[[slot.rpdo]]
number = 2
cob_id = 0x300
words = ["target_low", "target_high", "modes"]
objects = [["607A:00"], ["607A:00"], ["2AC8:00+2830:00"]]
[[slot.rpdo]]
number = 3
cob_id = 0x400
words = ["valves"]
objects = [["2100:00/8"]]
optional = true
[[slot.tpdo]]
number = 1
cob_id = 0x180
words = ["status_word", "speed_now"]
objects = [["6041:00"], ["6044:00"]]
[[slot.tpdo]]
number = 2
cob_id = 0x280
words = ["position_low", "position_high", "modes_now"]
objects = [["6064:00"], ["6064:00"], ["2AC9:00+2831:00"]]
write = true
event_ms = 100
[[slot.tpdo]]
number = 3
cob_id = 0x380
words = ["inputs"]
objects = [["60FD:00/8"]]
optional = true

[[value]]
name = "speed"
group = "actual"
word = "speed_now"
scale = { full = "P7", at = 1000 }
unit = "1/min"
[[value]]
name = "velocity"
group = "command"
word = "speed"
scale = { full = "P7", at = 1000 }
unit = "1/min"
[[value]]
name = "position"
group = "actual"
words = ["position_low", "position_high"]
scale = { factor = 0.01, offset = -5.0 }
unit = "mm"
[[value]]
name = "target"
group = "command"
words = ["target_low", "target_high"]
scale = { factor = 0.01, offset = -5.0 }
low = -100.0
high = 1000.0
unit = "mm"
[[value]]
name = "mode"
group = "command"
word = "modes"
states = { 0 = "none", 1 = "profile position", 3 = "profile velocity" }
[[value]]
name = "valve_a"
group = "command"
word = "valves"
bit = 0
[[value]]
name = "valve_b"
group = "command"
word = "valves"
bit = 3
[[value]]
name = "in_position"
group = "actual"
word = "status_word"
bit = 10
[[value]]
name = "probes"
group = "actual"
word = "inputs"
bits = ["left", "right"]

[parameter_names]
pattern = 'P(?P<number>\\d+)'
example = "P7"
index = 0x2000

[[parameter]]
name = "P7"
title = "full speed"
data_type = "uint16"
unit = "1/min"
[[parameter]]
name = "P90"
title = "present fault"
data_type = "uint16"
factor = 0.1
[[parameter]]
name = "P91"
title = "last fault"
data_type = "uint16"
factor = 0.1

[control_word]
bits = ["switch_on", "enable_voltage", "quick_stop", "enable_operation"]
acknowledge_bit = 7
enabling = { mask = 0x0F, value = 0x0F }
stopped = 0
ready = 6
run = 15
stop = { mask = 1, value = 0 }
quick_stop = { mask = 4, value = 0 }
disable_voltage = { mask = 2, value = 0 }

[status_word]
bits = ["ready_to_switch_on", "switched_on", "operation_enabled", "fault"]
state = [
  { name = "switch_on_inhibited", pattern = "1XX0000" },
  { name = "ready", pattern = "01X0001" },
  { name = "operation_enabled", pattern = "01X0111" },
  { name = "fault", pattern = "0XX1000" },
]

[emcy]
event = { byte = 3, cause_byte = 4, gone = 30 }
[emcy.codes]
"0000" = "no fault"
"10xx" = "generic fault"
[emcy.events]
"41" = "motor temperature"

[faults]
controller_silent = 1.0
bridge_timeout = 2.0
telegram_downtime = 3.0
node_missing = 4.0
current = { parameter = "P90" }
last = { parameter = "P91" }
[faults.texts]
"1.0" = "controller silent"
"7.2" = "spindle too hot"
"""

SITE = """\
[site]
name = "hall"
[[bus]]
name = "can0"
interface = "virtual"
[[bus.node]]
name = "spindle"
id = 9
mapping = "acme/spin"
{node}[[bus.node.drive]]
slot = "axis"
control = "modbus"
fieldbus_timeout_ms = 500
{drive}
[modbus]
"""
_STATUS = {0x0: 0x0240, 0x6: 0x0221, 0xF: 0x0227}
"""The drive's answer to the lowest four bits of a control word."""


class Application:
    """Answers a control word once; what a test puts into the status word stays until the next one."""

    def __init__(self) -> None:
        self._last = 0

    def __call__(self, node: PdoNode) -> None:
        word = node.number("6040:00")
        if word != self._last:
            self._last = word
            node.put("6041:00", 2, _STATUS.get(word & 0xF, 0x0240))
        node.put("6044:00", 2, node.number("6042:00"))


def spindle() -> PdoNode:
    """The slave as the mapping file has it, its optional PDOs off."""
    node = PdoNode(9, Application())
    node.put("1018:01", 4, 0xACE)
    node.put("6060:00", 1, 0)
    node.put("2007:00", 2, 3000)
    node.put("205A:00", 2, 0)
    node.put("205B:00", 2, 0)
    node.pdo("rpdo", 1, 0x200, ["6040:00/16", "6042:00/16"])
    node.pdo("rpdo", 2, 0x300, ["607A:00/32", "2AC8:00/8", "2830:00/8"])
    node.pdo("rpdo", 3, 0x400, ["2100:00/8"], on=False)
    node.pdo("tpdo", 1, 0x180, ["6041:00/16", "6044:00/16"], event_ms=50)
    node.pdo("tpdo", 2, 0x280, ["6064:00/32", "2AC9:00/8", "2831:00/8"], event_ms=100)
    node.pdo("tpdo", 3, 0x380, ["60FD:00/8"], on=False)
    node.put("6041:00", 2, 0x0240)
    return node


def spin_bench(
    folder: Path, node: PdoNode, *, mapping: str = SPIN, drive: str = "", table: str = ""
) -> Bench:
    """A bench of a site whose own folder has the mapping file. ``table`` is more of the node's table."""
    file = folder / "mappings" / f"{NAME}.toml"
    file.parent.mkdir(parents=True, exist_ok=True)
    file.write_text(mapping, encoding="utf-8")
    path = folder / "site.toml"
    path.write_text(SITE.format(drive=drive, node=table and f"{table}\n"), encoding="utf-8")
    site, families = load_site_and_families(path)
    return Bench(site, family=families[NAME], mapping=NAME, node=node)


def command(bench: Bench, **values: Any) -> Any:
    return bench.write("spindle/drive", **values)
