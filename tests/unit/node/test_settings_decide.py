"""Whatever of a drive's settings decides what its process data mean, by its mapping file: where somebody
changes it at the keypad while the node runs, each point follows it or is not good, within 10 s and a look."""

from __future__ import annotations

import struct
from collections.abc import Iterator
from pathlib import Path
from typing import Any, Final, NamedTuple

import pytest

from bridge.canopen.datatypes import NUMBERS
from bridge.canopen.frame import Frame
from bridge.command import Drive
from bridge.config import load_site
from bridge.image import Quality, Reading
from bridge.mapping import Family, load_family
from bridge.mapping.model import ObjectRef, Parameter, ProcessValue
from bridge.sim.catalogue import SIMULATED, simulate_node
from tests.support.bench import Bench
from tests.support.slow_sdo import SlowSdo

SITE: Final = """
[site]
name = "bench"
[[bus]]
name = "can0"
interface = "virtual"
rpdo_period_ms = 100
deadman_ms = 500
[[bus.node]]
name = "it"
id = 5
mapping = "{mapping}"
supervision = "none"
[[bus.node.drive]]
slot = "{slot}"
name = "drive"
control = "modbus"
fieldbus_timeout_ms = 0
{parameters}
[modbus]
"""
BOUND_S: Final = 11.0
SLOW: Final = (
    "nord/sk-tu4-cao-posicon",
    "nord/sk-tu3-cao",
    "cia402/velocity",
    "lenze/8400-motec",
    "stoeber/5000",
)
"""One of each kind, whose SDO answers take 200 and 400 ms: within the time-out, 0.5 s."""
OTHER_MODE: Final = {1: 3, 2: 3, 3: 1, 6: 1, 8: 9, 9: 8}
NO_SUCH_CODE: Final = 55


def decided(family: Family) -> list[ProcessValue]:
    """The values of its first drive that its settings decide."""
    return [
        value
        for value in family.values_of(family.slot[0])
        if value.is_conditional or value.scaled_by or value.steady
    ]


DECIDED: Final = [name for name in SIMULATED if decided(load_family(name))]


def made(folder: Path, mapping: str, answer_s: float) -> Bench:
    family = load_family(mapping)
    given = [name for name in ("P112",) if any(name in one.scaled_by for one in family.value)]
    parameters = f"parameters = {{ {', '.join(f'{name} = 10.0' for name in given)} }}" if given else ""
    path = folder / "site.toml"
    text = SITE.format(mapping=mapping, slot=family.slot[0].name, parameters=parameters)
    path.write_text(text, encoding="utf-8")
    node = SlowSdo(simulate_node(mapping, 5, as_the_mapping_has_it(family)))
    bench = Bench(load_site(path), family=family, mapping=mapping, node=node)
    bench.run(4.0)
    node.answer_s = answer_s
    bench.run(2.0)
    return bench


def as_the_mapping_has_it(family: Family) -> dict[str, float]:
    """A POSICON drive positions."""
    return {"P600": 2.0} if any(value.needs for value in family.value) else {}


def at_keypad(bench: Bench, ref: ObjectRef, data: bytes) -> None:
    """By another hand than the bridge's: the bus sees nothing of it."""
    command = 0x23 | (4 - len(data)) << 2
    request = struct.pack("<BHB", command, ref.index, ref.sub) + data.ljust(4, b"\0")
    node: Any = bench.node
    inner = node.inner
    inner.on_frame(Frame(0x605, request), bench.now)
    answers = [frame for frame in inner.take_frames() if frame.can_id == 0x585]
    assert answers[-1].data[0] == 0x60, (ref, answers)


def drive(bench: Bench) -> Drive:
    return bench.plant.drives["it/drive"]


def point(bench: Bench, value: ProcessValue) -> Reading:
    return bench.plant.image.read(f"it/drive/{value.leaf}")


def encoded(parameter: Parameter, raw: float) -> bytes:
    return NUMBERS[parameter.data_type].encode(round(raw))


class Setting(NamedTuple):
    """One that decides a value in parameter set 1, where it is, and two that it may have."""

    name: str
    ref: ObjectRef
    other: bytes
    before: bytes
    value: ProcessValue


def settings(bench: Bench, value: ProcessValue) -> Iterator[Setting]:
    family = drive(bench).family
    conditions = drive(bench).channel.meanings.conditions
    for name in (*value.scaled_by, *value.when, *family.steady_of(value)):
        parameter = family.parameter_named(name)
        before = conditions.told((name, 1))
        assert before is not None, f"{name} has not been read"
        raw = before / parameter.factor
        other = 2 * raw if name in value.scaled_by else 0 if name == "P600" else raw + 1
        yield Setting(
            name, family.object_of(parameter), encoded(parameter, other), encoded(parameter, raw), value
        )
    if value.code:
        runs = family.meanings_of(family.slot[0], value.group)
        meaning = next(one for run in runs for one in run if one.default in value.code)
        kind = "int8" if meaning.parameter in ("6060", "6061") else "int16"
        for named in (one for one in family.parameter if one.name == meaning.parameter):
            kind = named.data_type
        other = OTHER_MODE[meaning.default] if kind == "int8" else NO_SUCH_CODE
        asked = ObjectRef(0x6060, 0) if kind == "int8" else family.object_of_meaning(meaning, 1)
        other = 10 if meaning.parameter == "C00007" else other
        number = NUMBERS[kind]
        yield Setting(meaning.parameter, asked, number.encode(other), number.encode(meaning.default), value)


def follows(bench: Bench, value: ProcessValue, name: str) -> bool:
    """The value is made with the setting that the drive has."""
    meanings = drive(bench).channel.meanings
    told = meanings.conditions.told((name, 1))
    scale = meanings.scales.get(value.leaf)
    if scale is None or name not in value.scaled_by or told is None:
        return False
    return (
        scale.full == told
        if name == value.full
        else scale.at == told * ((value.scale and value.scale.at) or 1)
    )


CASES: Final = [
    *((name, 0.005) for name in DECIDED),
    *((name, answer_s) for name in SLOW for answer_s in (0.2, 0.4)),
]


@pytest.mark.landing(8)
@pytest.mark.parametrize(("mapping", "answer_s"), CASES)
def test_a_change_is_found_whatever_decides_a_value(tmp_path: Path, mapping: str, answer_s: float) -> None:
    bench = made(tmp_path, mapping, answer_s)
    family = drive(bench).family
    usual = [one for one in decided(family) if not one.code or family.is_usual(family.slot[0], one)]
    assert usual and all_good(bench, usual)
    deciding = [one for value in usual for one in settings(bench, value)]
    scaling = {name for value in usual for name in (*value.scaled_by, *family.steady_of(value))}
    for of_scale in (True, False):
        changed = [one for one in deciding if (one.name in scaling) is of_scale]
        bench.events.clear()
        for one in changed:
            at_keypad(bench, one.ref, one.other)
        bench.run(BOUND_S)
        for one in changed:
            reading = point(bench, one.value)
            is_true = reading.quality is not Quality.GOOD or follows(bench, one.value, one.name)
            assert is_true, (one.name, one.value.leaf)
            names = tuple(other.name for other in deciding if other.value is one.value)
            is_told = any(event.message.startswith(names) for event in bench.events)
            assert is_told or reading.quality is Quality.STALE, (names, "changed and nobody says so")
        for one in changed:
            at_keypad(bench, one.ref, one.before)
        bench.run(BOUND_S if answer_s < 0.1 else 3 * BOUND_S)
        assert all_good(bench, usual)


def all_good(bench: Bench, values: list[ProcessValue]) -> bool:
    bad = {one.leaf: point(bench, one) for one in values}
    bad = {leaf: reading for leaf, reading in bad.items() if reading.quality is not Quality.GOOD}
    assert not bad
    return True


class RefusingSdo(SlowSdo):
    """Each answer is an abort while it ``refuses``: general error, or another one that has nothing to do
    with the object."""

    refuses = False

    def take_frames(self) -> list[Frame]:
        frames = super().take_frames()
        return [self._refused(one) if self.refuses and one.can_id == 0x585 else one for one in frames]

    def _refused(self, frame: Frame) -> Frame:
        return frame._replace(data=b"\x80" + frame.data[1:4] + bytes.fromhex("00000008"))


@pytest.mark.landing(4)
@pytest.mark.parametrize("mapping", SLOW)
def test_what_a_drive_has_told_and_refuses_to_tell_again_is_in_doubt(tmp_path: Path, mapping: str) -> None:
    """It has the object: nothing that is assumed of drives without it counts, nor what it told last."""
    bench = made(tmp_path, mapping, 0.005)
    family = drive(bench).family
    usual = [one for one in decided(family) if not one.code or family.is_usual(family.slot[0], one)]
    scaling = {name for value in usual for name in (*value.scaled_by, *family.steady_of(value))}
    changed = [one for value in usual for one in settings(bench, value) if one.name in scaling]
    inner: Any = bench.node
    node = bench.node = RefusingSdo(inner.inner)
    node.refuses = True
    for one in changed:
        at_keypad(bench, one.ref, one.other)
    bench.run(BOUND_S)
    assert not [one for one in changed if point(bench, one.value).quality is Quality.GOOD]
    node.refuses = False
    bench.run(2.0)
    read = [
        one for one in changed if one.name in one.value.scaled_by and family.parameter_named(one.name).read
    ]
    assert all(follows(bench, one.value, one.name) for one in read)
    for one in changed:
        at_keypad(bench, one.ref, one.before)
    bench.run(BOUND_S)
    assert all_good(bench, usual)
