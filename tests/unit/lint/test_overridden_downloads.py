"""Downloads that the bridge's own settings undo are named."""

from __future__ import annotations

from pathlib import Path

import pytest

from bridge.lint import Severity
from tests.support.lint_site import TIMEOUT, judge, only


def configure(*entries: tuple[str, str, int]) -> str:
    """[[bus.node.configure]] tables: object, type and value."""
    return "".join(
        f'[[bus.node.configure]]\nobject = "{name}"\ntype = "{kind}"\nvalue = {value}\n'
        for name, kind, value in entries
    )


@pytest.mark.parametrize(
    ("node", "entry", "text"),
    [
        ("", ("1017:00", "uint16", 0), "1017h:00 = 0, and the bridge sets it to 66"),
        ("", ("1017:00", "uint16", 100), "1017h:00 = 100, and the bridge sets it to 66"),
        ("", ("100C:00", "uint16", 100), "100Ch:00 = 100, and the bridge sets it to 0"),
        ("", ("100D:00", "uint8", 3), "100Dh:00 = 3, and the bridge sets it to 0"),
        ('supervision = "guarding"', ("1017:00", "uint16", 66), "1017h:00 = 66, and the bridge sets it to 0"),
        ('supervision = "guarding"', ("100D:00", "uint8", 2), "100Dh:00 = 2, and the bridge sets it to 3"),
    ],
)
def test_a_download_against_the_bridges_own_settings(
    tmp_path: Path, node: str, entry: tuple[str, str, int], text: str
) -> None:
    found = only(judge(tmp_path, node=f"{node}\n{configure(entry)}"), Severity.WARNING)
    assert text in found
    assert ".configure[0]" in found


def test_a_download_that_agrees_is_no_contradiction(tmp_path: Path) -> None:
    assert judge(tmp_path, node=configure(("1017:00", "uint16", 66))).findings == ()


@pytest.mark.parametrize(
    ("entry", "drive", "text"),
    [
        (("1800:05", "uint16", 100), "tpdo = { event_ms = 50 }", "1800h:05 = 100"),
        (("1800:02", "uint8", 1), "tpdo = { transmission_type = 254 }", "1800h:02 = 1"),
        (("1800:01", "uint32", 0x4000_0286), "tpdo = { cob_id = 0x186 }", "1800h:01 = 286h"),
    ],
)
def test_a_download_against_the_site_files_own_pdo(
    tmp_path: Path, entry: tuple[str, str, int], drive: str, text: str
) -> None:
    verdict = judge(tmp_path, node=configure(entry), drive=f"{TIMEOUT}\n{drive}")
    assert f"{text}, and the bridge sets it to" in only(verdict, Severity.WARNING)
