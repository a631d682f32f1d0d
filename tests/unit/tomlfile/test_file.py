"""TOML files that people write: read whole or refused with line, key and a sentence."""

from __future__ import annotations

from pathlib import Path
from typing import Literal

import pytest
from hypothesis import HealthCheck, example, given, settings
from hypothesis import strategies as st
from pydantic import BaseModel, ConfigDict, Field

from bridge.base.errors import FileFaults
from bridge.config import load_site
from bridge.mapping import read_family
from bridge.tomlfile import TomlFile


def file_of(folder: Path, content: str | bytes) -> TomlFile:
    path = folder / "some.toml"
    path.write_bytes(content if isinstance(content, bytes) else content.encode())
    return TomlFile(path)


class TestReading:
    def test_a_byte_order_mark_and_windows_line_ends_are_no_fault(self, tmp_path: Path):
        file = file_of(tmp_path, b'\xef\xbb\xbf# comment\r\n[a]\r\nb = "x"\r\n')
        assert file.data == {"a": {"b": "x"}}
        assert file.line(("a", "b")) == 3

    def test_a_decimal_comma_is_answered_with_how_the_number_is_written(self, tmp_path: Path):
        with pytest.raises(FileFaults) as refused:
            file_of(tmp_path, '[parameters]\n"P102" = 3,5  # s\n')
        (fault,) = refused.value.faults
        assert (fault.line, fault.hint) == (2, "a number has a decimal point: 3.5")

    @pytest.mark.parametrize(
        ("content", "line", "message"),
        [
            (b"a = 1\nb = \n", 2, "is not TOML: Invalid value"),
            (b"[a\n", 1, "is not TOML"),
            (b"a = 1\na = 2\n", 2, "is not TOML: Cannot overwrite a value"),
            (b'a = "never ends', 1, "is not TOML"),
            (b"a = 1\nb = [1,\n\n", 2, "is not TOML"),
            ("a = 1\nb = 'ä'\n".encode("latin-1"), 2, "is not UTF-8"),
            (b"\xef\xbb\xbfa = 1\n\xff\n", 2, "is not UTF-8"),
            (b"a = " + b"[" * 5000 + b"]" * 5000, 0, "is nested too deeply"),
            (b"a = " + b"9" * 5000, 0, "cannot be read"),
            (b"a = 1\0", 1, "is not TOML"),
        ],
    )
    def test_what_is_not_toml_is_told_with_its_line(
        self, tmp_path: Path, content: bytes, line: int, message: str
    ):
        with pytest.raises(FileFaults) as caught:
            file_of(tmp_path, content)
        (fault,) = caught.value.faults
        assert (fault.line, fault.key) == (line, "")
        assert fault.message.startswith(message)
        assert "(at " not in fault.message

    def test_a_file_that_is_not_there_is_told_in_one_sentence(self, tmp_path: Path):
        with pytest.raises(FileFaults, match=r"nowhere\.toml: cannot be read: No such file or directory"):
            TomlFile(tmp_path / "nowhere.toml")
        with pytest.raises(FileFaults, match="cannot be read: Is a directory"):
            TomlFile(tmp_path)


class Inner(BaseModel):
    model_config = ConfigDict(extra="forbid", strict=True)
    name: str = Field(min_length=1, max_length=5, description="a short name")
    number: int = Field(1, ge=1, le=9, description="1…9")
    share: float = Field(0.5, gt=0, lt=1)
    color: Literal["red", "green"] = Field("red", description="red or green")
    flag: bool = False
    words: list[str] = []


class Outer(BaseModel):
    model_config = ConfigDict(extra="forbid", strict=True)
    inner: list[Inner] = Field(min_length=1, description="an [[inner]] table for each")
    limits: dict[str, float] = {}


@pytest.mark.parametrize(
    ("line", "told"),
    [
        ("", "inner[0].name: is missing (a short name)"),
        ("name = 5", "inner[0].name: must be a text in quotes, not 5 (a short name)"),
        ('name = ""', 'inner[0].name: must not be empty, not "" (a short name)'),
        (
            'name = "longer"',
            'inner[0].name: must have at most 5 characters, not "longer" (a short name)',
        ),
        ("number = 10", "inner[0].number: must be at most 9, not 10 (1…9)"),
        ("number = 0", "inner[0].number: must be at least 1, not 0 (1…9)"),
        ('number = "5"', 'inner[0].number: must be a whole number, not "5" (1…9)'),
        ("number = 5.5", "inner[0].number: must be a whole number, not 5.5 (1…9)"),
        ("number = true", "inner[0].number: must be a whole number, not true (1…9)"),
        ("share = 1.0", "inner[0].share: must be less than 1.0, not 1.0"),
        ("share = 0", "inner[0].share: must be more than 0.0, not 0"),
        ('share = "x"', 'inner[0].share: must be a number, not "x"'),
        ("flag = 1", "inner[0].flag: must be true or false, not 1"),
        (
            'color = "gren"',
            'inner[0].color: must be "red" or "green", not "gren" (did you mean "green"?)',
        ),
        ('color = "blue"', 'inner[0].color: must be "red" or "green", not "blue" (red or green)'),
        ('words = "x"', 'inner[0].words: must be a list, not "x"'),
        ('words = ["a", 2]', "inner[0].words[1]: must be a text in quotes, not 2"),
        ("nmber = 5", "inner[0].nmber: is not a key that belongs here (did you mean number?)"),
        (
            "zzz = 5",
            "inner[0].zzz: is not a key that belongs here "
            "(known here: color, flag, name, number, share, words)",
        ),
    ],
)
def test_a_fault_reads_like_a_sentence(tmp_path: Path, line: str, told: str):
    name = "" if line.startswith("name") or not line else 'name = "x"\n'
    file = file_of(tmp_path, f"[[inner]]\n{name}{line}\n")
    assert file.validate(Outer) is None
    (fault,) = file.faults
    place = 1 if not line else 3 if name else 2
    assert str(fault) == f"{file.path}:{place}: {told}"


@pytest.mark.parametrize(
    ("content", "told"),
    [
        ("", "inner: is missing (an [[inner]] table for each)"),
        ("inner = []", "1: inner: must have 1 or more entries (an [[inner]] table for each)"),
        ("inner = 5", "1: inner: must be a list, not 5 (an [[inner]] table for each)"),
        ("inner = [5]", "1: inner[0]: must be a table, not 5"),
        ("[inner]\nname = 'x'", "1: inner: must be a list (an [[inner]] table for each)"),
        ("[[inner]]\nname='x'\n[limits]\na = 'x'", '4: limits.a: must be a number, not "x"'),
    ],
)
def test_a_wrong_kind_of_table_is_told(tmp_path: Path, content: str, told: str):
    file = file_of(tmp_path, content)
    assert file.validate(Outer) is None
    assert [str(fault).removeprefix(f"{file.path}:").strip() for fault in file.faults] == [told]


def test_faults_come_in_the_order_of_the_file(tmp_path: Path):
    file = file_of(tmp_path, "a = 1\nb = 2\nc = 3\n")
    for name in "cab":
        file.fault((name,), "is wrong")
    with pytest.raises(FileFaults) as caught:
        file.finish()
    assert [fault.line for fault in caught.value.faults] == [1, 2, 3]
    assert caught.value.exit_code == 2


_LINE = st.one_of(
    st.sampled_from(
        [
            "[site]",
            "[[bus]]",
            "[[bus.node]]",
            "[[bus.node.drive]]",
            "[bus.node.identity]",
            "[modbus]",
            "[zenoh]",
            "[[slot]]",
            "[slot.rpdo]",
            "[control_word]",
            'name = "a"',
            "id = 5",
            "id = 1e400",
            "deadman_ms = 1",
            'drive = [{ slot = "fu1" }, 5]',
            "bus = [1, [2], {}]",
            'rpdo = ["control_word"]',
            "node.drive.slot = []",
            'listen = "x:1"',
            "a = 1979-05-27T07:32:00Z",
            "a = nan",
            'state = [{ name = "fault", pattern = "X" }]',
        ]
    ),
    st.builds(
        "{} = {}".format,
        st.sampled_from(["name", "id", "bus", "node", '"ä"', "a.b", "interface", "process"]),
        st.sampled_from(["1", "-0.1", '"x"', "'''\n[a]'''", "[", "{ a = 1 }", "true", "[[1], [2]]", "0x1F"]),
    ),
    st.text(max_size=20),
)


@pytest.mark.landing
@settings(max_examples=300, deadline=None, suppress_health_check=[HealthCheck.function_scoped_fixture])
@given(st.lists(_LINE, max_size=12).map("\n".join))
@example("[" * 2000)
@example("\ud800")
def test_whatever_stands_in_a_file_it_is_read_or_refused_with_faults(tmp_path: Path, text: str):
    path = tmp_path / "chance.toml"
    path.write_bytes(text.encode("utf-8", "surrogatepass"))
    for read in (load_site, read_family):
        try:
            read(path)
        except FileFaults as error:
            assert error.faults
            lines = text.count("\n") + 1
            assert all(0 <= fault.line <= lines for fault in error.faults)
