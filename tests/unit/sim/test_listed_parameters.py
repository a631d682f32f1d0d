"""Parameters of a mapping in its simulator: each is there, of the type that the mapping gives it."""

from __future__ import annotations

import pytest

from bridge.canopen.datatypes import encode
from bridge.mapping import load_family
from bridge.parameter import Names
from bridge.sim.catalogue import simulate_node
from tests.unit.sim.conftest import Bench

NORD_DRIVE = ["P514", "P515[1]", "P515[3]", "P740[1]", "P740[6]", "P741[1]", "P741[6]", "P744", "P748"]
LENZE = [f"C00409/{n}" for n in range(1, 9)]
STOEBER = [
    "A200 A201 A203 A204 A207 A208 A210 A211 A212 A237 A238 A239 A240 A241 A242 A243 A244 E39 E43 E52",
    *(f"A{n}.{element}" for n in (218, 219, 220) for element in range(3)),
    *(f"A{n}.{element}" for n in range(221, 225) for element in range(2)),
    *(f"A{n}.{element}" for n in range(229, 233) for element in range(4)),
    *(f"A{n}.{element}" for n in (*range(225, 229), *range(233, 237)) for element in range(6)),
]
TEXTS = {"E50": "MDS 5", "E51": "V 5.6-H", "E149": "SIM"}


@pytest.mark.parametrize(
    ("mapping", "names"),
    [
        ("nord/sk-tu4-cao", NORD_DRIVE),
        ("nord/sk-tu3-cao", [*NORD_DRIVE, "P745", "P746"]),
        ("nord/sk-54xe-rj45", NORD_DRIVE),
        ("lenze/8400-motec", LENZE),
        ("stoeber/5000", " ".join(STOEBER).split()),
        ("stoeber/5000-four-axes", " ".join(STOEBER).split()),
    ],
)
def test_it_is_answered_with_its_own_length(mapping: str, names: list[str]) -> None:
    known, bench = Names(load_family(mapping)), Bench(simulate_node(mapping, 5, {}))
    bench.run(1.0)
    for name in names:
        entry = known.resolve(name)
        assert entry.definition is not None, name
        low, high = entry.address.index & 0xFF, entry.address.index >> 8
        answer = bytes.fromhex(bench.sdo(f"40{low:02x}{high:02x}{entry.address.sub:02x}00000000"))
        assert answer[0] & 0xE3 == 0x43, (name, answer.hex())
        assert 4 - (answer[0] >> 2 & 3) == len(encode(entry.definition.data_type, 0)), name


@pytest.mark.parametrize("name", TEXTS)
def test_a_stoeber_tells_who_it_is_by_its_coordinates(name: str) -> None:
    """ID 441684.06 §11.1: E50 is 1008h, E51 100Ah, E149 1009h."""
    entry = Names(load_family("stoeber/5000")).resolve(name)
    node = simulate_node("stoeber/5000", 5, {})
    text = node.slave._dictionary.find(entry.address.index, entry.address.sub).upload()
    assert text.decode().startswith(TEXTS[name])


def test_a_nord_shows_the_process_data_as_it_has_them() -> None:
    """BU 2500 §7.2: P740 and P741, in whatever parameter set; nothing where P509 is 0."""
    bench = Bench()
    bench.nmt(1)
    bench.run(1.0)
    bench.command(0x047E, 0x1234)
    assert (bench.read(0x22E4, 1), bench.read(0x22E4, 5)) == (0x047E, 0x1234)
    assert bench.read(0x22E5, 1) & 0x6F == 0x21
    bench.node.drives[0].parameters.commission(509, 0)
    assert bench.read(0x22E4, 1) == 0
