"""Memory of the command line for SDO servers, from one call to the next."""

from __future__ import annotations

import json
from pathlib import Path

import pytest

from bridge.bustools.single import SdoTask
from bridge.canopen.frame import Frame
from bridge.cli import known_servers
from bridge.cli.bus_runner import BusChoice, choose_bus
from bridge.cli.known_servers import KnownServers
from tests.support.sdo_block import INDEX

LENGTH = "8C000000"
WHY = "the node refuses it: 1F20h:00: the node aborted: general error (08000000h)"


@pytest.fixture(autouse=True)
def state(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> Path:
    monkeypatch.setenv("XDG_STATE_HOME", str(tmp_path))
    return tmp_path / "drivebridge" / "sdo-servers.json"


def servers(channel: str = "can0") -> KnownServers:
    return KnownServers(choose_bus(None, BusChoice(None, "socketcan", channel)))


def read(known: KnownServers) -> list[str]:
    """Requests of one ``sdo read`` of a long object to a node that refuses blocks."""
    task = SdoTask(5, INDEX, 0, None, 0.0, 0.5, known=known.known())
    sent: list[str] = []
    for answer in (f"41201F00{LENGTH}", "80201F0000000008", f"41201F00{LENGTH}"):
        sent += [frame.data.hex()[:2] for frame in task.take_frames()]
        if sent[-1] == "60":
            break
        task.on_frame(Frame(0x585, bytes.fromhex(answer), 0.0))
    for place in range(20):
        head = (place % 2) << 4 | (place == 19)
        task.on_frame(Frame(0x585, bytes((head,)) + b"abcdefg", 0.0))
        sent += [frame.data.hex()[:2] for frame in task.take_frames()]
    assert task.result == b"abcdefg" * 20
    known.learn(task.take_learned())
    return sent


def test_a_server_that_refuses_blocks_is_not_asked_for_them_by_the_next_command(
    capsys: pytest.CaptureFixture[str],
) -> None:
    assert "a4" in read(servers())
    assert "block transfer is not used any more: the node refuses it" in capsys.readouterr().err
    assert "a4" not in read(servers())
    assert capsys.readouterr().err == "", "it is said once"
    assert "a4" in read(servers("can1")), "node 5 of another bus is another device"


def test_what_was_learned_long_ago_counts_no_more(monkeypatch: pytest.MonkeyPatch) -> None:
    """The device may have another program by then."""
    servers().learn({0x605: WHY})
    assert dict(servers().known()) == {0x605: WHY}
    later = known_servers.time.time() + 31 * 86_400
    monkeypatch.setattr(known_servers.time, "time", lambda: later)
    assert dict(servers().known()) == {}


@pytest.mark.parametrize("content", ["", "{", "[]", '{"servers": 1}', '{"servers": {"a": {"x": 1}}}', "\xff"])
def test_a_file_that_cannot_be_read_is_as_none(state: Path, content: str) -> None:
    state.parent.mkdir()
    state.write_bytes(content.encode("latin-1"))
    assert dict(servers().known()) == {}
    servers().learn({0x605: WHY})
    assert json.loads(state.read_bytes())["servers"]["socketcan can0"]["1541"]["why_no_block"] == WHY


def test_where_nothing_can_be_kept_it_is_said(state: Path, capsys: pytest.CaptureFixture[str]) -> None:
    state.parent.write_text("no folder", encoding="utf-8")
    servers().learn({0x605: WHY})
    assert "cannot be written" in capsys.readouterr().err
