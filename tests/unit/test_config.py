"""The site file: what may stand in it, and that every fault in it is told in one run."""

from __future__ import annotations

from pathlib import Path

import pytest

from bridge.base.errors import FileFaults
from bridge.config import Site, load_site
from bridge.mapping.site import load_site_and_families

CONTRACT = """
[site]
name = "hall3"
state_dir = "/var/lib/drivebridge"      # optional

[[bus]]
name = "can0"
interface = "socketcan"                 # "virtual", or any python-can interface
channel = "can0"
bitrate = 250000                        # checked on SocketCAN, not set
master_node_id = 127
heartbeat_ms = 100                      # the bridge's own, 0 = off
sync_period_ms = 10                     # 0 = off
deadman_ms = 100

[[bus.node]]
name = "conveyor"
id = 5
mapping = "nord/sk-tu4-cao"             # a file below mappings/, without .toml
supervision = "heartbeat"               # "guarding", "none"
supervision_ms = 200
life_time_factor = 3                    # guarding
mandatory = true
hold_ms = 2000                          # quality lost → dead

[[bus.node.drive]]
slot = "fu1"                            # as the mapping calls it
name = "fu1"                            # default: the slot; a node with one drive calls it "drive"
unit_id = 1
control = "modbus"                      # "opcua", "zenoh", "lease", "none"
fieldbus_timeout_ms = 200               # P151 twin
telegram_downtime_s = 0.5               # P513 twin
on_expiry = "disable_voltage"
then_silence_ms = 0                     # 0 = never
parameters = { P105 = 50.0, P112 = 10.0 }   # scaling, where not read from the drive

[modbus]
listen = "127.0.0.1:502"
word_order = "ABCD"
allow = ["127.0.0.0/8"]
[opcua]
listen = "127.0.0.1:4840"
[zenoh]
mode = "peer"
listen = ["tcp/127.0.0.1:7447"]
connect = []
prefix = "drives"
"""
"""The example of the contract, as it stands there."""

SMALL = """
[site]
name = "hall"
[[bus]]
name = "can0"
interface = "virtual"
[[bus.node]]
name = "conveyor"
id = 5
mapping = "nord/sk-tu4-cao"
[[bus.node.drive]]
slot = "fu1"
"""


def load(folder: Path, text: str) -> Site:
    path = folder / "site.toml"
    path.write_text(text, encoding="utf-8")
    return load_site(path)


def faults(folder: Path, text: str) -> list[str]:
    """The faults as the user sees them, from the line number on."""
    with pytest.raises(FileFaults) as caught:
        load(folder, text)
    top = str(folder / "site.toml")
    return [str(fault).removeprefix(f"{top}:").removeprefix(top).strip(": ") for fault in caught.value.faults]


class TestTheContractsExample:
    def test_loads_with_every_key(self, tmp_path: Path):
        site = load(tmp_path, CONTRACT)
        (bus,) = site.bus
        (node,) = bus.node
        (drive,) = node.drive
        assert (bus.bitrate, bus.master_node_id, bus.sync_period_ms, bus.deadman_ms) == (
            250_000,
            127,
            10,
            100,
        )
        assert (node.id, node.supervision, node.life_time_factor, node.mandatory) == (5, "heartbeat", 3, True)
        assert (drive.control, drive.fieldbus_timeout_ms, drive.on_expiry) == (
            "modbus",
            200,
            "disable_voltage",
        )
        assert drive.parameters == {"P105": 50.0, "P112": 10.0}
        assert site.modbus is not None
        assert site.modbus.allow == ["127.0.0.0/8"]
        assert site.zenoh is not None
        assert site.zenoh.prefix == "drives"

    @pytest.mark.parametrize(
        "change",
        [
            ('supervision = "heartbeat"', 'supervision = "guarding"'),
            ('supervision = "heartbeat"', 'supervision = "none"'),
            ('control = "modbus"', 'control = "opcua"'),
            ('control = "modbus"', 'control = "zenoh"'),
            ('control = "modbus"', 'control = "lease"'),
            ('control = "modbus"', 'control = "none"'),
            ('on_expiry = "disable_voltage"', 'on_expiry = "quick_stop"'),
            ('on_expiry = "disable_voltage"', 'on_expiry = "stop"'),
            ('on_expiry = "disable_voltage"', 'on_expiry = "silence"'),
            ('on_expiry = "disable_voltage"', 'on_expiry = "hold"'),
            ("telegram_downtime_s = 0.5", "telegram_downtime_s = -0.1"),
            ("telegram_downtime_s = 0.5", "telegram_downtime_s = 0"),
            ("telegram_downtime_s = 0.5", "telegram_downtime_s = 100"),
            ("fieldbus_timeout_ms = 200", "fieldbus_timeout_ms = 32767"),
            ("sync_period_ms = 10", "sync_period_ms = 0"),
            ("heartbeat_ms = 100", "heartbeat_ms = 0"),
            ('word_order = "ABCD"', 'word_order = "CDAB"'),
            ('interface = "socketcan"', 'interface = "virtual"'),
            ("P105 = 50.0", "P105 = 50"),
        ],
    )
    def test_loads_with_every_value_it_names(self, tmp_path: Path, change: tuple[str, str]):
        assert change[0] in CONTRACT
        load(tmp_path, CONTRACT.replace(*change))


def test_defaults_are_those_of_the_contract(tmp_path: Path):
    site = load(tmp_path, SMALL)
    (bus,) = site.bus
    (node,) = bus.node
    (drive,) = node.drive
    assert site.site.state_dir == "/var/lib/drivebridge"
    assert (bus.bitrate, bus.master_node_id, bus.heartbeat_ms) == (250_000, 127, 100)
    assert (bus.sync_period_ms, bus.deadman_ms) == (10, 100)
    assert (node.supervision, node.supervision_ms, node.hold_ms) == ("heartbeat", 200, 2000)
    assert (node.mandatory, node.enabled) == (False, True)
    assert (drive.control, drive.fieldbus_timeout_ms) == ("none", None)
    assert (drive.telegram_downtime_s, drive.on_expiry, drive.then_silence_ms) == (0.5, "disable_voltage", 0)
    assert (site.modbus, site.opcua, site.zenoh) == (None, None, None)


def test_served_protocols_listen_on_loopback_unless_told_otherwise(tmp_path: Path):
    site = load(tmp_path, SMALL + "[modbus]\n[opcua]\n[zenoh]\n")
    assert site.modbus is not None
    assert site.opcua is not None
    assert site.zenoh is not None
    assert site.modbus.listen == "127.0.0.1:502"
    assert site.opcua.listen == "127.0.0.1:4840"
    assert site.zenoh.listen == ["tcp/127.0.0.1:7447"]


@pytest.mark.parametrize(
    ("sync_ms", "rpdo_ms", "period_s"), [(10, None, 0.01), (10, 25, 0.025), (0, None, 0.02), (0, 5, 0.005)]
)
def test_process_data_go_with_sync_or_every_20_ms(
    tmp_path: Path, sync_ms: int, rpdo_ms: int | None, period_s: float
):
    period = f"rpdo_period_ms = {rpdo_ms}\n" if rpdo_ms else ""
    lines = f'interface = "virtual"\nsync_period_ms = {sync_ms}\n{period}'
    site = load(tmp_path, SMALL.replace('interface = "virtual"\n', lines))
    assert site.bus[0].rpdo_period_s == period_s


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


class TestWhatDoesNotGoTogether:
    @pytest.mark.parametrize("control", ["modbus", "opcua", "zenoh", "lease"])
    def test_a_drive_that_can_be_commanded_states_its_time(self, tmp_path: Path, control: str):
        text = f'{SMALL}control = "{control}"\n[modbus]\n[opcua]\n[zenoh]\n'
        (fault,) = faults(tmp_path, text)
        assert fault.startswith("11: bus[0].node[0].drive[0].fieldbus_timeout_ms: is missing")

    @pytest.mark.parametrize("control", ["modbus", "opcua", "zenoh"])
    def test_a_protocol_that_controls_is_served(self, tmp_path: Path, control: str):
        text = f'{SMALL}control = "{control}"\nfieldbus_timeout_ms = 0\n'
        (fault,) = faults(tmp_path, text)
        assert fault.startswith(f"13: bus[0].node[0].drive[0].control: the drive is controlled by {control}")

    @pytest.mark.parametrize("control", ["modbus", "opcua", "zenoh", "lease"])
    @pytest.mark.parametrize(
        ("time", "may_be_off"),
        [
            ("fieldbus_timeout_ms = 0", True),
            ("fieldbus_timeout_ms = 200", False),
            (
                "fieldbus_timeout_ms = 200\nfieldbus_timeout_writable = true\n"
                "fieldbus_timeout_range_ms = [0, 500]",
                True,
            ),
            ("fieldbus_timeout_ms = 200\nfieldbus_timeout_writable = true", False),
            ("fieldbus_timeout_ms = 200\nfieldbus_timeout_range_ms = [0, 500]", False),
        ],
    )
    def test_a_dead_owner_blocks_nobody_for_ever(
        self, tmp_path: Path, control: str, time: str, may_be_off: bool
    ):
        """Of Modbus the end of a connection is known, and a lease ends by itself."""
        text = f'{SMALL}control = "{control}"\n{time}\nstop_by_anyone = {{}}\n[modbus]\n[opcua]\n[zenoh]\n'
        load(tmp_path, text.format("true"))
        if not may_be_off or control in ("modbus", "lease"):
            load(tmp_path, text.format("false"))
            return
        (fault,) = faults(tmp_path, text.format("false"))
        assert "stop_by_anyone: nobody would notice that an owner" in fault
        assert "from 1 ms on, or stop_by_anyone = true" in fault

    def test_a_lease_needs_no_protocol_of_its_own(self, tmp_path: Path):
        site = load(tmp_path, f'{SMALL}control = "lease"\nfieldbus_timeout_ms = 0\n')
        assert site.bus[0].node[0].drive[0].control == "lease"

    def test_names_and_numbers_are_unique_where_they_have_to_be(self, tmp_path: Path):
        second_bus = SMALL.replace('[site]\nname = "hall"\n', "")
        (bus, node) = faults(tmp_path, SMALL + second_bus)
        assert "bus name 'can0' is used twice (first used in line 5)" in bus
        assert "node name 'conveyor' is used twice (first used in line 8)" in node

    def test_a_node_id_may_come_again_on_another_bus(self, tmp_path: Path):
        second_bus = SMALL.replace('[site]\nname = "hall"\n', "").replace("can0", "can1")
        site = load(tmp_path, SMALL + second_bus.replace("conveyor", "lift"))
        assert [bus.node[0].id for bus in site.bus] == [site.bus[0].node[0].id] * 2

    def test_a_drive_named_as_another_drives_slot(self, tmp_path: Path):
        drive = '[[bus.node.drive]]\nslot = "{}"\n'
        (fault,) = faults(tmp_path, SMALL + drive.format("fu2") + 'name = "fu1"\n')
        assert fault.endswith("drive name 'fu1' is used twice (first used in line 12)")
        (fault,) = faults(tmp_path, SMALL + 'name = "fu2"\n' + drive.format("fu2"))
        assert fault.endswith("drive name 'fu2' is used twice (first used in line 13)")

    @pytest.mark.parametrize("name", ["bus", "bridge"])
    def test_names_of_the_bridges_own_points_are_reserved(self, tmp_path: Path, name: str):
        (fault,) = faults(tmp_path, SMALL.replace("conveyor", name))
        assert f"'{name}' is reserved" in fault

    def test_two_buses_on_one_channel(self, tmp_path: Path):
        bus = '[[bus]]\nname = "{}"\ninterface = "socketcan"\nchannel = "can0"\n'
        (fault,) = faults(tmp_path, '[site]\nname = "hall"\n' + bus.format("a") + bus.format("b"))
        assert fault == "10: bus[1].channel: socketcan channel 'can0' is used twice (first used in line 6)"

    def test_two_servers_on_one_port(self, tmp_path: Path):
        text = f'{SMALL}[modbus]\nlisten = "127.0.0.1:4840"\n[opcua]\nlisten = "127.0.0.1:4840"\n'
        (fault,) = faults(tmp_path, text)
        assert fault.startswith("16: opcua.listen: address '127.0.0.1:4840' is used twice")

    def test_a_user_is_there_once(self, tmp_path: Path):
        user = '[[opcua.user]]\nname = "ann"\nrole = "operator"\npassword_hash = "x"\n'
        (fault,) = faults(tmp_path, f"{SMALL}[opcua]\n{user}{user}")
        assert "user 'ann' is used twice" in fault

    @pytest.mark.parametrize(
        ("lines", "ok"),
        [
            ("deadman_ms = 20", True),
            ("deadman_ms = 19", False),
            ("sync_period_ms = 60", False),
            ("sync_period_ms = 0\ndeadman_ms = 40", True),
            ("sync_period_ms = 0\ndeadman_ms = 39", False),
            ("rpdo_period_ms = 50", True),
            ("rpdo_period_ms = 51", False),
        ],
    )
    def test_the_dead_man_burst_outlives_one_lost_cycle(self, tmp_path: Path, lines: str, ok: bool):
        text = SMALL.replace('interface = "virtual"', f'interface = "virtual"\n{lines}')
        if ok:
            load(tmp_path, text)
        else:
            assert "is too short for process data" in faults(tmp_path, text)[0]

    def test_the_bridges_own_node_id_is_free_without_a_heartbeat(self, tmp_path: Path):
        text = SMALL.replace("id = 5", "id = 127")
        assert "the bridge's own" in faults(tmp_path, text)[0]
        load(tmp_path, text.replace('interface = "virtual"', 'interface = "virtual"\nheartbeat_ms = 0'))


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


def test_a_node_of_drives_has_one(tmp_path: Path):
    path = tmp_path / "site.toml"
    path.write_text(SMALL.split("[[bus.node.drive]]")[0], encoding="utf-8")
    with pytest.raises(FileFaults) as told:
        load_site_and_families(path)
    assert str(told.value) == (
        f"{path}:7: bus[0].node[0].drive: is missing "
        "(a [[bus.node.drive]] for each drive; slots: fu1, fu2, fu3, fu4)"
    )


@pytest.mark.parametrize("value", ["nan", "inf", "-0.2", "0.09", "100.1", "true", '"0.5"'])
def test_a_telegram_downtime_is_that_of_p513(tmp_path: Path, value: str):
    assert "telegram_downtime_s" in faults(tmp_path, f"{SMALL}telegram_downtime_s = {value}\n")[0]


@pytest.mark.parametrize("value", ["nan", "inf", "0", "-1.5", '"50"'])
def test_a_scaling_parameter_is_more_than_nothing(tmp_path: Path, value: str):
    assert "parameters.P105" in faults(tmp_path, f"{SMALL}parameters = {{ P105 = {value} }}\n")[0]


@pytest.mark.parametrize(
    "listen",
    ["127.0.0.1", "127.0.0.1:", "127.0.0.1:99999", "localhost:502", ":502", "127.0.0.1:x", "1.2.3:5"],
)
def test_an_endpoint_is_an_ip_address_and_a_port(tmp_path: Path, listen: str):
    assert faults(tmp_path, f'{SMALL}[modbus]\nlisten = "{listen}"\n')[0].startswith(
        "14: modbus.listen: must"
    )


@pytest.mark.parametrize("listen", ["0.0.0.0:502", "[::1]:502", "192.168.1.5:0"])
def test_these_are_endpoints(tmp_path: Path, listen: str):
    site = load(tmp_path, f'{SMALL}[modbus]\nlisten = "{listen}"\n')
    assert site.modbus
    assert site.modbus.listen == listen
