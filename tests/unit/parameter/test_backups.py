"""Backups of parameters: what was backed up can be restored, and whatever ends it is told.

The command line's task with the simulated NORD interface, on a virtual clock.
"""

from __future__ import annotations

from collections.abc import Callable, Generator
from pathlib import Path

import pytest

from bridge.base.errors import FileFaults
from bridge.bustools.parameter import ParameterTask
from bridge.canopen import abort
from bridge.config import NodeTable
from bridge.image import Value
from bridge.mapping import load_family
from bridge.node.parameters.run import Procedure
from bridge.parameter import (
    DriveParameters,
    Ledger,
    Names,
    ObjectRef,
    ParameterError,
    Transfer,
    TransferFailed,
    Why,
    backups,
)
from bridge.parameter.backup_file import BackupFile, read_backup
from bridge.parameter.ledger import WriteRecord
from bridge.sim.nord.nord_supervision import Presence
from bridge.sim.nord.nord_tu4 import NordTu4
from bridge.text import Text
from tests.support.gates import ENGINEER_AT_REST

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
        task = ParameterTask(NODE, NORD, NORD.slot_named("fu1"), make, self.now)
        for _ in range(20_000):
            for frame in task.take_frames():
                self.node.on_frame(frame, self.now)
            self.node.on_time(self.now)
            for frame in self.node.take_frames():
                task.on_frame(frame._replace(time=self.now))
            task.on_time(self.now)
            if task.is_finished(self.now):
                return task.result
            self.now += 0.001
        raise AssertionError("the task does not end")

    def back_up(self) -> backups.Backup:
        found = backups.Backup()
        assert self.run(lambda now: backups.back_up(self.access, found, now)) is None
        return found

    def restore(self, values: dict[str, Value]) -> backups.Restored:
        self.access.forget()
        done = backups.Restored()
        assert self.run(lambda now: backups.restore(self.access, values, done, now, ENGINEER_AT_REST)) is None
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
    assert found.values["P543[2].4"] == 3
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
    workshop.ledger.restore({("conveyor/fu1", "2068:01"): WriteRecord(100_000)}, 0.0, workshop.now)
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
    error = workshop.run(lambda now: backups.restore(workshop.access, values, done, now, ENGINEER_AT_REST))
    assert isinstance(error, ParameterError)
    assert workshop.eeprom_writes == 0


def test_a_file_is_read_as_it_was_written(tmp_path: Path, workshop: Workshop) -> None:
    values = {**workshop.back_up().values, 'a "name"\\': "über\n\t\x7f", "yes": True, "tiny": 1e-300}
    written = BackupFile(
        "nord/sk-tu4-cao",
        "conveyor/fu1",
        "2026-11-21",
        values,
        {"P102.1": "s"},
        ("P999",),
        {"vendor": 0x38, "serial": 7},
        {"P203": 11, "P220.2": "text"},
        {"P240": "a line\nand another"},
    )
    path = tmp_path / "fu1.toml"
    path.write_text(written.text(), "utf-8")
    read = read_backup(path)
    assert read.values == values
    assert (read.identity, read.objects) == (written.identity, written.objects)
    assert (read.mapping, read.drive, read.saved) == ("nord/sk-tu4-cao", "conveyor/fu1", "2026-11-21")


def test_a_file_that_breaks_off_anywhere_is_refused(tmp_path: Path) -> None:
    path = tmp_path / "set.toml"
    values: dict[str, Value] = {"P102.1": 12.5, "P103.1": 2.0}
    written = BackupFile("nord/sk-tu4-cao", "conveyor/fu1", "2026-11-21", values, {}, objects={"2203:01": 11})
    text = written.text()
    for end in range(len(text)):
        path.write_text(text[:end], "utf-8")
        with pytest.raises(FileFaults):
            read_backup(path)
    path.write_text(text[: text.index("12.") + 2], "utf-8")
    with pytest.raises(FileFaults, match=r"set.toml:8: the file ends within this line"):
        read_backup(path)
    path.write_text(text[: text.index('"P103.1"')], "utf-8")
    with pytest.raises(FileFaults, match=r"set.toml:8: the file ends before its last line"):
        read_backup(path)


def test_a_file_may_be_changed_by_hand_and_one_of_an_older_format_is_read(tmp_path: Path) -> None:
    path = tmp_path / "set.toml"
    values: dict[str, Value] = {"P102.1": 12.5, "P103.1": 2.0}
    text = BackupFile("nord/sk-tu4-cao", "conveyor/fu1", "2026-11-21", values, {}).text()
    path.write_text(text.replace('"P103.1" = 2.0\n', "") + "\n# checked by ann\n", "utf-8")
    assert read_backup(path).values == {"P102.1": 12.5}
    older = "".join(line for line in text.splitlines(keepends=True) if "End of the backup" not in line)
    path.write_text(older.replace("format = 3", "format = 2"), "utf-8")
    assert read_backup(path).values == values


@pytest.mark.parametrize(
    ("text", "message"),
    [
        ("format = ", "is not TOML"),
        ("", "format: must be 3"),
        ("format = 4", "format: must be 3"),
        ('format = 2\nmapping = "a"\n[parameters]\n[objects]\nP1 = []', 'objects."P1": must be a number'),
        ('format = 2\nmapping = "a"\n[parameters]\nP1 = 1\n[objects]\nP1 = 2', "stands in [parameters], too"),
        ('format = 2\nmapping = "a"\n[parameters]\n[identity]\nserial = "x"', "identity.serial: must be"),
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


@pytest.mark.parametrize(
    ("content", "told"),
    [
        (b'format = 2\nmapping = "a"\n[parameters]\nP1 = 1\nP2 = 2\nP1 = 3\n', ":6: is not TOML"),
        (b'format = 2\nmapping = "a"\n[parameters]\n# \xdcberlast\n', ":4: is not UTF-8 (save it as UTF-8)"),
        (b'format = 2\nmapping = "a"\n[parameters]\nP1 = 1\nP2 = [2]\n', ':5: parameters."P2": must be'),
        (b'mapping = "a"\nformat = 7\n[parameters]\n', ":2: format: must be"),
    ],
)
def test_each_fault_has_its_line(tmp_path: Path, content: bytes, told: str) -> None:
    path = tmp_path / "set.toml"
    path.write_bytes(content)
    with pytest.raises(FileFaults) as refused:
        read_backup(path)
    assert str(refused.value).startswith(f"{path}{told}")


def test_a_file_with_other_line_ends_is_read(tmp_path: Path) -> None:
    path = tmp_path / "set.toml"
    values: dict[str, Value] = {"P102.1": 12.5}
    text = BackupFile("nord/sk-tu4-cao", "conveyor/fu1", "2026-11-21", values, {}).text()
    path.write_bytes(b"\xef\xbb\xbf" + text.replace("\n", "\r\n").encode())
    assert read_backup(path).values == values


def _refusal(workshop: Workshop, values: dict[str, Value]) -> str:
    done = backups.Restored()
    error = workshop.run(lambda now: backups.restore(workshop.access, values, done, now, ENGINEER_AT_REST))
    assert isinstance(error, ParameterError)
    assert workshop.eeprom_writes == 0
    return str(error)


def test_nothing_is_written_of_a_set_with_one_wrong_entry(workshop: Workshop) -> None:
    assert "P103.1" in _refusal(workshop, {"P102.1": 1.0, "P103.1": 999.0})
    assert "read-only" in _refusal(workshop, {"P102.1": 1.0, "P700[1]": 1})
    assert "commands the drive" in _refusal(workshop, {"P102.1": 1.0, "6040:00": 1})


@pytest.mark.landing
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
    assert first - second >= {"P151", "P154[1]"}
    assert not any(name.startswith("P15") for name in second)


def test_an_object_that_no_file_lists_echoes_the_sign_that_was_written() -> None:
    access = DriveParameters("n/d", "n", NORD, Names(NORD), Ledger())
    steps = access.write(access.names.resolve("2FF0:00"), -5, 0.0, ENGINEER_AT_REST)
    next(steps)
    steps.send((b"\x01\x00", 0.0))  # held; then P560
    steps.send((b"\x00\x00", 0.0))  # P560: RAM alone; then the write
    steps.send((b"", 0.0))
    with pytest.raises(StopIteration) as end:
        steps.send((b"\xfb\xff", 0.0))
    assert end.value.value.reading.value == -5


class AnyDrive:
    """Answers a procedure as a drive with these objects does: bytes, or the abort code that it refuses with.
    It falls silent after ``answers`` of them."""

    def __init__(self, objects: dict[tuple[int, int], bytes | int], answers: int = 100_000) -> None:
        self.objects, self.answers = objects, answers
        self.written: dict[tuple[int, int], bytes] = {}

    def run(self, steps: Generator[Transfer, tuple[bytes, float], None]) -> ParameterError | None:
        try:
            transfer = next(steps)
            while True:
                try:
                    answer = self._answer(transfer)
                except TransferFailed as failure:
                    transfer = steps.throw(failure)
                else:
                    transfer = steps.send((answer, 0.0))
        except StopIteration:
            return None
        except ParameterError as error:
            return error

    def _answer(self, transfer: Transfer) -> bytes:
        self.answers -= 1
        if self.answers < 0:
            raise TransferFailed(Text.plain("no valid answer"), abort.TIMED_OUT, by_drive=False)
        place = (transfer.address.index, transfer.address.sub)
        is_there = any(index == place[0] for index, _ in self.objects)
        held = self.objects.get(place, 0x0609_0011 if is_there else 0x0602_0000)
        if isinstance(held, int):
            raise TransferFailed(Text.plain("the node aborted"), held, by_drive=True)
        if transfer.data is not None:
            if place in READ_ONLY:
                raise TransferFailed(Text.plain("the node aborted"), 0x0601_0002, by_drive=True)
            self.written[place] = self.objects[place] = transfer.data
        return held


READ_ONLY = {(0x20C9, 0)}
MOTOR = {
    (0x20C8, 0): b"\x07\0",  # P200, a plain one
    (0x20C9, 0): b"\x01\0\0\0",  # P201, which the drive does not let be written
    (0x20CB, 0): b"\x04",  # P203 in four sets; the first says how many
    **{(0x20CB, number): bytes((10 * number, 0)) for number in range(1, 5)},
    (0x20CC, 1): b"\x01\0",  # P204, an array without sets
    (0x20CC, 5): b"\x02\0",
    (0x20CD, 0): 0x0601_0001,  # P205 can only be written
    (0x20CE, 0): b"\x01\x02\x03",  # P206 is no number of any length that there is
    (0x2066, 1): b"\x64\0",  # P102 is listed
}
FOUND = {"P200": 7, "P201": 1, "P203.1": 10, "P203.2": 20, "P203.3": 30, "P203.4": 40}
FOUND |= {"P204.1": 1, "P204[2].1": 2}


def _access() -> DriveParameters:
    return DriveParameters("conveyor/fu1", "conveyor", NORD, Names(NORD), Ledger())


def test_a_scan_finds_what_the_mapping_file_does_not_list_under_the_makers_names() -> None:
    found = backups.Backup()
    assert AnyDrive(dict(MOTOR)).run(backups.scan(_access(), found, 0.0)) is None
    assert found.objects == FOUND
    assert found.unreadable == {
        "P205": "attempt to read a write-only object (06010001h)",
        "P206": "is neither a number nor a text",
    }
    names = Names(NORD)
    assert all(names.resolve(name).name == name for name in (*found.objects, *found.unreadable))


@pytest.mark.landing(3)
@pytest.mark.parametrize("answers", [0, 1, 350, 400, 500, 520, 540])
def test_a_scan_that_broke_off_goes_on_where_it_was(answers: int) -> None:
    found, access = backups.Backup(), _access()
    error = AnyDrive(dict(MOTOR), answers).run(backups.scan(access, found, 0.0))
    assert error is None or error.why is Why.NO_ANSWER
    assert AnyDrive(dict(MOTOR)).run(backups.scan(access, found, 0.0)) is None
    assert found.objects == FOUND


def test_a_value_that_the_drive_refuses_costs_a_backup_that_value_alone() -> None:
    names, found = Names(NORD), backups.Backup()
    objects: dict[tuple[int, int], bytes | int] = {
        (entry.address.index, entry.address.sub): b"\x01\0\0\0" for entry in backups.settings(names)
    }
    objects[0x2066, 2] = 0x0606_0000
    assert AnyDrive(objects).run(backups.back_up(_access(), found, 0.0)) is None
    assert found.unreadable == {"P102.2": "access failed due to a hardware error (06060000h)"}
    assert len(found.values) == len(backups.settings(names)) - 1


def test_what_was_scanned_is_restored_where_it_differs_and_what_is_read_only_is_named() -> None:
    drive, done = AnyDrive(dict(MOTOR)), backups.Restored()
    values: dict[str, Value] = {**FOUND, "P203.2": 25, "P201": 2, "P102.1": 1.0}
    assert drive.run(backups.restore(_access(), values, done, 0.0, ENGINEER_AT_REST)) is None
    assert drive.written == {(0x20CB, 2): b"\x19\0"}
    assert (done.read_only, done.error) == (["P201"], None)


def test_a_restore_that_broke_off_goes_on_and_writes_nothing_twice() -> None:
    objects, done, access = dict(MOTOR), backups.Restored(), _access()
    values: dict[str, Value] = {"P200": 8, "P203.1": 11, "P203.2": 21}
    # read P200, read P560, write, read back: four answers each
    AnyDrive(objects, 5).run(backups.restore(access, values, done, 0.0, ENGINEER_AT_REST))
    assert done.error
    assert done.error.why is Why.NO_ANSWER
    again = AnyDrive(objects)
    access.forget()
    assert again.run(backups.restore(access, values, done, 0.0, ENGINEER_AT_REST)) is None
    assert (done.error, done.same) == (None, [])
    assert [one.reading.entry.name for one in done.written] == ["P200", "P203.1", "P203.2"]
    assert again.written.keys() == {(0x20CB, 1), (0x20CB, 2)}


def test_the_makers_name_is_found_for_an_object_of_every_family() -> None:
    for family, place, name in (
        ("nord/sk-tu4-cao", "20CB:03", "P203.3"),
        ("nord/sk-tu4-cao", "1018:01", "1018:01"),
        ("lenze/8400-motec", "5FF4:00", "C00011"),
        ("lenze/8400-motec", "5FD8:01", "C00039/1"),
        ("stoeber/5000", "2401:00", "C01"),
    ):
        names = Names(load_family(family))
        index, _, sub = place.partition(":")
        assert names.at(ObjectRef(int(index, 16), int(sub, 16))).name == name


def test_every_name_that_a_scan_gives_leads_back_to_its_object() -> None:
    names = Names(NORD)
    for index in names.settings:
        for sub in range(17):
            place = ObjectRef(index, sub)
            assert names.resolve(names.at(place).name).address == place
    assert names.at(ObjectRef(0x2078, 2)).name == "2078:02", "P120 has no parameter sets"


def test_another_device_that_answers_after_a_break_is_noticed(workshop: Workshop) -> None:
    identity: dict[str, int] = {}
    assert workshop.run(lambda now: backups.identify(identity)) is None
    assert {"vendor", "product"} <= identity.keys()
    assert workshop.run(lambda now: backups.identify(identity)) is None
    identity["serial"] = 99
    assert "another device" in str(workshop.run(lambda now: backups.identify(identity)))


def test_two_sets_are_compared_without_a_drive() -> None:
    found = backups.Comparison()
    one: dict[str, Value] = {"P102.1": 2.0, "P200": 7, "P560": 1}
    backups.compare_sets(Names(NORD), one, {**one, "P102.1": 2.5, "P513": 1.0}, found)
    assert [(one.entry.name, one.in_drive, one.in_set) for one in found.differences] == [("P102.1", 2.0, 2.5)]
    assert (found.missing, len(found.same)) == (["P513"], 2)


def test_what_a_device_file_describes_is_read_once_and_what_is_refused_is_named() -> None:
    found = backups.Backup()
    places = [ObjectRef(*place) for place in ((0x2066, 1), (0x20C8, 0), (0x20CD, 0), (0x2FFF, 0))]
    drive = AnyDrive(dict(MOTOR))
    for _ in range(2):
        assert drive.run(backups.read_objects(_access(), places, found, 0.0)) is None
    assert (found.objects, found.missing) == ({"P200": 7}, ["2FFF:00"])
    assert list(found.unreadable) == ["P205"]


def test_a_drive_that_never_answers_is_not_taken_for_one_that_goes_on() -> None:
    found, access, drive = backups.Backup(), _access(), AnyDrive(dict(MOTOR), answers=0)
    for _ in range(5):
        assert drive.run(backups.back_up(access, found, 0.0))
    assert (found.answers, len(found.unreadable)) == (0, 4)


def test_what_the_drive_is_silent_about_twice_holds_up_nothing() -> None:
    found, access = backups.Backup(), _access()

    class Silent(AnyDrive):
        def _answer(self, transfer: Transfer) -> bytes:
            if (transfer.address.index, transfer.address.sub) == (0x20C8, 0):
                raise TransferFailed(Text.plain("no valid answer"), abort.TIMED_OUT, by_drive=False)
            return super()._answer(transfer)

    drive = Silent(dict(MOTOR))
    error = drive.run(backups.scan(access, found, 0.0))
    assert error
    assert error.why is Why.NO_ANSWER
    assert drive.run(backups.scan(access, found, 0.0)) is None
    assert found.unreadable["P200"] == "no answer, twice"
    assert found.objects == {name: value for name, value in FOUND.items() if name != "P200"}
