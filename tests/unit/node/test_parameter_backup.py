"""Backups of parameters: what was backed up can be restored, and whatever ends it is told.

The command line's errand with the simulated NORD interface, on a virtual clock.
"""

from __future__ import annotations

from collections.abc import Callable
from pathlib import Path

import pytest

from bridge.config import NodeTable
from bridge.errands.parameter import ParameterErrand
from bridge.errors import FileFaults
from bridge.image import Value
from bridge.mapping import load_family
from bridge.node.parameters.run import Procedure
from bridge.parameter import DriveParameters, Ledger, Names, ParameterError, backups
from bridge.parameter.backup_file import BackupFile, read_backup
from bridge.parameter.ledger import Saved
from bridge.sim.nord_supervision import Presence
from bridge.sim.nord_tu4 import NordTu4

NORD = load_family("nord/sk-tu4-cao")
NODE = NodeTable.model_validate(
    {"name": "conveyor", "id": 5, "mapping": "nord/sk-tu4-cao", "drive": [{"slot": "fu1"}]}
)


class Workshop:
    """A node, and a command that works on its drive fu1."""

    def __init__(self) -> None:
        self.node = NordTu4(5)
        self.now = 1000.0
        self.node.start(self.now)
        self.ledger = Ledger()
        self.access = DriveParameters("conveyor/fu1", "conveyor", NORD, Names(NORD), self.ledger)
        self.wait(2.0)

    def wait(self, seconds: float) -> None:
        end = self.now + seconds
        while self.now < end:
            self.now = min(end, self.now + 0.05)
            self.node.on_time(self.now)
            self.node.take_frames()

    def run(self, make: Callable[[float], Procedure[None]]) -> ParameterError | None:
        errand = ParameterErrand(NODE, NORD, NORD.slot_named("fu1"), make, self.now)
        for _ in range(20_000):
            for frame in errand.take_frames():
                self.node.on_frame(frame, self.now)
            self.node.on_time(self.now)
            for frame in self.node.take_frames():
                errand.on_frame(frame._replace(time=self.now))
            errand.on_time(self.now)
            if errand.is_finished(self.now):
                return errand.result
            self.now += 0.001
        raise AssertionError("the errand does not end")

    def back_up(self) -> backups.Backup:
        found = backups.Backup()
        assert self.run(lambda now: backups.back_up(self.access, found, now)) is None
        return found

    def restore(self, values: dict[str, Value]) -> backups.Restored:
        self.access.forget()
        done = backups.Restored()
        assert self.run(lambda now: backups.restore(self.access, values, done, now)) is None
        return done

    def compare(self, values: dict[str, Value]) -> backups.Comparison:
        self.access.forget()
        found = backups.Comparison()
        assert self.run(lambda now: backups.compare(self.access, values, found, now)) is None
        return found

    @property
    def eeprom_writes(self) -> int:
        return self.node.drives[0].parameters.eeprom_writes


@pytest.fixture
def workshop() -> Workshop:
    return Workshop()


def test_a_backup_has_every_setting_and_nothing_else(workshop: Workshop) -> None:
    found = workshop.back_up()
    assert found.values["P102.1"] == 2.0
    assert found.values["P543[2].4"] == 4
    assert found.values["P151"] == 0
    # read-only ones are no settings, and commands are none either
    assert not {"P700[1]", "P173", "P152"} & found.values.keys()
    assert not found.missing
    assert workshop.eeprom_writes == 0


def test_what_was_backed_up_is_the_same_and_is_not_written(workshop: Workshop) -> None:
    values = workshop.back_up().values
    assert not workshop.compare(values).differences
    done = workshop.restore(values)
    assert (done.written, done.error) == ([], None)
    assert len(done.same) == len(values)
    assert workshop.eeprom_writes == 0


def test_only_what_differs_is_restored_in_the_order_of_the_mapping(workshop: Workshop) -> None:
    values = workshop.back_up().values
    changed = {**values, "P513": 2.5, "P102.3": 1.03, "P103.1": 5.0}
    differences = workshop.compare(changed).differences
    assert [(one.entry.name, one.in_drive, one.in_set) for one in differences] == [
        ("P102.3", 2.0, 1.03),
        ("P103.1", 2.0, 5.0),
        ("P513", 1.0, 2.5),
    ]
    done = workshop.restore(dict(reversed(changed.items())))
    assert [one.reading.entry.name for one in done.written] == ["P102.3", "P103.1", "P513"]
    assert workshop.eeprom_writes == 3
    assert workshop.ledger.writes(("conveyor/fu1", "2066:03")) == 1
    assert not workshop.compare(changed).differences


def test_a_refusal_ends_it_and_says_what_was_done(workshop: Workshop) -> None:
    values: dict[str, Value] = {"P102.1": 1.0, "P104.1": 5.0, "P105.1": 60.0}
    workshop.ledger.restore({("conveyor/fu1", "2068:01"): Saved(100_000)}, 0.0, workshop.now)
    done = workshop.restore(values)
    assert [one.reading.entry.name for one in done.written] == ["P102.1"]
    assert (done.failed, done.left) == ("P104.1", ["P105.1"])
    assert "EEPROM endures 100000 writes" in str(done.error)


def test_a_drive_that_goes_away_ends_it(workshop: Workshop) -> None:
    workshop.node.presence[0] = Presence.LOST
    done = workshop.restore({"P102.1": 1.0})
    assert done.failed == "P102.1"
    assert done.error
    assert done.error.abort_code == 0x0606_0000


def test_what_this_drive_does_not_have_is_named_and_passed_over(workshop: Workshop) -> None:
    done = workshop.restore({"P999": 1, "P102.1": 1.0})
    assert done.missing == ["P999"]
    assert len(done.written) == 1
    assert workshop.compare({"P999": 1}).missing == ["P999"]


def test_a_name_that_there_is_not_stops_it_before_anything_is_written(workshop: Workshop) -> None:
    done = backups.Restored()
    values: dict[str, Value] = {"P102.1": 1.0, "P1O5": 1.0}
    error = workshop.run(lambda now: backups.restore(workshop.access, values, done, now))
    assert isinstance(error, ParameterError)
    assert workshop.eeprom_writes == 0


def test_a_file_is_read_as_it_was_written(tmp_path: Path, workshop: Workshop) -> None:
    values = {**workshop.back_up().values, 'a "name"\\': "über\n\t\x7f", "yes": True, "tiny": 1e-300}
    written = BackupFile("nord/sk-tu4-cao", "conveyor/fu1", "2026-11-21", values, {"P102.1": "s"}, ("P999",))
    path = tmp_path / "fu1.toml"
    path.write_text(written.text(), "utf-8")
    read = read_backup(path)
    assert read.values == values
    assert (read.mapping, read.drive, read.saved) == ("nord/sk-tu4-cao", "conveyor/fu1", "2026-11-21")


@pytest.mark.parametrize(
    ("text", "message"),
    [
        ("format = ", "is not TOML"),
        ("", "format: must be 1"),
        ("", "parameters: is missing"),
        ('format = 1\nmapping = "a"\n[parameters]\nP102 = [1]', 'parameters."P102": must be a number'),
        ('format = 1\nmapping = "a"\n[parameters]\nP102 = nan', 'parameters."P102": must be a number'),
    ],
)
def test_a_file_that_is_none_says_what_is_wrong(tmp_path: Path, text: str, message: str) -> None:
    path = tmp_path / "set.toml"
    path.write_text(text, "utf-8")
    with pytest.raises(FileFaults) as told:
        read_backup(path)
    assert message in str(told.value)


def _refusal(workshop: Workshop, values: dict[str, Value]) -> str:
    done = backups.Restored()
    error = workshop.run(lambda now: backups.restore(workshop.access, values, done, now))
    assert isinstance(error, ParameterError)
    assert workshop.eeprom_writes == 0
    return str(error)


def test_nothing_is_written_of_a_set_with_one_wrong_entry(workshop: Workshop) -> None:
    assert "P103.1" in _refusal(workshop, {"P102.1": 1.0, "P103.1": 999.0})
    assert "read-only" in _refusal(workshop, {"P102.1": 1.0, "P700[1]": 1})
    assert "commands the drive" in _refusal(workshop, {"P102.1": 1.0, "6040:00": 1})


def test_all_that_is_wrong_in_a_set_is_named_at_once(workshop: Workshop) -> None:
    values: dict[str, Value] = {"P102.1": 1.0, "P103.1": 999.0, "P700[1]": 1, "6040:00": 1}
    said = _refusal(workshop, values)
    assert all(name in said for name in ("P103.1", "P700[1]", "6040:00"))


def test_two_names_of_one_parameter_are_refused(workshop: Workshop) -> None:
    assert "P102 and 2066:01 are the same parameter" in _refusal(workshop, {"P102": 1.0, "2066:01": 3.0})


def test_a_command_is_in_no_set(workshop: Workshop) -> None:
    assert "no set holds it" in _refusal(workshop, {"P102.1": 1.0, "P152": 1})


def test_the_switch_of_the_eeprom_is_written_first_where_what_follows_is_to_be_kept(
    workshop: Workshop,
) -> None:
    workshop.restore({"P560": 0})
    done, access = workshop.restore({"P102.1": 1.0, "P560": 1}), workshop.access
    assert [one.reading.entry.name for one in done.written] == ["P560", "P102.1"]
    assert (access.writes(access.names.resolve("P102.1")), done.warning) == (1, "")


def test_a_restore_into_the_ram_alone_says_so(workshop: Workshop) -> None:
    workshop.restore({"P560": 0})
    assert "P560" in workshop.restore({"P102.1": 1.0}).warning


def test_the_nodes_own_parameters_are_in_the_set_of_its_first_drive_only() -> None:
    names = Names(NORD)
    first = {entry.name for entry in backups.settings(names)}
    second = {entry.name for entry in backups.settings(names, on_first=False)}
    assert first - second >= {"P151", "P150"}
    assert not any(name.startswith("P15") for name in second)


def test_an_object_that_no_file_lists_echoes_the_sign_that_was_written() -> None:
    access = DriveParameters("n/d", "n", NORD, Names(NORD), Ledger())
    steps = access.write(access.names.resolve("2FF0:00"), -5, 0.0)
    next(steps)
    steps.send((b"\x01\x00", 0.0))  # held; then P560
    steps.send((b"\x00\x00", 0.0))  # P560: RAM alone; then the write
    steps.send((b"", 0.0))
    with pytest.raises(StopIteration) as end:
        steps.send((b"\xfb\xff", 0.0))
    assert end.value.value.reading.value == -5
