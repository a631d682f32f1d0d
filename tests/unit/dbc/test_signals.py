"""Signals of a PDO in a DBC file: values, bits in groups, raw words, objects that share a word."""

from __future__ import annotations

import tomllib
from collections.abc import Mapping

from bridge.config import Site
from bridge.dbc import BusDescription, Message, MessageSignal, describe
from bridge.lint import family_dictionaries
from bridge.lint.checked_bus import view_bus
from bridge.mapping import Family, load_family
from tests.support import sites

STATUS_BITS = 16


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


def test_a_value_is_its_word_with_factor_range_and_unit() -> None:
    found = signals(described(NORD), "conveyor_fu1_TPDO1")["frequency"]
    assert (found.start, found.length, found.is_signed, found.unit) == (16, 16, True, "Hz")
    assert found.factor == 50 / 16384
    assert (found.low, round(found.high or 0)) == (-100, 100)


def test_bits_are_in_a_group_with_the_words_name() -> None:
    tpdo = message(described(NORD), "conveyor_fu1_TPDO1")
    assert tpdo.groups.keys() == {"status_word"}
    assert len(tpdo.groups["status_word"]) == STATUS_BITS
    assert signals(described(NORD), "conveyor_fu1_TPDO1")["status_word_fault"].start == 3


def test_words_are_there_on_demand() -> None:
    tpdo = message(described(NORD, words=True), "conveyor_fu1_TPDO1")
    assert [(one.name, one.start, one.length) for one in tpdo.signals] == [
        ("status_word", 0, 16),
        ("value_1", 16, 16),
        ("value_2", 32, 16),
        ("value_3", 48, 16),
    ]
    assert not tpdo.groups


def test_a_scale_that_only_the_drive_knows_is_left_to_the_reader() -> None:
    bus = described(site_of("nord/sk-tu4-cao", "fu1", ""))
    found = signals(bus, "conveyor_fu1_TPDO1")["frequency"]
    assert (found.factor, found.unit, found.low) == (1.0, "", None)
    assert "P105 / 16384" in found.comment


def test_32_bits_enumerations_and_single_bits() -> None:
    found = signals(described(site_of("cia402/profile-position", "drive", "")), "conveyor_drive_TPDO1")
    assert (found["position"].start, found["position"].length, found["position"].is_signed) == (16, 32, True)
    assert (found["mode"].length, found["mode"].is_signed) == (8, True)
    assert found["mode"].choices[1] == "profile position"
    assert (found["following_error"].start, found["following_error"].length) == (13, 1)


def test_objects_that_share_a_word_are_one_word() -> None:
    found = signals(described(site_of("stoeber/5000", "axis1", ""), words=True), "conveyor_drive_TPDO1")
    assert (found["status_word"].start, found["status_word"].length) == (0, 16)
    rpdo = signals(described(site_of("stoeber/5000", "axis1", ""), words=True), "conveyor_drive_RPDO1")
    assert (rpdo["control_word"].length, rpdo["setpoint_1"].start) == (8, 8)
