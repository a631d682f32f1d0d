"""Backups as files: written for people, read back as they were, refused with line and reason."""

from __future__ import annotations

from pathlib import Path

import pytest
from hypothesis import HealthCheck, given, settings
from hypothesis import strategies as st

from bridge.base.errors import FileFaults
from bridge.image import Value
from bridge.parameter.backup_file import BackupFile, read_backup


def backup(**values: Value) -> BackupFile:
    return BackupFile("nord/sk-tu4-cao", "conveyor/fu1", "2026-11-27", values, {})


def read(folder: Path, text: str) -> BackupFile:
    path = folder / "set.toml"
    path.write_text(text, encoding="utf-8")
    return read_backup(path)


def test_what_is_written_is_read(tmp_path: Path) -> None:
    whole = BackupFile(
        "nord/sk-tu4-cao",
        "conveyor/fu1",
        "2026-11-27",
        {"P102": 2.5, "P105[1]": -3, "name": 'a "b" \\ ü', "on": True},
        {"P102": "acceleration\ntime"},
        missing=("P999",),
        identity={"vendor": 0x38, "serial": 7},
        objects={"2345:00": "0A 1B"},
        unreadable={"P700": "no answer"},
        left_out={"6040:00": "6040:00 commands"},
    )
    text = whole.text()
    found = read(tmp_path, text)
    assert (found.mapping, found.drive, found.saved) == ("nord/sk-tu4-cao", "conveyor/fu1", "2026-11-27")
    assert found.values == whole.values
    assert found.all == {**whole.values, **whole.objects}
    assert found.identity == {"vendor": 0x38, "serial": 7}
    assert found.lines["P102"] == text.splitlines().index('"P102" = 2.5  # acceleration time') + 1
    for comment in ("#   P999", "#   P700: no answer", "#   6040:00 commands"):
        assert comment in text.splitlines()


@settings(suppress_health_check=[HealthCheck.function_scoped_fixture], max_examples=40)
@given(
    st.dictionaries(
        st.text(min_size=1, max_size=8),
        st.one_of(
            st.booleans(), st.integers(-(2**63), 2**63 - 1), st.floats(allow_nan=False), st.text(max_size=9)
        ),
        max_size=4,
    )
)
def test_any_value_survives_or_is_named(tmp_path: Path, values: dict[str, Value]) -> None:
    finite = {name: one for name, one in values.items() if one not in (float("inf"), float("-inf"))}
    text = backup(**finite).text()
    if not any("\ud800" <= char <= "\udfff" for char in text):
        assert read(tmp_path, text).values == finite


GOOD = backup(P102=12.5).text()


@pytest.mark.parametrize(
    ("old", "new", "line", "told"),
    [
        ("format = 3", "format = 4", 2, "format: must be 3"),
        ('mapping = "nord/sk-tu4-cao"', 'mapping = ""', 3, "mapping: is missing"),
        ("[parameters]", "[others]", 0, "parameters: is missing"),
        ('"P102" = 12.5', '"P102" = [1]', 8, 'parameters."P102": must be a number, a text, true or false'),
        ('"P102" = 12.5', '"P102" = nan', 8, 'parameters."P102": must be a number'),
    ],
)
def test_what_is_wrong_is_named_with_its_line(
    tmp_path: Path, old: str, new: str, line: int, told: str
) -> None:
    assert old in GOOD
    with pytest.raises(FileFaults) as caught:
        read(tmp_path, GOOD.replace(old, new))
    fault = caught.value.faults[0]
    assert (fault.line, f"{fault.key}: {fault.message}"[: len(told)]) == (line, told)


def test_a_name_stands_once_and_an_identity_is_numbers(tmp_path: Path) -> None:
    text = GOOD.replace(
        "[parameters]", '[identity]\nserial = "x"\nmaker = 5\n\n[objects]\n"P102" = 1\n[parameters]'
    )
    with pytest.raises(FileFaults) as caught:
        read(tmp_path, text)
    told = [f"{fault.key}: {fault.message}" for fault in caught.value.faults]
    assert 'objects."P102": stands in [parameters], too: leave one of them out' in told
    assert sum("must be a whole number, called vendor, product, revision, serial" in one for one in told) == 2


@pytest.mark.parametrize("end", range(1, 120, 7))
def test_a_file_that_breaks_off_is_no_smaller_set(tmp_path: Path, end: int) -> None:
    """Half a number is a number: 12.5 that breaks off is 12."""
    with pytest.raises(FileFaults):
        read(tmp_path, GOOD[:-end])


def test_older_formats_have_no_line_for_their_end(tmp_path: Path) -> None:
    old = GOOD.replace("format = 3", "format = 2").rpartition("\n#")[0]
    assert read(tmp_path, old).values == {"P102": 12.5}
    with pytest.raises(FileFaults, match="ends within this line"):
        read(tmp_path, old.rstrip("\n"))
