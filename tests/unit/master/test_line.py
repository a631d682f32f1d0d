"""What is repeated on the bus is kept from round to round, and never longer than it is right."""

from __future__ import annotations

from pathlib import Path

from bridge.can.burstend import Burst
from bridge.command import Action, Outcome, Request, Write
from bridge.command.drive_link import NodeState
from bridge.config import load_site
from tests.support import sites
from tests.support.bench import PLC, Bench, write_site
from tests.support.pausing_bench import MAPPING, PausingBench
from tests.support.quick import Quick, quick_site

RPDO1 = 0x200
SETPOINTS = 0x305


def operational(folder: Path, nodes: int = 3) -> Quick:
    quick = Quick(quick_site(folder, nodes, bus="sync_period_ms = 10"))
    quick.run(3.0)
    assert all(node.state is NodeState.OPERATIONAL for node in quick.network.nodes)
    return quick


def kept_is_right(quick: Quick) -> bool:
    quick.network.take_routes()
    kept = quick.repeated.repetitions()
    return kept == quick.repeated.repetitions(anew=True)


def test_heartbeats_do_not_make_it_anew(tmp_path: Path) -> None:
    quick = operational(tmp_path)
    quick.network.take_routes()
    before = quick.repeated.repetitions()
    quick.run(0.5)
    assert quick.repeated.repetitions() is before


def test_a_changed_word_is_in_it_at_once(tmp_path: Path) -> None:
    bench = Bench(write_site(tmp_path))
    bench.run(3.0)
    (line,) = bench.master._lines
    before = line.repeated.repetitions()[RPDO1 + 5]
    request = Request(PLC, "conveyor/fu1", Write({"control_word": 0x047E}))
    outcomes: list[Outcome] = []
    bench.view.submit(request, outcomes.append)
    assert outcomes[0].forwarded
    assert line.repeated.repetitions()[RPDO1 + 5] != before


def test_it_is_right_whatever_becomes_of_the_nodes(tmp_path: Path) -> None:
    quick = operational(tmp_path)
    quick.nodes[1].present = False
    for _ in range(20):
        quick.run(0.1)
        assert kept_is_right(quick)
    assert quick.core(1).state is NodeState.LOST
    quick.nodes[1].present = True
    quick.nodes[1].start(quick.now)
    for _ in range(40):
        quick.run(0.1)
        assert kept_is_right(quick)
    assert quick.core(1).state is NodeState.OPERATIONAL
    for action in (Action.STOP_NODE, Action.START_NODE):
        quick.ask(action, "n2")
        for _ in range(20):
            assert kept_is_right(quick)
            quick.run(0.1)
    quick.network.bus_is_gone(quick.now)
    assert kept_is_right(quick)
    assert RPDO1 + 3 in quick.repeated.repetitions(), "stopped words go to a lost node as well"


def test_a_setpoint_is_there_before_the_enable_and_renewed_after_the_control_word(tmp_path: Path) -> None:
    """Each has as many frames until the deadline as are left when it is told: what is told later, no more."""
    node = sites.node(sites.drive("drive", "modbus", 500, f'name = "fu1"\n{sites.SCALED}'), mapping=MAPPING)
    bench = PausingBench(load_site(sites.write(tmp_path, sites.bus(node), sites.modbus(), name="bench")))
    bench.run(3.0)
    told: list[tuple[int, bool]] = []
    begin = bench.bus.burst

    def note(burst: Burst, now: float, *, at_once: bool = False) -> None:
        told.append((burst.can_id, at_once))
        begin(burst, now, at_once=at_once)

    bench.bus.burst = note
    for word in (0x047E, 0x047F):
        assert bench.write(control_word=word, setpoint_1=0x2000, setpoint_4=word).ok
        bench.run(0.2)
    assert [can_id for can_id, at_once in told if at_once] == [SETPOINTS, RPDO1 + 5] * 2
    renewed = [can_id for can_id, at_once in told if not at_once and can_id in (RPDO1 + 5, SETPOINTS)]
    assert renewed == [RPDO1 + 5, SETPOINTS] * (len(renewed) // 2)
    assert len(renewed) >= 10


def test_the_transfers_of_three_nodes_are_under_way_at_the_same_time(tmp_path: Path) -> None:
    quick = Quick(quick_site(tmp_path, 3))
    quick.lose = lambda frame: frame.can_id & 0x780 == 0x580
    quick.run(0.05)
    asked = {frame.can_id for frame in quick.log if frame.can_id & 0x780 == 0x600}
    assert asked == {0x601, 0x602, 0x603}, "none has waited for another's answer"
