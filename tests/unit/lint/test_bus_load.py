"""The load of a bus: the sum of all regular frames, each at its longest."""

from __future__ import annotations

from pathlib import Path

import pytest

from bridge.can.wirebits import exact_bits
from bridge.canopen.frame import Frame
from bridge.lint import Severity
from bridge.lint.bus_load import longest_bits
from tests.support.lint_site import FAMILY, NORD, TIMEOUT, findings, judge


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


def test_a_polled_tpdo_is_regular_and_costs_its_question(tmp_path: Path) -> None:
    drive = f"{TIMEOUT}\nrtr_poll_ms = 20\ntpdo = {{ transmission_type = 253 }}"
    process = FAMILY.process.model_copy(update={"forbidden_types": []})
    families = {NORD: FAMILY.model_copy(update={"process": process})}
    verdict = judge(tmp_path, drive=drive, families=families)
    assert verdict.findings == ()
    extra = 50 * (55 + 135) - 4 * 135
    [polled], [plain] = verdict.loads, judge(tmp_path).loads
    assert polled.load_percent == pytest.approx(plain.load_percent + 100 * extra / 250_000, abs=0.1)
