"""Input registers 21 … 23: which words and values are not good, for every family, however its words are
spread over TPDOs, and in every order in which these come, stop and come again. The image, from which the
other protocols read, says the same."""

from __future__ import annotations

import struct
from collections.abc import Sequence
from pathlib import Path

import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from bridge.command import Plant
from bridge.command.drive_link import FurtherTpdo, NodeState
from bridge.image import Quality
from bridge.mapping import family_names
from bridge.mapping.model import ProcessValue
from bridge.northbound.modbus.units import drive_maps
from tests.support import sites
from tests.support.invented import SPIN, spin_bench, spindle
from tests.support.modbus_site import PLC
from tests.support.nightly import examples
from tests.support.node_states import node_goes, run_timers
from tests.support.views import dispatcher_of

UNIT = 1
DEADLINE_S = 0.1


def words_of(mapping: str) -> list[str]:
    family = sites.family(mapping)
    return family.carried(family.slot[0])[1]


class Reader:
    """Registers of unit 1 as a PLC reads them."""

    def __init__(self, plant: Plant, clock: list[float]) -> None:
        self._dispatcher = dispatcher_of(plant, lambda: clock[0])
        self.map = drive_maps(plant.catalogue)[UNIT - 1]

    def read(self, start: int, count: int) -> list[int]:
        """The registers, or -code where the read was refused."""
        answers: list[bytes] = []
        self._dispatcher.handle(UNIT, struct.pack(">BHH", 4, start, count), PLC, answers.append)
        (answer,) = answers
        if answer[0] & 0x80:
            return [-answer[1]]
        return list(struct.unpack(f">{count}H", answer[2:]))

    def bad_words(self) -> set[int]:
        (bits,) = self.read(21, 1)
        return {place for place in range(1, 17) if bits >> place - 1 & 1}

    def bad_rows(self) -> set[str]:
        high, low = self.read(22, 2)
        bits = high << 16 | low
        return {row.name for place, row in enumerate(self.map.inputs[:32]) if bits >> place & 1}


class Model:
    """One drive whose words come by a TPDO with the status word and by others; what is good of it."""

    def __init__(self, mapping: str, spread: Sequence[int], deadlines: Sequence[float | None]) -> None:
        family = sites.family(mapping)
        slot = family.slot[0].name
        scaled = sorted({name for value in family.value for name in value.scaled_by})
        parameters = "parameters = {{ {} }}".format(", ".join(f'"{name}" = 50.0' for name in scaled))
        drive = sites.drive(slot, "modbus", 200, f"unit_id = {UNIT}\ntelegram_downtime_s = 0\n{parameters}")
        self.plant = sites.plant_of(sites.site(sites.bus(sites.node(drive, mapping=mapping))), mapping)
        (self.drive,) = self.plant.drives.values()
        self.clock = [100.0]
        self.reader = Reader(self.plant, self.clock)
        process = family.process.tpdo
        words = words_of(mapping)[1:]
        self.home = dict(zip(words, spread, strict=False))
        """0: beside the status word; n: the further TPDO n."""
        self.places = {word: process.index(word) for word in words}
        self.further = [
            FurtherTpdo(
                f"TPDO{n + 1}",
                frozenset(self.places[word] for word in words if self.home.get(word, 0) == n),
                deadline_s,
            )
            for n, deadline_s in enumerate(deadlines, 1)
        ]
        self.telling = {
            process.index(word): meaning.default
            for meaning in family.meaning
            if meaning.group == "actual" and (word := family.told_by(family.slot[0], meaning))
        }
        """Words that tell what others mean, as the mapping takes them to do."""
        self.came: dict[int, float] = {}
        node_goes(self.plant, self.plant.nodes["conveyor"], NodeState.OPERATIONAL, self.now)
        self.drive.on_pdos({}, self.further, self.now, deadline_s=DEADLINE_S, rpdo_type=255)

    @property
    def now(self) -> float:
        return self.clock[0]

    def step(self, step: str | int | float) -> None:
        if isinstance(step, float):
            self.clock[0] += step
            run_timers(self.plant, self.now)
        elif step == 0:
            self.came[0] = self.now
            words = [self.telling.get(place, word) for place, word in enumerate(self.drive.words)]
            self.drive.on_process_data(words, self.now)
        elif step in range(1, len(self.further) + 1):
            self.came[int(step)] = self.now
            self.drive.on_further_data(self.further[int(step) - 1], self.now)

    def comes(self, number: int) -> bool:
        deadline_s = DEADLINE_S if number == 0 else self.further[number - 1].deadline_s
        came = self.came.get(number)
        return came is not None and (deadline_s is None or self.now < came + deadline_s)

    def is_good(self, word: str) -> bool:
        return self.comes(0) and self.comes(self.home.get(word, 0))

    def words_of(self, value: ProcessValue) -> tuple[str, ...]:
        """Words of a value by the codes that the mapping file takes for them; none where these do not carry
        the value."""
        if not value.code:
            return value.word_names
        runs = self.drive.family.meanings_of(self.drive.slot, value.group)
        by_code = {one.default: one.word for run in runs for one in reversed(run)}
        return tuple(by_code[code] for code in value.code) if by_code.keys() >= set(value.code) else ()

    def check(self) -> None:
        family, slot = self.drive.family, self.drive.slot
        bad = {place for word, place in self.places.items() if not self.is_good(word)}
        assert self.reader.bad_words() == bad
        values = [value for value in family.values_of(slot) if value.group == "actual"]
        bad_values = {
            value.leaf
            for value in values
            if not self.comes(0)
            or not all(self.is_good(word) for word in self.words_of(value) if word in self.places)
            or (value.code and not self.words_of(value))
        }
        rows = self.reader.bad_rows()
        assert {name for name in rows if name.startswith("actual/")} == bad_values & self.first_rows
        self.plant.refresh(self.now)  # what the others see is judged a few times a second
        image, name = self.plant.image, self.drive.name
        for leaf in [f"actual/{word}" for word in self.places] + [value.leaf for value in values]:
            is_bad = leaf in bad_values or self.places.get(leaf.removeprefix("actual/")) in bad
            assert (image.read(f"{name}/{leaf}").quality is not Quality.GOOD) == is_bad, leaf
        for row in self.reader.map.inputs[:32]:
            is_bad = image.read(f"{name}/{row.name}").quality is not Quality.GOOD
            assert (row.name in self.reader.bad_rows()) == is_bad, row.name

    @property
    def first_rows(self) -> set[str]:
        return {row.name for row in self.reader.map.inputs[:32]}


STEPS = st.one_of(st.integers(0, 3), st.sampled_from((0.01, 0.06, 0.11)))


@pytest.mark.landing(6)
@pytest.mark.parametrize("mapping", family_names())
@settings(max_examples=examples(15))
@given(
    spread=st.lists(st.integers(0, 3), min_size=8, max_size=8),
    deadlines=st.lists(st.sampled_from((None, DEADLINE_S)), min_size=3, max_size=3),
    steps=st.lists(STEPS, min_size=1, max_size=25),
)
def test_what_is_not_good_is_said_in_every_case(
    mapping: str, spread: list[int], deadlines: list[float | None], steps: list[int | float]
) -> None:
    model = Model(mapping, spread, deadlines)
    model.check()
    for step in steps:
        model.step(step)
        model.check()


# by the way that a bus has


class OnTheBus:
    """The spindle: TPDO1 status word and speed, TPDO2 (every 100 ms) position and modes, TPDO3 inputs."""

    POSITION, SPEED = {2, 3, 4}, {1}

    def __init__(self, folder: Path, node: str = "", mapping: str = SPIN) -> None:
        self.node = spindle()
        self.bench = spin_bench(folder, self.node, mapping=mapping, table=node)
        self.clock = [self.bench.now]
        self.reader = Reader(self.bench.plant, self.clock)

    def run(self, seconds: float) -> None:
        self.bench.run(seconds)
        self.clock[0] = self.bench.now

    def bad(self) -> set[int]:
        return self.reader.bad_words()


def test_what_never_came_reads_0_is_not_good_and_alone_is_refused(tmp_path: Path) -> None:
    spin = OnTheBus(tmp_path)
    spin.bench.deaf_to = frozenset((0x289,))
    spin.run(1.0)
    assert spin.bad() >= spin.POSITION and not spin.SPEED & spin.bad()
    assert spin.reader.read(0, 9)[2:5] == [0, 0, 0]
    assert spin.reader.read(2, 3) == [-0x0B]
    assert len(spin.reader.read(1, 2)) == 2
    assert "actual/position" in spin.reader.bad_rows()
    assert "actual/speed" not in spin.reader.bad_rows()


def test_what_has_stopped_is_served_and_not_good_until_it_comes_again(tmp_path: Path) -> None:
    spin = OnTheBus(tmp_path)
    spin.run(1.0)
    spin.node.put("6064:00", 4, 7)
    spin.run(0.2)
    assert not spin.POSITION & spin.bad()
    spin.node.put("1801:05", 2, 0)  # its event timer stops
    spin.run(0.5)
    assert spin.bad() >= spin.POSITION and not spin.SPEED & spin.bad()
    assert spin.reader.read(2, 1) == [7]
    spin.node.put("6064:00", 4, 8)
    spin.run(0.1)
    assert not spin.POSITION & spin.bad()


def test_a_word_that_the_node_does_not_carry_is_not_good(tmp_path: Path) -> None:
    spin = OnTheBus(tmp_path)
    spin.run(1.0)
    assert spin.bad() == {5}, "the optional TPDO3 is off"


def test_after_a_restart_the_old_words_are_gone(tmp_path: Path) -> None:
    spin = OnTheBus(tmp_path)
    spin.node.put("6064:00", 4, 7)
    spin.run(1.0)
    assert spin.reader.read(2, 1) == [7]
    spin.bench.deaf_to = frozenset((0x289,))
    spin.node.start(spin.bench.now)
    spin.run(1.0)
    assert spin.bad() >= spin.POSITION and not spin.SPEED & spin.bad()
    assert spin.reader.read(0, 3)[2] == 0


def test_what_comes_with_changes_alone_has_to_come_again_when_the_node_is_heard_again(tmp_path: Path) -> None:
    """on_loss = "nothing": the node goes on without a boot-up, and may have said something meanwhile."""
    mapping = SPIN.replace("event_ms = 100", "event_ms = 0")
    spin = OnTheBus(tmp_path, 'on_loss = "nothing"', mapping)
    spin.run(1.0)
    spin.node.put("6064:00", 4, 7)
    spin.run(0.1)
    assert not spin.POSITION & spin.bad()
    spin.bench.cut = True
    spin.run(1.0)
    assert spin.bench.value("spindle/node/supervision_state") == "heartbeat: lost"
    spin.bench.cut = False
    spin.run(1.0)
    assert spin.bench.value("spindle/node/boot_status") == "ok; heard again"
    assert spin.bad() >= spin.POSITION and not spin.SPEED & spin.bad()
    spin.node.put("6064:00", 4, 8)
    spin.run(0.1)
    assert not spin.POSITION & spin.bad()
