"""Keys of the site file together: what is unique, who commands, and times that need one another."""

from __future__ import annotations

from pathlib import Path

import pytest

from bridge.base.errors import FileFaults
from bridge.mapping.site_families import load_site_and_families
from tests.support.small_site import SMALL, faults, load

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
        """The end of a Modbus connection is known, and a lease ends by itself."""
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

    @pytest.mark.parametrize(
        ("first", "second"), [("modbus", "opcua"), ("modbus", "page"), ("opcua", "page")]
    )
    def test_two_servers_on_one_port(self, tmp_path: Path, first: str, second: str):
        text = f'{SMALL}[{first}]\nlisten = "127.0.0.1:4840"\n[{second}]\nlisten = "127.0.0.1:4840"\n'
        (fault,) = faults(tmp_path, text)
        assert fault.startswith(f"16: {second}.listen: address '127.0.0.1:4840' is used twice")

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


def test_a_node_of_drives_has_one(tmp_path: Path):
    path = tmp_path / "site.toml"
    path.write_text(SMALL.split("[[bus.node.drive]]")[0], encoding="utf-8")
    with pytest.raises(FileFaults) as told:
        load_site_and_families(path)
    assert str(told.value) == (
        f"{path}:7: bus[0].node[0].drive: is missing "
        "(a [[bus.node.drive]] for each drive; slots: fu1, fu2, fu3, fu4)"
    )


class TestHistory:
    @pytest.mark.parametrize(
        ("keys", "at"),
        [
            ("size_mb = 200", "size_mb"),
            ("events_mb = 100", "events_mb"),
            ("size_mb = 101\nevents_mb = 50", "size_mb"),
        ],
    )
    def test_it_leaves_the_server_room(self, tmp_path: Path, keys: str, at: str):
        (fault,) = faults(tmp_path, f"{SMALL}[opcua.history]\n{keys}\n")
        assert fault.startswith(f"14: opcua.history.{at}: the history takes up to 2")
        assert "more than half of front_memory_mb = 400" in fault

    def test_what_fits_is_taken(self, tmp_path: Path):
        more = "[opcua.history]\nsize_mb = 100\nevents_mb = 50\n"
        assert load(tmp_path, f"{SMALL}{more}").opcua
