"""Content of a DBC file for a bus: the site file wins over the mapping file, and nothing overlaps."""

from __future__ import annotations

import tomllib
from collections.abc import Mapping

import cantools
import pytest

from bridge.base.errors import OperationFailed
from bridge.config import Site
from bridge.dbc import BusDescription, Message, MessageSignal, describe
from bridge.dbc.write import dbc_text
from bridge.lint import family_dictionaries
from bridge.lint.checked_bus import view_bus
from bridge.mapping import Family, load_family
from tests.support import sites


def described(
    text: str, *, words: bool = False, families: Mapping[str, Family] | None = None
) -> BusDescription:
    site = Site.model_validate(tomllib.loads(text))
    names = {node.mapping for node in site.bus[0].node}
    known = {name: load_family(name) for name in names} if families is None else families
    view = view_bus(site.bus[0], ("bus", 0), known, family_dictionaries(names), {})
    return describe(view, words=words)


def site_of(mapping: str, slot: str, drive: str = "", *, node: str = "", bus: str = "") -> str:
    table = sites.drive(slot, "modbus", 200, drive)
    return sites.site(sites.bus(sites.node(table, mapping=mapping, more=node), more=bus), sites.modbus())


def message(bus: BusDescription, name: str) -> Message:
    return next(message for message in bus.messages if message.name == name)


def signals(bus: BusDescription, name: str) -> dict[str, MessageSignal]:
    return {signal.name: signal for signal in message(bus, name).signals}


NORD = site_of("nord/sk-tu4-cao", "fu1", sites.SCALED)


def test_senders_and_receivers_are_nodes() -> None:
    bus = described(NORD)
    tpdo, rpdo = message(bus, "conveyor_fu1_TPDO1"), message(bus, "conveyor_fu1_RPDO1")
    assert (tpdo.cob_id, tpdo.sender, tpdo.receivers) == (0x185, "conveyor", ("DRIVEBRIDGE",))
    assert (rpdo.cob_id, rpdo.sender, rpdo.receivers) == (0x205, "DRIVEBRIDGE", ("conveyor",))
    assert list(bus.nodes) == ["DRIVEBRIDGE", "conveyor"]


def test_the_site_files_mapping_and_identifier_win() -> None:
    own = 'tpdo = { cob_id = 0x1C0, mapping = ["3001:01/16", "3003:02/16", "2FFF:01/8"] }'
    bus = described(site_of("nord/sk-tu4-cao", "fu1", f"{sites.SCALED}\n{own}"))
    tpdo = message(bus, "conveyor_fu1_TPDO1")
    assert (tpdo.cob_id, tpdo.length) == (0x1C0, 5)
    found = signals(bus, "conveyor_fu1_TPDO1")
    assert found["current"].start == 16
    assert (found["object_2fff_01"].start, found["object_2fff_01"].length) == (32, 8)
    assert "frequency" not in found
    assert "by the site file" in tpdo.comment


def test_a_pdo_that_the_site_file_switches_off_is_left_out() -> None:
    off = "rpdo = [{ number = 2, enable = false }]"
    names = [one.name for one in described(site_of("lenze/8400-motec", "drive", off)).messages]
    assert "conveyor_drive_RPDO1" in names
    assert "conveyor_drive_RPDO2" not in names


def test_what_is_off_at_factory_gives_way_and_two_that_are_on_are_refused() -> None:
    # RPDO5 of node 5 is at 245h.
    first = sites.node(sites.drive("fu1", "modbus", 200), name="conveyor")

    def other(cob_id: int) -> str:
        table = sites.drive("fu1", "modbus", 200, f"rpdo = {{ cob_id = {cob_id} }}")
        return sites.site(sites.bus(first, sites.node(table, name="pump", node_id=6)), sites.modbus())

    assert "off at factory" in message(described(NORD), "conveyor_fu1_RPDO5").comment
    names = {one.cob_id: one.name for one in described(other(0x245)).messages}
    assert names[0x245] == "pump_fu1_RPDO1"
    with pytest.raises(OperationFailed, match="185h"):
        described(other(0x185))


def test_what_canopen_sends_by_itself() -> None:
    bus = described(
        site_of("stoeber/5000", "axis1", "", node='supervision = "guarding"', bus="sync_counter = 8")
    )
    assert signals(bus, "SYNC")["sync_counter"].high == 8
    assert signals(bus, "conveyor_heartbeat")["nmt_state"].choices[5] == "operational"
    assert signals(bus, "conveyor_heartbeat")["toggle"].start == 7
    emcy = signals(bus, "conveyor_EMCY")
    assert emcy["event"].start == 24
    assert emcy["event"].choices[41] == "temperature of the motor, sensor"
    assert emcy["error_code"].choices[0x4310] == "temperature of the motor"
    assert message(bus, "DRIVEBRIDGE_heartbeat").cob_id == 0x77F


def test_the_text_is_ascii_and_read_back_by_cantools_with_long_names() -> None:
    name = "a_node_with_a_name_of_more_than_32_characters"
    table = sites.drive("axis1", "modbus", 200, "")
    text = sites.site(sites.bus(sites.node(table, name=name, mapping="stoeber/5000")), sites.modbus())
    written = dbc_text(described(text))
    assert written.isascii()
    database = cantools.database.load_string(written)
    tpdo = database.get_message_by_name(f"{name}_drive_TPDO1")
    assert tpdo.senders == [name]
    event = database.get_message_by_name(f"{name}_EMCY").get_signal_by_name("event")
    assert event.choices is not None
    assert str(event.choices[39]) == "temperature of the device, I2t"


@pytest.mark.parametrize("mapping", ["cia402/homing", "nord/sk-tu3-cao-pdo3", "stoeber/5000-four-axes"])
def test_no_signals_of_a_message_overlap(mapping: str) -> None:
    slot = load_family(mapping).slot[0].name
    for words in (False, True):
        text = dbc_text(described(site_of(mapping, slot, ""), words=words))
        assert cantools.database.load_string(text, strict=True).messages
