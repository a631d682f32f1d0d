"""The site file: every key and value it names is read, and every fault in it is told in one run."""

from __future__ import annotations

from pathlib import Path

import pytest

from bridge.base.errors import FileFaults
from bridge.config import load_site
from bridge.text import as_json, render
from tests.support.small_site import faults

BROKEN = """\
[site]
name = "Hall 3"
sate_dir = "/tmp"

[[bus]]
name = "can0"
interface = "socketcan"
bitrate = "250000"
deadman_ms = 15

[[bus.node]]
name = "conveyor"
id = 128
mapping = "nord/sk-tu4-cao"
supervision = "heartbeet"

[[bus.node.drive]]
slot = "fu1"
unit_id = 1
control = "modbus"
telegram_downtime_s = 0.05

[[bus.node.drive]]
slot = "fu1"
unit_id = 1
control = "opcua"
fieldbus_timeout_ms = 40000
parameters = { P105 = -50.0 }

[[bus.node]]
name = "conveyor"
id = 127
[[bus.node.drive]]
slot = "fu1"
name = "node"

[modbus]
listen = "localhost"
allow = ["127.0.0.0/8", "127.0.0.0/99"]
word_order = "DCAB"

[zenoh]
listen = ["127.0.0.1:7447"]
prefix = "a/*"
"""


def test_every_fault_of_a_file_is_told_in_one_run_with_its_line(tmp_path: Path):
    assert faults(tmp_path, BROKEN) == [
        '2: site.name: must be lower_snake_case: a letter, then letters, digits and _, not "Hall 3" '
        "(a name for this site, lower_snake_case)",
        "3: site.sate_dir: is not a key that belongs here (did you mean state_dir?)",
        "5: bus[0]: interface 'socketcan' needs a channel (such as channel = \"can0\")",
        '8: bus[0].bitrate: must be a whole number, not "250000" (10000…1000000 bit/s)',
        "9: bus[0].deadman_ms: 15 ms is too short for process data every 10 ms "
        "(at least 20: the dead-man burst must outlive one lost cycle)",
        "13: bus[0].node[0].id: must be at most 127, not 128 (the node's CANopen address, 1…127)",
        '15: bus[0].node[0].supervision: must be "heartbeat", "guarding" or "none", not "heartbeet" '
        '(did you mean "heartbeat"?)',
        "17: bus[0].node[0].drive[0].fieldbus_timeout_ms: is missing: a drive that can be commanded states "
        "how long its controller may be silent (1…32767 ms, or 0 for no supervision, which is a decision)",
        "21: bus[0].node[0].drive[0].telegram_downtime_s: must be -0.1 (ignore), 0 (off) or 0.1…100.0, "
        "not 0.05",
        "24: bus[0].node[0].drive[1].slot: slot 'fu1' is used twice (first used in line 18)",
        "25: bus[0].node[0].drive[1].unit_id: unit id 1 is used twice (first used in line 19)",
        "26: bus[0].node[0].drive[1].control: the drive is controlled by opcua, which this site does not "
        "serve (add a [opcua] table)",
        "27: bus[0].node[0].drive[1].fieldbus_timeout_ms: must be at most 32767, not 40000 "
        "(0 (off) or 1…32767 ms, like P151)",
        "28: bus[0].node[0].drive[1].parameters.P105: must be more than 0.0, not -50.0",
        "30: bus[0].node[1].mapping: is missing "
        "(a file below mappings/ without .toml, such as nord/sk-tu4-cao)",
        "31: bus[0].node[1].name: node name 'conveyor' is used twice (first used in line 12)",
        "32: bus[0].node[1].id: node id 127 is the bridge's own (change it or master_node_id)",
        "35: bus[0].node[1].drive[0].name: 'node' is reserved (choose another name)",
        '38: modbus.listen: must be an address and a port such as 127.0.0.1:4840, not "localhost" '
        "(address:port)",
        "39: modbus.allow[1]: must be a network such as 192.168.1.0/24: '127.0.0.0/99' does not appear to "
        'be an IPv4 or IPv6 network, not "127.0.0.0/99"',
        '40: modbus.word_order: must be "ABCD", "CDAB", "BADC" or "DCBA", not "DCAB" (did you mean "DCBA"?)',
        "43: zenoh.listen[0]: must be a protocol and an address such as tcp/192.168.1.10:7447, "
        'not "127.0.0.1:7447"',
        '44: zenoh.prefix: must be words of letters, digits and _ . - with / between them, not "a/*"',
    ]


def test_every_fault_of_a_file_is_a_text_with_a_code(tmp_path: Path):
    path = tmp_path / "site.toml"
    path.write_text(BROKEN, encoding="utf-8")
    with pytest.raises(FileFaults) as caught:
        load_site(path)
    assert all(as_json(fault.said) for fault in caught.value.faults)
    german = {fault.line: render(fault.text, "de").partition(": ")[2] for fault in caught.value.faults}
    assert german[5] == (
        "bus[0]: die Schnittstelle 'socketcan' braucht einen Kanal (etwa channel = \"can0\")"
    )
    assert german[24] == "bus[0].node[0].drive[1].slot: Slot 'fu1' ist doppelt vergeben (zuerst in Zeile 18)"
    assert german[44] == (
        "zenoh.prefix: muss aus Wörtern mit / dazwischen bestehen, jedes aus Buchstaben, Ziffern und _ . -, "
        'nicht "a/*"'
    )


@pytest.mark.parametrize(
    ("text", "told"),
    [
        (
            "",
            [
                "site: is missing (a [site] table with a name)",
                "bus: is missing (a [[bus]] table for each bus)",
            ],
        ),
        (
            '[site]\nname = "a"\n[bus]\nname = "b"\n',
            ["3: bus: must be a list (a [[bus]] table for each bus)"],
        ),
        ('bus = 5\n[site]\nname = "a"', ["1: bus: must be a list, not 5 (a [[bus]] table for each bus)"]),
    ],
)
def test_what_is_missing_is_told_with_what_would_be_right(tmp_path: Path, text: str, told: list[str]):
    found = faults(tmp_path, text)
    assert len(found) == len(told)
    for one, start in zip(found, told, strict=True):
        assert one.startswith(start)
