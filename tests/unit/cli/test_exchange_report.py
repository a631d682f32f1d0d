"""State kept of an exchange until it is done: begun again with the same device and files it goes on."""

from __future__ import annotations

import hashlib
import json
from datetime import UTC, datetime
from pathlib import Path
from typing import Any

import pytest

from bridge.base.errors import OperationFailed
from bridge.cli.drop_report import Occasion
from bridge.cli.exchange_report import DeviceExchange, begin, markdown

IDENTITY = {"vendor": 0x38, "serial": 7}
PROVEN = {"drive": "conveyor/fu1", "verdict": "proven", "reacted_ms": 250.0}
WRITTEN = {"name": "P102", "before": None, "value": 2.5}


def occasion(folder: Path, hour: int) -> Occasion:
    at = datetime(2026, 11, 27, hour, tzinfo=UTC)
    return Occasion("ann", "box", "typed yes", at, folder / "site.toml")


def begun(
    folder: Path, hour: int = 10, content: str = "set", identity: dict[str, int] = IDENTITY
) -> DeviceExchange:
    file = folder / "fu1.toml"
    file.write_text(content)
    return begin(folder / "state", occasion(folder, hour), "conveyor", identity, [file])


def facts(*written: dict[str, object]) -> dict[str, Any]:
    return {"written": list(written), "same": 3, "missing": [], "read_only": [], "warnings": []}


def test_a_new_one_has_the_sums_of_its_files_and_nothing_done(tmp_path: Path) -> None:
    one = begun(tmp_path)
    (sha256,) = one.files.values()
    assert sha256 == hashlib.sha256(b"set").hexdigest()
    assert (one.began, one.drives, one.is_unsaved) == ("2026-11-27T10:00:00+00:00", {}, False)
    assert one.path.exists()


def test_who_begins_again_reports_also_what_was_written_before(tmp_path: Path) -> None:
    begun(tmp_path).keep("conveyor/fu1", facts(WRITTEN))
    again = begun(tmp_path, hour=11)
    assert (again.began, again.last) == ("2026-11-27T10:00:00+00:00", "2026-11-27T11:00:00+00:00")
    assert again.is_unsaved
    again.keep("conveyor/fu1", facts({**WRITTEN, "name": "P103"}))
    assert [one["name"] for one in again.drives["conveyor/fu1"]["written"]] == ["P102", "P103"]


@pytest.mark.parametrize("more", [{"content": "another"}, {"identity": {"vendor": 0x38, "serial": 8}}])
def test_with_another_device_or_other_files_it_begins_anew(tmp_path: Path, more: dict[str, Any]) -> None:
    begun(tmp_path).keep("conveyor/fu1", facts(WRITTEN))
    assert begun(tmp_path, hour=11, **more).drives == {}


@pytest.mark.parametrize("kept", ["", "{", "[]", "{}", '{"node": "conveyor"}'])
def test_half_of_what_was_kept_is_nothing(tmp_path: Path, kept: str) -> None:
    one = begun(tmp_path)
    one.keep("conveyor/fu1", facts(WRITTEN))
    one.path.write_text(kept)
    assert begun(tmp_path, hour=11).drives == {}


def test_what_was_written_is_unsaved_until_it_is_saved(
    tmp_path: Path,
) -> None:
    one = begun(tmp_path)
    one.keep("conveyor/fu1", facts())
    assert not one.is_unsaved
    one.keep("conveyor/fu1", facts(WRITTEN))
    one.saved("90 % of its writes")
    assert (one.is_unsaved, one.warnings) == (False, ["90 % of its writes"])
    assert json.loads(one.path.read_text())["is_unsaved"] is False


def test_what_cannot_be_kept_is_told(tmp_path: Path) -> None:
    (tmp_path / "state").write_text("a file")
    with pytest.raises(OperationFailed, match="what was done cannot be kept in"):
        begun(tmp_path)


def report(*, ok: bool) -> dict[str, Any]:
    return {
        "ok": ok,
        "began": "10:00",
        "time": "2026-11-27T11:00:00+00:00",
        "operator": "ann",
        "host": "box",
        "consent": "typed yes",
        "node": {"name": "conveyor", "id": 5, "bus": "can0", "mapping": "x"},
        "old": {},
        "new": IDENTITY,
        "site": {"file": "/site.toml", "sha256": "abc"},
        "files": {"/fu1.toml": "def"},
        "drives": {"conveyor/fu1": facts(WRITTEN, {**WRITTEN, "value": "a|b", "before": 1})},
        "warnings": ["old EEPROM"],
        "audit": [{"drive": "conveyor/fu1", "verdict": "stops"}],
        "drop_test": {
            "drives": [{"drive": "conveyor/fu1", "verdict": "proven", "reacted_ms": 250.0}],
            "failure": None,
        },
        "sha256": "ghi",
    }


def test_people_read_what_was_written_and_what_was_proven() -> None:
    text = markdown(report(ok=True))
    assert text.startswith("# Exchange of conveyor: done\n")
    assert "- **Old device**: not told\n- **New device**: vendor 38h, serial 7h" in text
    assert "| P102 | not read | 2.5 |" in text
    assert "| P102 | 1 | a\\|b |" in text
    assert "| conveyor/fu1 | stops | proven | 250 ms |" in text
    assert "Warning: old EEPROM" in text
    assert markdown(report(ok=False)).startswith("# Exchange of conveyor: NOT done")


def test_what_was_kept_goes_once_it_is_a_success(tmp_path: Path) -> None:
    one = begun(tmp_path)
    one.end(report(ok=False))
    assert one.path.exists()
    as_json, as_text = one.end(report(ok=True))
    assert not one.path.exists()
    assert json.loads(as_json.read_text())["ok"] is True
    assert as_text.read_text().startswith("# Exchange of conveyor")
