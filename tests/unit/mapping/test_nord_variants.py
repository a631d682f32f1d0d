"""The NORD families beside the SK TU4-CAO, against the manual's own figures (BU 2500 de-4319)."""

from __future__ import annotations

import pytest

from bridge.drive.scaling import scale_of
from bridge.mapping import Family, family_names, load_family
from bridge.mapping.match import Found, best_match
from bridge.sim.catalogue import simulate_node
from bridge.sim.nord.nord_faults import _CODES, emcy_code

TU3_VIEWS = ("nord/sk-tu3-cao-pdo1", "nord/sk-tu3-cao", "nord/sk-tu3-cao-pdo3", "nord/sk-tu3-cao-pdo4")
RJ45 = ("nord/sk-5xxe-rj45", "nord/sk-5xxe-rj45-encoder", "nord/sk-54xe-rj45", "nord/sk-54xe-rj45-encoder")
XU4 = ("nord/sk-tu4-cao", "nord/sk-cu4-cao", "nord/sk-tu4-cao-ds402", "nord/sk-tu4-cao-posicon")
ALL = (*XU4, *TU3_VIEWS, *RJ45)
FAMILIES: dict[str, Family] = {name: load_family(name) for name in ALL}


def test_all_are_delivered_and_no_template_is():
    assert {name for name in family_names() if name.startswith("nord/")} == set(ALL)


@pytest.mark.landing(12)
@pytest.mark.parametrize("name", ALL)
def test_each_can_be_simulated(name: str):
    slot = FAMILIES[name].slot[0].name
    node = simulate_node(name, 5, {f"{slot}/P105": 60.0})
    assert node.next_deadline() is None, "no power yet"


@pytest.mark.parametrize(
    ("name", "number", "bytes_", "rpdo", "tpdo"),
    [
        ("nord/sk-tu3-cao-pdo1", 1, 4, 0x200, 0x180),
        ("nord/sk-tu3-cao", 2, 8, 0x300, 0x280),
        ("nord/sk-tu3-cao-pdo3", 3, 8, 0x400, 0x380),
        ("nord/sk-tu3-cao-pdo4", 4, 2, 0x500, 0x480),
        ("nord/sk-5xxe-rj45", 1, 8, 0x200, 0x180),
        ("nord/sk-54xe-rj45", 1, 8, 0x200, 0x180),
    ],
)
def test_the_views_of_one_drive(name: str, number: int, bytes_: int, rpdo: int, tpdo: int):
    """§6.5.7."""
    (slot,) = FAMILIES[name].slot
    for pdo, cob_id in ((slot.rpdo[0], rpdo), (slot.tpdo[0], tpdo)):
        assert (pdo.number, pdo.cob_id, 2 * len(pdo.objects)) == (number, cob_id, bytes_)
    written = [pdo.number for pdo in slot.tpdo if pdo.write]
    assert written == ([number] if "tu3" in name and number > 1 else []), "TPDO1 alone is on at factory"


def test_the_second_pdos_of_54xe_have_four_bytes():
    """§6.5.7 prints 5; two words are 4."""
    (slot,) = FAMILIES["nord/sk-54xe-rj45"].slot
    for pdo, objects in ((slot.rpdo[1], ["3002:04", "3002:05"]), (slot.tpdo[1], ["3003:04", "3003:05"])):
        assert [str(refs[0]) for refs in pdo.objects] == objects
        assert pdo.optional


@pytest.mark.parametrize(("name", "number"), [("nord/sk-5xxe-rj45", 2), ("nord/sk-54xe-rj45", 3)])
def test_an_encoder_position_is_sent_by_a_mapping_of_its_own_only(name: str, number: int):
    assert number not in [pdo.number for pdo in FAMILIES[name].slot[0].rpdo]
    pdo = FAMILIES[f"{name}-encoder"].slot[0].rpdo[-1]
    assert (pdo.number, pdo.cob_id, len(pdo.objects)) == (number, 0x100 * (number + 1), 2)
    assert pdo.optional and pdo.static


def watch(family: Family) -> tuple[str | None, float]:
    """Parameter by which the drive watches its process data, and its step in ms."""
    (one,) = [one for one in family.own_supervision if one.watches == "process_data"]
    return one.parameter, one.unit_ms


@pytest.mark.parametrize("name", (*TU3_VIEWS, *RJ45))
def test_without_an_interface_of_its_own_p513_watches(name: str):
    """§8.1; P513 is at 2000h + 513, in steps of 0.1 s."""
    family = FAMILIES[name]
    assert watch(family) == ("P513", 100.0)
    assert str(family.object_of(family.parameter_named("P513"))) == "2201:00"
    assert family.faults.bridge_timeout == 10.2
    numbers = {int(parameter.name[1:4]) for parameter in family.parameter}
    assert not numbers & set(range(150, 182)), "§7.1: it has no parameters of its own"


@pytest.mark.parametrize("name", XU4)
def test_the_interface_has_p151(name: str):
    family = FAMILIES[name]
    assert watch(family) == ("P151", 1.0)
    assert str(family.object_of(family.parameter_named("P151"))) == "2097:01"
    assert [server.slot for server in family.sdo] == ["fu2", "fu3", "fu4"]


@pytest.mark.parametrize(
    ("name", "value", "place"),
    [
        ("nord/sk-tu3-cao", "P544", "2220:01"),
        ("nord/sk-tu3-cao", "P546", "2222:01"),
        ("nord/sk-5xxe-rj45", "P548", "2224:01"),
        ("nord/sk-54xe-rj45", "P546", "2222:01"),
        ("nord/sk-tu4-cao", "P546", "2222:01"),
    ],
)
def test_meanings_of_words_are_where_the_drive_has_them(name: str, value: str, place: str):
    """§6.5.4: P543, P544, P545 in SK 500E … 535E, elements of P543 elsewhere."""
    family = FAMILIES[name]
    assert str(family.object_of(family.parameter_named(value))) == place
    elements = {"nord/sk-tu4-cao": 3, "nord/sk-54xe-rj45": 5}.get(name, 0)
    assert family.parameter_named("P546").elements == elements


@pytest.mark.parametrize("group", ["command", "actual"])
def test_a_position_is_two_words_of_a_thousandth_of_a_revolution(group: str):
    """§6.6.1: 2800.758 rev = 002ABC76h; §6.5.4: −50000.00 … 50000.00."""
    family = FAMILIES["nord/sk-tu3-cao-pdo3"]
    (value,) = [one for one in family.value if one.leaf == f"{group}/position"]
    assert value.code == ([23, 24] if group == "command" else [10, 15]), "§5.4"
    scale = scale_of(value, {})
    assert scale is not None
    assert scale.to_word(2800.758) == 0x002A_BC76
    assert scale.from_word(0x002A_BC76) == pytest.approx(2800.758, abs=1e-6)
    assert scale.from_word(0xFFFF_FFFF) == pytest.approx(-0.001)
    if group == "command":
        assert (scale.low, scale.high) == (-50000.0, 50000.0)


def test_the_drive_profile_replaces_the_words():
    """§6.7.3, §6.7.1: eight profiles in 6000h … 9FFFh."""
    family = FAMILIES["nord/sk-tu4-cao-ds402"]
    for place, slot in enumerate(family.slot):
        objects = [str(refs[0]) for pdo in (*slot.rpdo, *slot.tpdo) for refs in pdo.objects]
        base = 0x800 * place
        wanted = [0x6040, 0x6042, 0x6041, 0x6044]
        assert objects == [f"{index + base:04X}:00" for index in wanted]
        assert all(pdo.write for pdo in (*slot.rpdo, *slot.tpdo))
        (start,) = slot.start
        assert (str(start.object), start.value) == ("20A8:01", 1)
    assert (family.control_word.forward, family.control_word.reverse) == (0, 0)
    assert {"6046[2]", "6048[1]", "6049[2]"} <= {parameter.name for parameter in family.parameter}


# Identity


@pytest.mark.parametrize(
    ("said", "mapping"),
    [
        ("SK TU4-CAO", "nord/sk-tu4-cao"),
        ("SK TU4-CAO-M12-C", "nord/sk-tu4-cao"),
        ("SK CU4-CAO", "nord/sk-cu4-cao"),
        ("SK TU3-CAO", "nord/sk-tu3-cao"),
        ("SK535E", "nord/sk-5xxe-rj45"),
        ("SK 511E", "nord/sk-5xxe-rj45"),
        ("SK 545E", "nord/sk-54xe-rj45"),
        ("SK 500E", None),
    ],
)
def test_scan_goes_by_the_device_name(said: str, mapping: str | None):
    match = best_match(Found(device_type=0x10192, device_name=said), FAMILIES)
    assert (match and match.mapping) == mapping


@pytest.mark.parametrize("name", ALL)
def test_no_number_of_1018h_is_invented(name: str):
    """§6.7.2 prints none."""
    rule = FAMILIES[name].identity
    assert (rule.device_type, rule.vendor_id, rule.product_code, rule.revision) == (None,) * 4


# Faults


@pytest.mark.parametrize("name", ALL)
def test_every_number_of_p700_has_a_text(name: str):
    """§8.3.3 and §8.4."""
    faults = FAMILIES[name].faults
    for tenths in _CODES:
        assert faults.texts[f"{tenths / 10:.1f}"], tenths
        assert f"{emcy_code(tenths):04X}" in FAMILIES[name].emcy.codes
    assert faults.texts["2.1"] == "overtemperature of the motor, I²t"
    assert faults.texts["3.0"] == "overcurrent of the inverter"


@pytest.mark.parametrize("name", ALL)
def test_the_drive_is_asked_for_p700_and_p701(name: str):
    family = FAMILIES[name]
    assert family.faults.current and family.faults.last
    current = family.parameter_named(family.faults.current.parameter)
    last = family.parameter_named(family.faults.last.parameter)
    assert (str(family.object_of(current)), str(family.object_of(last))) == ("22BC:01", "22BD:01")
    assert current.factor == last.factor == 0.1


def test_the_cu4_has_no_outputs_and_two_inputs() -> None:
    """BU 2500 §7.1.1 P150, §7.1.3 P174 and P175."""
    small, large = FAMILIES["nord/sk-cu4-cao"], FAMILIES["nord/sk-tu4-cao"]
    gone = {one.name for one in large.parameter} - {one.name for one in small.parameter}
    assert gone == {"P150", "P175"}
    assert {one.leaf for one in large.value} - {one.leaf for one in small.value} == {
        "command/digital_outputs"
    }
    polls = {poll.name: poll.bits for poll in small.poll}
    assert polls["digital_inputs"] == ["input_1", "input_2"]
    assert "digital_outputs" not in polls
