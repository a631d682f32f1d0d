"""``monitor`` with a recorded trace, in each format as python-can writes it."""

from __future__ import annotations

import json
from collections.abc import Sequence
from pathlib import Path

import can
import pytest
from typer.testing import CliRunner, Result

from bridge.cli.app import make_app
from tests.support import sites
from tests.support.invented import SPIN
from tests.support.mapping_folder import Folder

SYNC, RPDO, TPDO, HEARTBEAT = 0x080, 0x205, 0x185, 0x705
READY = bytes.fromhex("310B000000000000")
DISABLED = bytes(8)
LOST_S = (0.30, 0.65)
"""The bridge hung."""
FORMATS = [".log", ".asc", ".blf", ".trc"]


@pytest.fixture
def site(tmp_path: Path) -> Path:
    node = sites.node(sites.drive("fu1", "none", 0), more='supervision = "heartbeat"\nsupervision_ms = 300')
    return sites.write(tmp_path, sites.bus(node, interface="socketcan", more='channel = "can0"'))


def at(
    seconds: float, can_id: int, data: bytes = b"", channel: object = "can0", **more: object
) -> can.Message:
    return can.Message(
        timestamp=1_700_000_000 + seconds,
        arbitration_id=can_id,
        data=data,
        channel=channel,  # pyright: ignore[reportArgumentType]
        is_extended_id=False,
        **more,  # pyright: ignore[reportArgumentType]
    )


def traffic() -> list[can.Message]:
    """A second in which the bridge hangs once, and the node speaks all the time."""
    found = [at(n / 10, HEARTBEAT, b"\x05") for n in range(11)] + [at(0.01, TPDO, READY)]
    for n in range(101):
        if not LOST_S[0] < n / 100 < LOST_S[1]:
            found += [at(n / 100 + 0.001, RPDO, DISABLED), at(n / 100 + 0.002, SYNC)]
    return sorted(found, key=lambda message: message.timestamp)


def written(folder: Path, suffix: str, messages: Sequence[can.Message], channel: object = None) -> Path:
    path = folder / f"trace{suffix}"
    with can.Logger(path) as writer:
        for message in messages:
            if suffix != ".log":  # they know channels by number
                message.channel = 1 if channel is None else channel  # pyright: ignore[reportAttributeAccessIssue]
            writer(message)
    return path


def monitor(*arguments: object) -> Result:
    return CliRunner().invoke(make_app("monitor"), ["monitor", *map(str, arguments)])


@pytest.mark.parametrize("suffix", FORMATS)
def test_every_format_is_shown_with_the_sites_names_and_judged_by_its_bounds(
    tmp_path: Path, site: Path, suffix: str
) -> None:
    done = monitor(site, written(tmp_path, suffix, traffic()))
    assert done.exit_code == 1, (done.output, done.exception)
    lines = done.stdout.splitlines()
    assert len(lines) == len(traffic())
    assert any("TPDO1 conveyor/fu1" in line and "0B31h ready" in line for line in lines)
    place = place_of(tmp_path / f"trace{suffix}", 0x205)
    after = place_of(tmp_path / f"trace{suffix}", 0x080)
    said = done.stderr.splitlines()
    assert said == [
        f"{after}: SYNC: silent for 350 ms from 0.302 s on, deadman_ms allows 100 ms",
        f"{place}: RPDO1 conveyor/fu1: silent for 350 ms from 0.301 s on, deadman_ms allows 100 ms",
    ]


def place_of(path: Path, can_id: int) -> str:
    """Where the last frame with this identifier before the silence stands."""
    frames = [*enumerate(traffic(), 1)]
    number = next(n for n, one in reversed(frames) if one.arbitration_id == can_id and is_before(one))
    if path.suffix == ".blf":
        return f"frame {number}"
    lines = path.read_text().splitlines()
    first = next(n for n, line in enumerate(lines) if "705" in line)
    return f"line {first + number}"


def is_before(message: can.Message) -> bool:
    return message.timestamp - 1_700_000_000 < LOST_S[1]


def test_stops_are_shown_with_their_times_and_intruders_are_wrong(tmp_path: Path, site: Path) -> None:
    enabled, run = bytes.fromhex("370B000000000000"), bytes.fromhex("7F04000000000000")
    found = [at(n / 10, HEARTBEAT, b"\x05") for n in range(21)]
    found += [at(n / 100 + 0.002, SYNC) for n in range(201)]
    found += [at(n / 100, RPDO, run if n < 100 else DISABLED) for n in range(201)]
    found += [at(n / 50 + 0.005, TPDO, enabled if n < 60 else READY) for n in range(101)]
    frames = sorted(found, key=lambda message: message.timestamp)
    done = monitor(site, written(tmp_path, ".log", frames), "--statistics")
    assert done.exit_code == 0, (done.output, done.exception)
    stopped = next(n for n, one in enumerate(frames, 1) if one.data == READY)
    assert done.stderr.splitlines()[1:] == [
        f"line {stopped}: conveyor/fu1: stop commanded at 1.205 s; in the drive after 205 ms of 6500"
    ], done.stderr
    reset = at(0.5001, 0x000, bytes((0x81, 5)))
    frames = sorted([*found, reset], key=lambda message: message.timestamp)
    done = monitor(site, written(tmp_path, ".log", frames), "--statistics")
    assert done.exit_code == 1
    line = frames.index(reset) + 1
    assert (
        f"line {line}: can0: intruder at 0.500 s: NMT reset of node 5 while a drive of it is told to run: "
        "somebody else sends it\n"
    ) in done.stderr


def test_of_drives_that_the_witness_does_not_know_only_silences_are_judged(tmp_path: Path) -> None:
    folder = Folder(tmp_path)
    folder.add("acme/spin", SPIN)
    done = monitor(folder.site, written(tmp_path, ".log", traffic()))
    assert done.exit_code == 1, (done.output, done.exception)
    first, sync = done.stderr.splitlines()
    assert first == (
        "stops and intruders are not judged: the witness does not know the drives of the mapping acme/spin"
    )
    assert "SYNC: silent for 350 ms" in sync


@pytest.mark.parametrize("suffix", FORMATS)
def test_without_a_site_nothing_is_judged(tmp_path: Path, suffix: str) -> None:
    done = monitor(written(tmp_path, suffix, traffic()), "--kind", "heartbeat", "--json")
    assert done.exit_code == 0, (done.output, done.exception)
    assert done.stderr == ""
    shown = [json.loads(line) for line in done.stdout.splitlines()]
    assert [one["label"] for one in shown] == ["heartbeat node 5"] * 11
    assert shown[0]["time"] == pytest.approx(0.0, abs=0.001)
    assert shown[-1]["time"] == pytest.approx(1.0, abs=0.002)


def test_what_is_no_classical_frame_is_counted(tmp_path: Path) -> None:
    fd = at(0.5, 0x123, bytes(12), is_fd=True)
    error = at(0.6, 0x20, bytes(8), is_error_frame=True)
    done = monitor(written(tmp_path, ".log", [*traffic(), fd, error]))
    assert done.exit_code == 0, done.exception
    assert done.stderr == "left out: 1 CAN FD frames, 1 error frames\n"


def test_of_several_channels_the_sites_is_taken_or_one_is_asked_for(tmp_path: Path, site: Path) -> None:
    other = [at(n / 100 + 0.003, SYNC, channel="can1") for n in range(101)]
    both = sorted([*traffic(), *other], key=lambda message: message.timestamp)
    path = written(tmp_path, ".log", both)
    done = monitor(site, path)
    assert "SYNC: silent for 350 ms" in done.stderr
    assert "left out: 101 frames of other channels" in done.stderr
    done = monitor(path)
    assert str(done.exception) == (
        f"{path} has frames of several channels, of can0 and can1: say which by --channel"
    )
    done = monitor(path, "--channel", "can1")
    assert done.exit_code == 0
    assert len(done.stdout.splitlines()) == 101


@pytest.mark.parametrize("suffix", FORMATS)
def test_a_file_that_is_no_trace_is_said_to_be_none(tmp_path: Path, suffix: str) -> None:
    path = tmp_path / f"trace{suffix}"
    path.write_bytes(b"\x00\xffno trace\n" * 20)
    done = monitor(path)
    assert done.exit_code == 1, done.output
    assert str(done.exception).startswith(str(path)), done.exception


def test_one_that_is_not_there_and_two_of_them_are_refused(tmp_path: Path, site: Path) -> None:
    done = monitor(tmp_path / "none.log")
    assert str(done.exception).endswith("cannot be read: No such file or directory")
    done = monitor(site, tmp_path / "a.log", tmp_path / "b.asc")
    assert done.exit_code == 2
    assert "one SITE and one TRACE" in " ".join(done.output.split())


def test_a_trace_is_written_as_candump_does_with_its_own_times(tmp_path: Path) -> None:
    source = written(tmp_path, ".blf", traffic())
    copy = tmp_path / "copy.log"
    assert monitor(source, "--log", copy).exit_code == 0
    with can.LogReader(copy) as reader:
        times = [message.timestamp for message in reader]
    with can.LogReader(source) as reader:
        assert times == pytest.approx([message.timestamp for message in reader], abs=1e-5)
