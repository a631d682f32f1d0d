"""Decisions of the site file that are allowed are repeated."""

from __future__ import annotations

from pathlib import Path

import pytest

from bridge.lint import Severity
from tests.support.lint_site import TIMEOUT, judge, only


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


def test_a_pattern_that_no_point_fits_is_named(tmp_path: Path) -> None:
    points = '["*/*/status/state", "*/*/actual/speed", "bus/*/load"]'
    found = only(judge(tmp_path, more=f"[opcua.history]\npoints = {points}\n"), Severity.WARNING)
    assert "opcua.history.points[1]: no point has a name like */*/actual/speed" in found


def test_what_is_kept_where_nothing_is_named_is_not_judged(tmp_path: Path) -> None:
    assert judge(tmp_path, more="[opcua]\n").of(Severity.WARNING) == ()
