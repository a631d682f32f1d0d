"""Times that cannot work together are named: cycles, dead-man, downtimes, supervision."""

from __future__ import annotations

from dataclasses import replace
from pathlib import Path

import pytest

from bridge.config.download import Download
from bridge.lint import Severity
from tests.support.lint_site import DICTIONARY, TIMEOUT, findings, judge, only


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
