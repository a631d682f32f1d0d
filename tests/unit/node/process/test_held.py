"""Whether the SYNC that takes a stop over fits into the dead-man time."""

from __future__ import annotations

from pathlib import Path

import pytest
from hypothesis import given
from hypothesis import strategies as st

from bridge.config import BusTable
from bridge.lint import Severity
from bridge.node.process.held import held_s, least_deadman_ms
from tests.support.lint_site import judge


def told(folder: Path, kind: int, bus: str = "", timeout_ms: int = 200, drive: str = "") -> list[str]:
    table = f"fieldbus_timeout_ms = {timeout_ms}\n{drive}\nrpdo = {{ transmission_type = {kind} }}"
    found = judge(folder, bus=bus, drive=table).of(Severity.WARNING)
    return [str(one) for one in found if "waits for SYNC" in one.fault.message]


@pytest.mark.parametrize(
    ("kind", "bus", "fits"),
    [
        (0, "", True),
        (1, "", True),
        (3, "", True),
        (7, "", False),
        (255, "sync_period_ms = 40", True),
        (1, "sync_period_ms = 40", False),
        (3, "sync_period_ms = 40\nrpdo_period_ms = 10", False),
        (1, "sync_period_ms = 40\ndeadman_ms = 250", True),
    ],
)
def test_a_stop_that_no_sync_takes_over_is_told(tmp_path: Path, kind: int, bus: str, fits: bool) -> None:
    assert bool(told(tmp_path, kind, bus)) != fits


def test_it_says_where_and_what_would_be_right(tmp_path: Path) -> None:
    (text,) = told(tmp_path, 3, "sync_period_ms = 40\nrpdo_period_ms = 10", timeout_ms=500)
    assert "site.toml:" in text
    assert "bus[0].node[0].drive[0].rpdo.transmission_type" in text
    assert "RPDO1 of type 3 waits for SYNC for up to 120 ms" in text
    assert "type 254 or 255, a shorter sync_period_ms, or deadman_ms = 240" in text
    assert not told(tmp_path, 3, "sync_period_ms = 40\nrpdo_period_ms = 10\ndeadman_ms = 240", 500)
    (text,) = told(tmp_path, 3, "sync_period_ms = 40\nrpdo_period_ms = 10", timeout_ms=200)
    assert "or deadman_ms" not in text, "it would outlast the owner's time-out"


@pytest.mark.parametrize("drive", ['on_expiry = "hold"', "telegram_downtime_s = -0.1"])
def test_where_nothing_is_to_stop_the_drive_nothing_is_told(tmp_path: Path, drive: str) -> None:
    assert not told(tmp_path, 7, drive=drive)


@given(
    kind=st.integers(0, 240),
    sync_ms=st.integers(1, 200),
    period_ms=st.integers(1, 200),
)
def test_what_is_proposed_is_just_enough(kind: int, sync_ms: int, period_ms: int) -> None:
    bus = BusTable.model_construct(
        sync_period_ms=sync_ms, rpdo_period_ms=period_ms, deadman_ms=1, interface="virtual"
    )
    least_ms = least_deadman_ms(bus, kind)
    assert held_s(bus.model_copy(update={"deadman_ms": least_ms}), kind)
    assert not held_s(bus.model_copy(update={"deadman_ms": least_ms - 1}), kind)
