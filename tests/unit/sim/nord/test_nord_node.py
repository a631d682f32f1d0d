"""Behaviour that all NORD nodes have in common, whatever stands behind them."""

from __future__ import annotations

import pytest

from bridge.sim.nord.nord_single import NordSingle
from bridge.sim.nord.nord_single_settings import RJ45_5XX, TU3
from bridge.sim.nord.nord_tu4 import NordTu4

NODES = {
    "tu4": lambda: NordTu4(5),
    "tu3": lambda: NordSingle(5, TU3),
    "rj45": lambda: NordSingle(5, RJ45_5XX),
}


@pytest.fixture(params=NODES)
def bench(request, bench_of):
    made = bench_of(NODES[request.param]())
    made.run(0.3)
    return made


def fail(node) -> None:
    node.fail_drive("fu1", 30) if isinstance(node, NordTu4) else node.fail_drive(30)


@pytest.mark.landing(3)
def test_a_drives_fault_is_an_emergency_with_its_number(bench):
    fail(bench.node)
    bench.run(0.1)
    assert [data.hex().upper() for _, data in bench.of(0x085)] == ["1023030000000000"]
    assert bench.read(0x1003, 1) & 0xFFFF == 0x2310
    assert bench.read(0x1001, 0) == 3


def test_leaving_operational_does_not_end_the_watch_of_its_telegrams(bench):
    bench.nmt(1)
    bench.node._watch.start(bench.now)
    before = bench.node._watch.next_deadline()
    bench.nmt(0x80)
    assert bench.node._watch.next_deadline() == before


def test_switched_on_again_nothing_is_left_of_a_fault(bench):
    fail(bench.node)
    bench.run(0.1)
    bench.node.power_cycle()
    bench.run(0.5)
    assert [drive.fault_tenths for drive in bench.node.drives] == [0] * len(bench.node.drives)
