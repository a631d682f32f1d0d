"""The linter sees what keys cannot say one by one: collisions, a full bus, times that do not fit."""

from __future__ import annotations

from dataclasses import replace
from pathlib import Path

import pytest

from bridge.can.wirebits import exact_bits
from bridge.canopen.frame import Frame
from bridge.config.download import Download
from bridge.lint import Severity
from bridge.lint.load import longest_bits
from bridge.mapping import Family
from bridge.mapping.model import Pdo, SdoServer
from tests.support.lint_site import DICTIONARY, FAMILY, NORD, OTHER, TIMEOUT, findings, judge, only


def foreign(pdo: int = 2, sdo: tuple[tuple[int, int, int], ...] = ()) -> Family:
    """A family at any address, with one drive on PDOs of this number and with further SDO channels."""
    slot = FAMILY.slot[0]
    rpdo = Pdo(number=pdo, cob_id=0x100 + 0x100 * pdo, objects=slot.rpdo[0].objects)
    tpdo = Pdo(number=pdo, cob_id=0x080 + 0x100 * pdo, objects=slot.tpdo[0].objects)
    names = ("number", "request", "reply")
    servers = [SdoServer.model_validate(dict(zip(names, one, strict=True))) for one in sdo]
    return FAMILY.model_copy(
        update={
            "family": FAMILY.family.model_copy(update={"node_id_high": 127}),
            "slot": [slot.model_copy(update={"rpdo": [rpdo], "tpdo": [tpdo]})],
            "sdo": servers,
        }
    )


LENZE_LIKE = foreign(sdo=((2, 0x640, 0x5C0),))
STOEBER_LIKE = foreign(sdo=((2, 0x620, 0x5A0), (3, 0x640, 0x5C0), (4, 0x660, 0x5E0)))


def test_a_sound_site_has_no_findings(tmp_path: Path) -> None:
    assert judge(tmp_path).findings == ()


# COB-IDs


def test_nodes_of_one_family_do_not_collide(tmp_path: Path) -> None:
    more = "".join(OTHER.format(id=n, family=NORD).replace("pump", f"pump{n}") for n in (1, 6, 63))
    assert judge(tmp_path, bus="bitrate = 1000000", more=more).findings == ()


@pytest.mark.parametrize(
    ("value", "collides"), [(0x86, True), (0x8000_0086, False), (0x40, False), (0xC5, False)]
)
def test_emergency_messages_count_where_1014h_sends_them(tmp_path: Path, value: int, collides: bool) -> None:
    moved = Download(0x1014, 0, value.to_bytes(4, "little"))
    verdict = judge(tmp_path, more=OTHER.format(id=6, family=NORD), downloads=(moved,))
    found = findings(verdict, Severity.ERROR)
    assert [text for text in found if "EMCY of pump has COB-ID 86h, which is EMCY of conveyor's" in text] == (
        found if collides else []
    )
    assert bool(found) == collides


@pytest.mark.parametrize("object_", ["1010:01", "1011:01"])
@pytest.mark.parametrize(("more", "number"), [("", 1), ("read_back = false", 0)])
def test_a_command_that_is_to_be_read_back_is_doubtful(
    tmp_path: Path, object_: str, more: str, number: int
) -> None:
    node = f'[[bus.node.configure]]\nobject = "{object_}"\ntype = "uint32"\nvalue = 1702257011\n{more}'
    found = findings(judge(tmp_path, node=node), Severity.WARNING)
    assert len(found) == number
    assert all("is a command: it never reads back as it was written" in text for text in found)


def test_a_foreign_node_above_63_sits_on_nords_closed_channels(tmp_path: Path) -> None:
    """BU 2500 §6.4: 300h + 69 is 340h + 5, the request of NORD's SDO2, which is off at factory."""
    more = OTHER.format(id=69, family="acme")
    found = only(judge(tmp_path, more=more, families={"acme": foreign()}), Severity.WARNING)
    assert "RPDO2 of pump has COB-ID 345h, which is SDO2 request of conveyor's, too, and 1 more" in found
    assert "as long as SDO2 request of conveyor is off" in found
    assert ".node[1].id" in found


def test_with_that_channel_open_it_is_an_error(tmp_path: Path) -> None:
    more = OTHER.format(id=69, family="acme")
    verdict = judge(tmp_path, node="sdo_channels = [2]", more=more, families={"acme": foreign()})
    assert "RPDO2 of pump has COB-ID 345h" in only(verdict, Severity.ERROR)


def test_nords_pdo5_counts_too(tmp_path: Path) -> None:
    """It is in no mapping file, but in the EDS: 200h + 69 is 240h + 5."""
    more = OTHER.format(id=69, family="acme")
    verdict = judge(tmp_path, more=more, families={"acme": foreign(1)})
    assert "RPDO1 of pump has COB-ID 245h, which is RPDO5 of conveyor's" in only(verdict, Severity.WARNING)


@pytest.mark.parametrize(
    ("family", "first", "second"), [(LENZE_LIKE, 1, 65), (STOEBER_LIKE, 1, 33), (STOEBER_LIKE, 3, 99)]
)
def test_an_open_sdo2_takes_the_first_channel_of_another_node(
    tmp_path: Path, family: Family, first: int, second: int
) -> None:
    """Lenze: 640h/5C0h, hence addresses up to 63. STÖBER: 620h/5A0h …, hence up to 31."""
    numbers = [server.number for server in family.sdo]
    text = OTHER.format(id=first, family="acme").replace("id =", f"sdo_channels = {numbers}\nid =")
    more = text + OTHER.replace("pump", "fan").format(id=second, family="acme")
    verdict = judge(tmp_path, more=more, families={"acme": family})
    [found] = findings(verdict, Severity.ERROR)
    assert "SDO" in found
    assert "which is SDO" in found


def test_a_pdo_moved_onto_another_is_named_where_it_was_moved(tmp_path: Path) -> None:
    drive = f"{TIMEOUT}\ntpdo = {{ cob_id = 0x285 }}"
    found = only(judge(tmp_path, drive=drive), Severity.ERROR)
    assert "TPDO2 of conveyor has COB-ID 285h, which is TPDO1 of conveyor's" in found


def test_a_pdo_moved_onto_the_sdo_of_another_node(tmp_path: Path) -> None:
    drive = f"{TIMEOUT}\nrpdo = {{ cob_id = 0x586 }}"
    verdict = judge(tmp_path, drive=drive, more=OTHER.format(id=6, family=NORD))
    collision, identifier = sorted(findings(verdict, Severity.ERROR))
    assert "RPDO1 cannot have COB-ID 586h" in collision
    assert "SDO1 reply of pump has COB-ID 586h" in identifier


# load


def test_the_longest_frame_is_longer_than_any_real_one() -> None:
    assert longest_bits(8) == 135
    for length in range(9):
        for byte in (0x00, 0xFF, 0x1F, 0x83, 0x3C):
            assert exact_bits(Frame(0x078, bytes([byte] * length))) <= longest_bits(length)


def test_the_load_is_the_sum_of_all_regular_frames(tmp_path: Path) -> None:
    """SYNC 55 bits and RPDO1 135 bits at 100 Hz; heartbeats 65 bits at 10 and 1000/66 Hz; four TPDOs each
    250 ms; polls of 500, 500 and 1000 ms."""
    [load] = judge(tmp_path).loads
    bits = 100 * (55 + 135) + 65 * (10 + 1000 / 66) + 4 * 135 * 4 + 2 * 135 * 5
    assert load.load_percent == round(100 * bits / 250_000, 1)
    assert load.cycle_ms == (55 + 135) / 250
    assert load.most_percent == round(100 * (bits + 4 * 135 * 96) / 250_000, 1)
    assert str(load) == ("can0: predicted load 10 %, at most 30 % of 250 kbit/s (SYNC budget: 0.8 of 10 ms)")


def test_guarding_costs_a_question_and_an_answer(tmp_path: Path) -> None:
    [none] = judge(tmp_path, node='supervision = "none"').loads
    [guarding] = judge(tmp_path, node='supervision = "guarding"\nsupervision_ms = 100').loads
    assert guarding.load_percent == pytest.approx(none.load_percent + 100 * 10 * (55 + 65) / 250_000, abs=0.1)


def test_a_node_that_is_switched_off_costs_nothing(tmp_path: Path) -> None:
    [load] = judge(tmp_path, node="enabled = false").loads
    assert load.cycle_ms == 55 / 250


def test_a_busy_bus_is_a_warning_and_a_full_one_an_error(tmp_path: Path) -> None:
    bus = "bitrate = 20000\nsync_period_ms = {0}\ndeadman_ms = 2000\nheartbeat_ms = 1000"
    busy = judge(tmp_path, bus=bus.format(20))
    assert any(
        "the predicted load is" in text and "late" in text for text in findings(busy, Severity.WARNING)
    )
    full = judge(tmp_path, bus=bus.format(10))
    assert any("more than the bus can carry" in text for text in findings(full, Severity.ERROR))


def test_a_cycle_must_fit_into_the_sync_period(tmp_path: Path) -> None:
    verdict = judge(tmp_path, bus="bitrate = 125000\nsync_period_ms = 1")
    assert any("one cycle takes 1.5 ms on the wire" in text for text in findings(verdict, Severity.ERROR))


def test_synchronous_tpdos_must_be_through_within_the_window(tmp_path: Path) -> None:
    drive = f"{TIMEOUT}\ntpdo = {{ transmission_type = 1 }}"
    verdict = judge(tmp_path, bus="sync_window_us = 1000", drive=drive)
    assert "sync_window_us: 1000 µs is shorter" in only(verdict, Severity.WARNING)
    assert judge(tmp_path, bus="sync_window_us = 2000", drive=drive).findings == ()


def test_a_window_without_synchronous_tpdos_has_no_effect(tmp_path: Path) -> None:
    assert "has no effect" in only(judge(tmp_path, bus="sync_window_us = 1000"), Severity.WARNING)


# PDOs


def test_nord_evaluates_four_words_only(tmp_path: Path) -> None:
    drive = f'{TIMEOUT}\nrpdo = {{ mapping = ["3000:01/16", "3002:01/16"] }}'
    assert "RPDO1 has 4 bytes; SK TU4-CAO evaluates only 8" in only(
        judge(tmp_path, drive=drive), Severity.ERROR
    )


def test_a_family_with_more_words_than_a_pdo_holds(tmp_path: Path) -> None:
    words = FAMILY.slot[0].rpdo[0].objects
    pdo = Pdo(number=1, cob_id=0x200, objects=[*words, FAMILY.slot[0].rpdo[1].objects[0]])
    wide = FAMILY.slot[0].model_copy(update={"rpdo": [pdo]})
    family = FAMILY.model_copy(update={"slot": [wide, *FAMILY.slot[1:]]})
    verdict = judge(tmp_path, families={NORD: family}, dictionary=None)
    assert "RPDO1 has 10 bytes, a PDO has at most 8" in only(verdict, Severity.ERROR)


def test_a_drive_without_its_pdo(tmp_path: Path) -> None:
    drive = f"{TIMEOUT}\ntpdo = {{ enable = false }}"
    assert any("TPDO1 is off" in text for text in findings(judge(tmp_path, drive=drive), Severity.ERROR))


def test_a_synchronous_pdo_needs_sync(tmp_path: Path) -> None:
    drive = f"{TIMEOUT}\nrpdo = {{ transmission_type = 1 }}"
    assert "waits for SYNC" in only(judge(tmp_path, bus="sync_period_ms = 0", drive=drive), Severity.ERROR)


# times


def test_the_controller_needs_two_rpdo_periods(tmp_path: Path) -> None:
    verdict = judge(tmp_path, drive="fieldbus_timeout_ms = 15")
    assert "less than two RPDO periods of 10 ms" in only(verdict, Severity.ERROR)


def test_the_dead_man_time_should_be_the_shorter_one(tmp_path: Path) -> None:
    verdict = judge(tmp_path, drive="fieldbus_timeout_ms = 60")
    assert "shorter than deadman_ms = 100" in only(verdict, Severity.WARNING)


def test_a_downtime_shorter_than_the_pauses_of_the_tpdo(tmp_path: Path) -> None:
    verdict = judge(tmp_path, drive=f"{TIMEOUT}\ntelegram_downtime_s = 0.2")
    assert "which is late only after 0.395 s" in only(verdict, Severity.WARNING)
    faster = f"{TIMEOUT}\ntelegram_downtime_s = 0.2\ntpdo = {{ event_ms = 100 }}"
    assert judge(tmp_path, drive=faster).findings == ()


def test_a_downtime_without_a_regular_tpdo(tmp_path: Path) -> None:
    verdict = judge(tmp_path, drive=f"{TIMEOUT}\ntpdo = {{ event_ms = 0 }}")
    assert "has no effect: TPDO1 is sent only when a value changes" in only(verdict, Severity.WARNING)


def test_a_downloaded_event_timer_counts(tmp_path: Path) -> None:
    event = Download(0x1800, 5, (100).to_bytes(2, "little"))
    drive = f"{TIMEOUT}\ntelegram_downtime_s = 0.2"
    assert judge(tmp_path, drive=drive, downloads=(event,)).findings == ()


def test_a_deadline_that_the_site_file_gives_counts(tmp_path: Path) -> None:
    drive = f"{TIMEOUT}\ntelegram_downtime_s = 0.5\ntpdo_deadline_ms = {{}}"
    assert "late only after 0.6 s" in only(judge(tmp_path, drive=drive.format(600)), Severity.WARNING)
    assert "is never late" in only(judge(tmp_path, drive=drive.format(0)), Severity.WARNING)


def test_a_polled_tpdo_is_regular_and_costs_its_question(tmp_path: Path) -> None:
    drive = f"{TIMEOUT}\nrtr_poll_ms = 20\ntpdo = {{ transmission_type = 253 }}"
    process = FAMILY.process.model_copy(update={"forbidden_types": []})
    families = {NORD: FAMILY.model_copy(update={"process": process})}
    verdict = judge(tmp_path, drive=drive, families=families)
    assert verdict.findings == ()
    extra = 50 * (55 + 135) - 4 * 135
    [polled], [plain] = verdict.loads, judge(tmp_path).loads
    assert polled.load_percent == pytest.approx(plain.load_percent + 100 * extra / 250_000, abs=0.1)


@pytest.mark.parametrize(
    ("p151_ms", "severity", "text"),
    [
        (15, Severity.ERROR, "2097:01 = 15 ms, is less than two RPDO periods"),
        (50, Severity.WARNING, "2097:01 = 50 ms, is shorter than deadman_ms = 100"),
    ],
)
def test_the_nodes_own_time_out_outlives_rpdos_and_dead_man_time(
    tmp_path: Path, p151_ms: int, severity: Severity, text: str
) -> None:
    node = f'configure = [{{ object = "2097:01", type = "uint16", value = {p151_ms} }}]'
    assert text in only(judge(tmp_path, node=node), severity)
    assert judge(tmp_path, node=node.replace(f"value = {p151_ms}", "value = 150")).findings == ()


def test_a_drive_that_nothing_watches(tmp_path: Path) -> None:
    verdict = judge(tmp_path, node='supervision = "none"', drive=f"{TIMEOUT}\ntelegram_downtime_s = 0")
    assert "nobody would notice a lost drive" in only(verdict, Severity.WARNING)


@pytest.mark.parametrize(
    ("supervision", "missing"), [("heartbeat", {0x1017}), ("guarding", {0x100C, 0x100D})]
)
def test_supervision_that_the_family_does_not_have(
    tmp_path: Path, supervision: str, missing: set[int]
) -> None:
    poor = replace(DICTIONARY, objects=tuple(one for one in DICTIONARY.objects if one.index not in missing))
    node = f'supervision = "{supervision}"'
    assert judge(tmp_path, node=node).findings == ()
    found = only(judge(tmp_path, node=node, dictionary=poor), Severity.ERROR)
    assert all(f"{index:04X}h" in found for index in missing)


def test_supervision_needs_more_than_a_cycle(tmp_path: Path) -> None:
    verdict = judge(tmp_path, bus="sync_period_ms = 100\ndeadman_ms = 200", node="supervision_ms = 150")
    assert "less than two SYNC periods" in only(verdict, Severity.WARNING)


@pytest.mark.parametrize(
    ("timeout_ms", "text"), [(20, "shorter than drives take"), (5000, "counts as lost after 200")]
)
def test_sdo_time_outs_that_make_no_sense(tmp_path: Path, timeout_ms: int, text: str) -> None:
    assert text in only(judge(tmp_path, node=f"sdo_timeout_ms = {timeout_ms}"), Severity.WARNING)


# decisions


@pytest.mark.parametrize(
    ("drive", "key", "text"),
    [
        ("fieldbus_timeout_ms = 0", "fieldbus_timeout_ms", "a silent controller will not stop conveyor/fu1"),
        (f"{TIMEOUT}\ntelegram_downtime_s = -0.1", "telegram_downtime_s", "no communication error"),
        (f'{TIMEOUT}\non_expiry = "hold"', "on_expiry", "only reported"),
    ],
)
def test_decisions_are_repeated(tmp_path: Path, drive: str, key: str, text: str) -> None:
    found = only(judge(tmp_path, drive=drive), Severity.WARNING)
    assert f"drive[0].{key}" in found
    assert text in found
