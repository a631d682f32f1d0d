"""Output of the commands on a terminal: no foreign control characters, and signs of progress."""

from __future__ import annotations

import io
import logging
import struct
import sys
from pathlib import Path

import pytest
from hypothesis import given
from hypothesis import strategies as st

from bridge.base.errors import OperationFailed
from bridge.bustools.decode import FrameKind, FrameMeaning
from bridge.bustools.single import SdoTask
from bridge.canopen.frame import Frame
from bridge.cli import logs, monitor, sdo_command
from bridge.cli.app import run_app
from bridge.cli.bus_runner import print_table
from bridge.cli.terminal import printable, progress

CLEAR = "\x1b[2J"


@pytest.mark.parametrize(
    ("text", "shown"),
    [
        (CLEAR, r"\x1b[2J"),
        ("a\nb\r\t", r"a\nb\r\t"),
        ("\x9b2J\x7f", r"\x9b2J\x7f"),
        ("\u202egnp", r"\u202egnp"),
        ("Förderer 5 µs → ein", "Förderer 5 µs → ein"),
        ("a\N{NO-BREAK SPACE}b", "a\\xa0b"),
    ],
)
def test_control_characters_are_escaped(text: str, shown: str) -> None:
    assert printable(text) == shown


@given(st.text())
def test_nothing_is_left_that_a_terminal_obeys(text: str) -> None:
    assert all(character.isprintable() for character in printable(text))


def test_a_table_is_as_wide_as_what_is_shown(capsys: pytest.CaptureFixture[str]) -> None:
    """The name of a device (1008h), for one."""
    print_table([("name", "x"), (CLEAR, "1")])
    assert capsys.readouterr().out == "name     x\n\\x1b[2J  1\n"


def test_the_monitor_shows_them_escaped() -> None:
    meaning = FrameMeaning(FrameKind.SDO, 5, f"SDO {CLEAR}", f'"{CLEAR}"')
    line = monitor.for_people(Frame(0x585, b""), meaning, 0.0)
    assert CLEAR not in line
    assert line.count(r"\x1b[2J") == 2


def test_a_value_that_was_read_is_shown_escaped_and_is_itself_for_scripts() -> None:
    value = sdo_command.decode("string", CLEAR.encode())
    assert value == CLEAR
    assert sdo_command.for_people(value, b"") == r"\x1b[2J"


def test_a_device_description_is_shown_escaped(tmp_path: Path, capsys: pytest.CaptureFixture[str]) -> None:
    path = tmp_path / "odd.eds"
    path.write_text(f"[DeviceInfo]\nVendorName=Ac{CLEAR}me\n[1000]\nParameterName=x\n{CLEAR}\n", "utf-8")
    run(["eds", str(path)])
    shown = capsys.readouterr().out
    assert r"Ac\x1b[2Jme" in shown
    assert "\x1b" not in shown


def test_an_error_is_shown_escaped_line_by_line(
    monkeypatch: pytest.MonkeyPatch, capsys: pytest.CaptureFixture[str]
) -> None:
    def fail() -> None:
        raise OperationFailed(f"first {CLEAR}\nsecond")

    monkeypatch.setattr("bridge.cli.app.make_app", lambda *words: fail)
    with pytest.raises(SystemExit):
        run_app()
    assert capsys.readouterr().err == "first \\x1b[2J\nsecond\n"


@pytest.mark.parametrize("journal", [True, False])
def test_what_the_log_is_told_is_one_line(
    journal: bool, monkeypatch: pytest.MonkeyPatch, capsys: pytest.CaptureFixture[str]
) -> None:
    monkeypatch.delenv("JOURNAL_STREAM", raising=False)
    if journal:
        monkeypatch.setenv("JOURNAL_STREAM", "8:1")
    root = logging.getLogger()
    before = root.handlers[:], root.level
    try:
        logs.set_up(verbose=False)
        logging.getLogger("x").info("name %s\nmore", CLEAR)
    finally:
        root.handlers[:], root.level = before
    shown = capsys.readouterr().err
    assert "\x1b" not in shown
    assert shown.count("\n") == 1


def run(words: list[str]) -> None:
    from bridge.cli.app import make_app

    make_app(*words[:1])(words, standalone_mode=False)


# progress


class Terminal(io.StringIO):
    def isatty(self) -> bool:
        return True


def test_progress_says_how_far_it_is(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setenv("TERM", "xterm")
    monkeypatch.setenv("COLUMNS", "120")
    terminal = Terminal()
    monkeypatch.setattr(sys, "stderr", terminal)
    with progress("1008h:00 of node 5") as show:
        show(1400, 4096, "1400 of 4096 bytes")
    assert "1008h:00 of node 5" in terminal.getvalue()
    assert "1400 of 4096 bytes" in terminal.getvalue()


def test_where_nobody_looks_nothing_is_shown(capsys: pytest.CaptureFixture[str]) -> None:
    with progress("1008h:00 of node 5") as show:
        show(1400, 4096, "")
    assert capsys.readouterr() == ("", "")


def test_a_long_read_knows_how_much_has_come() -> None:
    task = SdoTask(5, 0x1008, 0, None, 0.0, 0.5)
    task.take_frames()
    assert (task.done_bytes, task.total_bytes) == (0, None)
    task.on_frame(Frame(0x585, b"\x41\x08\x10\x00" + struct.pack("<I", 16), 0.1))
    assert (task.done_bytes, task.total_bytes) == (0, 16)
    for count, toggle in ((7, 0x00), (14, 0x10)):
        task.take_frames()
        task.on_frame(Frame(0x585, bytes((toggle,)) + b"drivebr", 0.2))
        assert task.done_bytes == count
    task.on_frame(Frame(0x585, b"\x0bge\0\0\0\0\0", 0.3))
    assert task.done_bytes == 16
    assert task.result == b"drivebrdrivebrge"


def test_a_long_write_knows_how_much_has_gone() -> None:
    task = SdoTask(5, 0x1F50, 1, bytes(16), 0.0, 0.5)
    assert (task.done_bytes, task.total_bytes) == (0, 16)
    task.take_frames()
    task.on_frame(Frame(0x585, bytes.fromhex("60501F0100000000"), 0.1))
    task.take_frames()
    assert task.done_bytes == 7


def test_a_log_file_that_cannot_be_opened_is_one_sentence(tmp_path: Path) -> None:
    words = ["monitor", "--interface", "socketcan", "--channel", "nosuchcan"]
    path = tmp_path / "none" / "x"
    with pytest.raises(OperationFailed, match=f"{path} cannot be written: No such file or directory"):
        run([*words, "--log", str(path)])


def test_a_log_file_that_is_full_is_one_sentence() -> None:
    with (
        pytest.raises(OperationFailed, match="/dev/full cannot be written: No space left on device"),
        monitor.Record(Path("/dev/full")) as record,
    ):
        record.write("can0", Frame(0x705, b"\x05", 1.0))
