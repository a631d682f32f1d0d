"""PDOs that a node would refuse or not evaluate are named."""

from __future__ import annotations

from pathlib import Path

from bridge.lint import Severity
from bridge.mapping.model import Pdo
from tests.support.lint_site import FAMILY, NORD, TIMEOUT, findings, judge, only


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
