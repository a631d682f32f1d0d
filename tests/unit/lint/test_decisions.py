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
