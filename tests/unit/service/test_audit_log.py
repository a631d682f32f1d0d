"""The audit log's file: whole lines, rotated, and a disk that fails stops nothing."""

from __future__ import annotations

import json
import os
import resource
import time
from pathlib import Path

import pytest

from bridge.base.line_file import LineFile
from bridge.command import Action, Do, Event, Identity, Plant, Request, Source, Write
from bridge.command.audit import AuditEntry, AuditOutcome
from bridge.config import Site
from bridge.service.audit_log import AuditLog, as_line
from tests.support import sites
from tests.support.process import until
from tests.support.rig import ENABLE, PLC, SHUT_DOWN

NOON_NS = 1_795_262_400_123_456_789
"""2026-11-21 12:00:00.123456789 UTC."""
LINE = b"x" * 99 + b"\n"


def lines(path: Path) -> list[bytes]:
    return path.read_bytes().splitlines()


def written(file: LineFile, *these: bytes) -> LineFile:
    """The file after these lines, closed."""
    file.start()
    for line in these:
        file.put(line)
    file.close()
    return file


def test_lines_are_appended_to_what_is_there(tmp_path: Path) -> None:
    path = tmp_path / "deep" / "audit.jsonl"
    written(LineFile(path, 10_000, 2), b"one\n", b"two\n")
    file = written(LineFile(path, 10_000, 2), b"three\n")
    assert lines(path) == [b"one", b"two", b"three"]
    assert file.all_lost == 0
    assert path.stat().st_mode & 0o777 == 0o640


def test_it_is_rotated_by_size_and_the_oldest_go(tmp_path: Path) -> None:
    path = tmp_path / "audit.jsonl"
    written(LineFile(path, 1000, 2), *(b"%04d%s" % (n, LINE[4:]) for n in range(35)))
    assert sorted(entry.name for entry in tmp_path.iterdir()) == [
        "audit.jsonl",
        "audit.jsonl.1",
        "audit.jsonl.2",
    ]
    assert [int(line[:4]) for line in lines(path)] == [30, 31, 32, 33, 34]
    assert [int(line[:4]) for line in lines(tmp_path / "audit.jsonl.1")] == list(range(20, 30))
    assert all(entry.stat().st_size <= 1000 for entry in tmp_path.iterdir())


def test_none_is_kept_where_none_is_wanted(tmp_path: Path) -> None:
    path = tmp_path / "audit.jsonl"
    written(LineFile(path, 1000, 0), *[LINE] * 11)
    assert [entry.name for entry in tmp_path.iterdir()] == ["audit.jsonl"]
    assert len(lines(path)) == 1


def test_a_full_disk_costs_lines_and_says_so() -> None:
    file = written(LineFile(Path("/dev/full"), 10_000, 2), LINE, LINE)
    assert file.all_lost == 2
    assert file.fault == os.strerror(28)


def test_a_folder_that_cannot_be_made_costs_lines_and_says_so(tmp_path: Path) -> None:
    (tmp_path / "file").touch()
    file = written(LineFile(tmp_path / "file" / "audit.jsonl", 10_000, 2), LINE)
    assert file.all_lost == 1
    assert file.fault


def test_a_line_that_fits_in_part_is_taken_back(tmp_path: Path) -> None:
    path = tmp_path / "audit.jsonl"
    soft, hard = resource.getrlimit(resource.RLIMIT_FSIZE)
    resource.setrlimit(resource.RLIMIT_FSIZE, (150, hard))
    try:
        file = written(LineFile(path, 10_000, 2), LINE, LINE)
    finally:
        resource.setrlimit(resource.RLIMIT_FSIZE, (soft, hard))
    assert path.read_bytes() == LINE
    assert file.all_lost == 1


def test_it_goes_on_when_the_disk_does(tmp_path: Path) -> None:
    folder = tmp_path / "state"
    folder.touch()
    now = 100.0
    file = LineFile(folder / "audit.jsonl", 10_000, 2, lambda: now)
    file.start()
    file.put(b"lost\n")
    until(lambda: file.lost == 1, 5, "the first line is lost")
    folder.unlink()
    file.put(b"too early\n")
    until(lambda: file.lost == 2, 5, "the disk is left alone for a moment")
    now += 1
    file.put(b"there\n")
    file.close()
    assert lines(folder / "audit.jsonl") == [b"there"]
    assert not file.fault


def test_a_disk_that_hangs_holds_nobody_up(tmp_path: Path) -> None:
    """A FIFO without a reader: opening it never returns."""
    path = tmp_path / "audit.jsonl"
    os.mkfifo(path)
    file = LineFile(path, 10_000, 2)
    file.start()
    begin = time.monotonic()
    for _ in range(10_500):
        file.put(LINE)
    assert file.all_lost >= 499, "the thread has taken one at most"
    file.close()
    assert time.monotonic() - begin < 5
    os.close(os.open(path, os.O_RDONLY | os.O_NONBLOCK))  # lets the thread go on,
    file.close()  # to its end


# the lines


def test_a_line_is_json_with_both_times() -> None:
    who = Identity(Source.OPCUA, "ann", address="10.0.0.7:5000")
    ending = AuditOutcome("ok", "", forwarded=True)
    entry = AuditEntry(
        12.3456789, who, "conveyor/fu1", "write", ending, {"frequency": 0.0}, {"frequency": 25.0}
    )
    assert json.loads(as_line(entry, NOON_NS)) == {
        "t": "2026-11-21T12:00:00.123456Z",
        "mono": 12.345679,
        "source": "opcua",
        "user": "ann",
        "role": "operator",
        "address": "10.0.0.7:5000",
        "target": "conveyor/fu1",
        "action": "write",
        "old": {"frequency": 0.0},
        "new": {"frequency": 25.0},
        "code": "ok",
        "forwarded": True,
    }


def test_a_line_for_several_leaves_out_in_what_they_differ() -> None:
    who = Identity(Source.OPCUA, "", address="10.0.0.9")
    line = as_line(AuditEntry(1.0, who, "", "stop", AuditOutcome("unknown_target"), count=190), NOON_NS)
    assert json.loads(line).keys() == {
        "t",
        "mono",
        "source",
        "address",
        "action",
        "code",
        "forwarded",
        "count",
    }


@pytest.mark.parametrize("name", ["a\nb", "\x00", "ü" * 5000, "\ud800", '"}'])
def test_whatever_a_client_calls_itself_it_is_one_line(name: str) -> None:
    who = Identity(Source.OPCUA, name)
    line = as_line(
        AuditEntry(1.0, who, name, name, AuditOutcome("not_allowed", name), {}, {name: name}), NOON_NS
    )
    assert line.count(b"\n") == 1
    assert len(line) < 6000
    assert json.loads(line)["code"] == "not_allowed"


@pytest.mark.parametrize("value", [float("nan"), float("inf"), 2**64 - 1, -(2**63), True, 1e308])
def test_whatever_is_written_it_is_json(value: float) -> None:
    line = as_line(
        AuditEntry(1.0, PLC, "a/b", "write", AuditOutcome("out_of_range"), {}, {"v": value}), NOON_NS
    )
    json.loads(line)


# in the service


def logged(folder: Path, more: str = "") -> tuple[Plant, AuditLog, list[Event]]:
    text = sites.site(
        sites.bus(sites.node(sites.drive("fu1", "modbus", 200))), sites.modbus(), more, folder=folder
    )
    site = Site.model_validate(sites.parsed(text))
    plant = sites.plant_of(text)
    events: list[Event] = []
    plant.on_event(events.append)
    return plant, AuditLog(plant, site, lambda: 100.0, lambda at: NOON_NS), events


def write(plant: Plant, word: int) -> None:
    plant.submit(Request(PLC, "conveyor/fu1", Write({"control_word": word})), 100.0, lambda outcome: None)


def test_what_the_plant_is_asked_is_in_the_state_folder(tmp_path: Path) -> None:
    plant, log, events = logged(tmp_path)
    log.start()
    write(plant, SHUT_DOWN)
    write(plant, SHUT_DOWN)
    write(plant, ENABLE)
    log.close()
    told = [json.loads(line) for line in lines(tmp_path / "state" / "audit.jsonl")]
    assert [(line["action"], line.get("new")) for line in told] == [
        ("write", {"control_word": SHUT_DOWN}),
        ("telegrams", None),
        ("write", {"control_word": ENABLE}),
    ]
    log.look(101.0)
    assert plant.image.read("bridge/audit_lost").value == 0
    assert not [event for event in events if event.source == "bridge"]


def test_the_site_file_names_another_file_or_none(tmp_path: Path) -> None:
    plant, log, _ = logged(tmp_path, f'[audit]\nfile = "{tmp_path}/here.jsonl"\nevery_telegram = true\n')
    log.start()
    for _ in range(3):
        write(plant, SHUT_DOWN)
    log.close()
    assert len(lines(tmp_path / "here.jsonl")) == 3
    plant, log, _ = logged(tmp_path, "[audit]\nenabled = false\n")
    log.start()
    write(plant, SHUT_DOWN)
    log.close()
    assert not (tmp_path / "state").exists()


def test_a_line_that_cannot_be_written_costs_the_line_alone(tmp_path: Path) -> None:
    """Whoever asked gets the outcome, and the service goes on."""
    plant, _, _ = logged(tmp_path)
    no_date = 10**40
    log = AuditLog(plant, plant.site, lambda: 100.0, lambda at: no_date)
    log.start()
    outcomes: list[object] = []
    request = Request(PLC, "conveyor/fu1", Write({"control_word": SHUT_DOWN}))
    plant.submit(request, 100.0, outcomes.append)
    assert len(outcomes) == 1
    log.look(200.0)
    log.close()
    assert plant.image.read("bridge/audit_lost").value == 1


def test_a_disk_that_fails_is_an_event_and_a_count_and_the_drive_is_commanded(tmp_path: Path) -> None:
    plant, log, events = logged(tmp_path, '[audit]\nfile = "/dev/full"\n')
    log.start()
    write(plant, SHUT_DOWN)
    until(lambda: log.file.lost == 1, 5, "the line is lost")
    log.look(101.0)
    log.look(102.0)
    assert plant.image.read("bridge/audit_lost").value == 1
    (event,) = events[-1:]
    assert "/dev/full" in event.message
    assert [told.message for told in events].count(event.message) == 1
    assert plant.drives["conveyor/fu1"].channel.control_word == SHUT_DOWN
    log.close()


def test_what_is_refused_pushes_nothing_out_that_was_done(tmp_path: Path) -> None:
    """However often, and where every telegram is wanted: it has a file of its own."""
    plant, log, _ = logged(tmp_path, "[audit]\nmax_bytes = 10000\nkeep = 1\nevery_telegram = true\n")
    log.start()
    write(plant, SHUT_DOWN)
    for number in range(3000):
        request = Request(Identity(Source.MODBUS, "10.0.0.66"), f"attic/fu{number}", Do(Action.STOP))
        plant.submit(request, 100.0, lambda outcome: None)
    write(plant, ENABLE)
    log.close()
    folder = tmp_path / "state"
    told = [json.loads(line) for line in lines(folder / "audit.jsonl")]
    assert [line["new"]["control_word"] for line in told] == [SHUT_DOWN, ENABLE]
    assert sorted(path.name for path in folder.iterdir()) == [
        "audit-refused.jsonl",
        "audit-refused.jsonl.1",
        "audit.jsonl",
    ]
    refused = [json.loads(line) for line in lines(folder / "audit-refused.jsonl")]
    assert refused[-1]["target"] == "attic/fu2999"
    assert all(path.stat().st_size <= 10_000 for path in folder.iterdir())


@pytest.mark.landing
def test_a_flood_of_refusals_leaves_room_for_what_is_done(tmp_path: Path) -> None:
    """Lines wait for the disk in a queue of their own: it may be full of refusals."""
    plant, log, _ = logged(tmp_path, "[audit]\nevery_telegram = true\n")
    plant.audit.tell_to(log._on_entry, every_telegram=True)
    for number in range(11_000):
        request = Request(Identity(Source.MODBUS, "10.0.0.66"), f"attic/fu{number}", Do(Action.STOP))
        plant.submit(request, 100.0, lambda outcome: None)
    write(plant, SHUT_DOWN)
    assert log.refused.all_lost == 1000
    assert log.file.all_lost == 0
    log.start()
    log.close()
    assert len(lines(tmp_path / "state" / "audit.jsonl")) == 1
    assert sum(len(lines(path)) for path in (tmp_path / "state").glob("audit-refused.*")) == 10_000
