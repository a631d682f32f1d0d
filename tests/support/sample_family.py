"""A mapping file with a bit of everything, and what is told of it with some of it changed."""

from __future__ import annotations

from pathlib import Path

import pytest

from bridge.base.errors import FileFaults
from bridge.mapping import read_family

FAMILY = """\
[family]
name = "Test"
vendor = "Nobody"
source = "none"
[process]
rpdo = ["control_word", "setpoint_1"]
tpdo = ["status_word", "value_1"]
[[slot]]
name = "one"
[slot.rpdo]
number = 1
cob_id = 0x200
objects = [["6040:00"], ["6042:00"]]
[slot.tpdo]
number = 1
cob_id = 0x180
objects = [["6041:00"], ["6044:00"]]
[[value]]
name = "velocity"
group = "command"
word = "setpoint_1"
scale = { full = "P1", at = 1000 }
unit = "1/min"
[[parameter]]
name = "P1"
title = "full speed"
object = "2001:00"
data_type = "uint16"
[[poll]]
name = "inputs"
object = "60FD:00"
data_type = "uint16"
every_ms = 500
[control_word]
bits = []
acknowledge_bit = 7
enabling = { mask = 0x0F, value = 0x0F }
stopped = 0
ready = 6
run = 15
stop = { mask = 1, value = 0 }
quick_stop = { mask = 4, value = 0 }
disable_voltage = { mask = 2, value = 0 }
[status_word]
bits = []
state = [
  { name = "ready", pattern = "01X0001" },
  { name = "fault", pattern = "0XX1000" }, { name = "operation_enabled", pattern = "01X0111" },
]
[emcy.codes]
0000 = "no fault"
[faults]
controller_silent = 1.0
bridge_timeout = 2.0
telegram_downtime = 3.0
node_missing = 4.0
[faults.texts]
"1.0" = "silent"
"""


def told(folder: Path, text: str) -> list[str]:
    path = folder / "family.toml"
    path.write_text(text)
    with pytest.raises(FileFaults) as caught:
        read_family(path)
    return [str(fault).removeprefix(f"{path}:") for fault in caught.value.faults]
