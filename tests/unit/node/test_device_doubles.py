"""An object that two TPDOs of a node carry, as CiA 406 has it for positions."""

from __future__ import annotations

from pathlib import Path

import pytest

from bridge.image import Quality
from tests.support.bench import Bench
from tests.support.devices import device_bench, encoder
from tests.support.pdo_node import PdoNode


def bench_with(folder: Path, node: PdoNode) -> Bench:
    bench = device_bench(folder, node)
    bench.run(1.0)
    return bench


def doubled(transmission_type: int, event_ms: int = 0) -> PdoNode:
    """The encoder, whose TPDO3 carries the position, too."""
    node = encoder()
    node.pdo("tpdo", 3, 0x380, ["6004:00/32"], event_ms=event_ms)
    node.put("1802:02", 1, transmission_type)
    return node


@pytest.mark.parametrize(
    ("transmission_type", "event_ms"),
    [pytest.param(255, 0, id="on change"), pytest.param(0, 0, id="with a SYNC after a change")],
)
def test_it_is_shown_by_the_one_that_comes_regularly(
    tmp_path: Path, transmission_type: int, event_ms: int
) -> None:
    bench = bench_with(tmp_path, doubled(transmission_type, event_ms))
    bench.deaf_to = frozenset({0x380 + 20})
    bench.run(1.0)
    assert bench.plant.image.read("shaft/input/position").quality is Quality.GOOD
    assert bench.number("shaft/node/pdo_age_ms") <= 100
    bench.deaf_to = frozenset({0x180 + 20})
    bench.run(1.0)
    position = bench.plant.image.read("shaft/input/position")
    assert (position.quality, position.reason) == (Quality.STALE, "no TPDO1 from the node")


def test_of_two_that_come_regularly_the_faster_one_counts(tmp_path: Path) -> None:
    bench = bench_with(tmp_path, doubled(255, 20))
    bench.deaf_to = frozenset({0x180 + 20})
    bench.run(1.0)
    assert bench.plant.image.read("shaft/input/position").quality is Quality.GOOD
    bench.deaf_to = frozenset({0x380 + 20})
    bench.run(1.0)
    assert bench.plant.image.read("shaft/input/position").reason == "no TPDO3 from the node"
