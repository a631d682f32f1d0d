"""The outputs of a node that is no drive: owned, watched, and safe when nobody commands them."""

from __future__ import annotations

from pathlib import Path

import pytest
from hypothesis import HealthCheck, example, given, settings
from hypothesis import strategies as st

from bridge.canopen.frame import Frame
from bridge.canopen.nmt import NmtState
from bridge.command import Action, Code, EventKind, Identity, Outcome, Source
from bridge.command.messages.request import STOP_ACTIONS
from bridge.image import Quality, Value
from tests.support.bench import PLC, Bench
from tests.support.devices import IO_BLOCK, OUTPUTS, device_bench, io_block
from tests.support.nightly import examples

SAFE = {"valves": 0, "speed": 5.0, "lamp": 77}
OTHER = Identity(Source.MODBUS, "10.0.0.9")


@pytest.fixture
def bench(tmp_path: Path) -> Bench:
    bench = device_bench(tmp_path, io_block(), IO_BLOCK, OUTPUTS)
    bench.run(2.0)
    assert bench.value("shaft/node/boot_status") == "ok; 1017h was 0, is 66 now"
    return bench


def write(bench: Bench, identity: Identity = PLC, **values: Value) -> Outcome:
    outcome = bench.ask(Action.WRITE, "shaft", identity, values=values)
    bench.run(0.05)
    return outcome


def shown(bench: Bench) -> dict[str, object]:
    return {name: bench.value(f"shaft/output/{name}") for name in SAFE}


def held(bench: Bench) -> dict[str, object]:
    """What the device has got."""
    node = bench.node
    return {
        "valves": node.number("6200:01"),
        "speed": node.number("6411:01", signed=True) / 10,
        "lamp": node.number("6411:02"),
    }


def go(bench: Bench) -> None:
    assert write(bench, valves=0).ok
    assert write(bench, valves=0x81, speed=-2.5, lamp=3).forwarded


def test_without_an_owner_they_are_safe_and_what_holds_is_as_it_was(bench: Bench) -> None:
    assert shown(bench) == held(bench) == SAFE
    assert bench.plant.image.read("shaft/output/valves").quality is Quality.GOOD


def test_an_owner_writes_them_once_it_has_begun_with_what_is_safe(bench: Bench) -> None:
    blocked = write(bench, valves=1)
    assert (blocked.code, blocked.forwarded) == (Code.OK, False)
    assert held(bench) == SAFE
    go(bench)
    assert shown(bench) == held(bench) == {"valves": 0x81, "speed": -2.5, "lamp": 3}
    assert write(bench, lamp=4).forwarded
    assert held(bench) == {"valves": 0x81, "speed": -2.5, "lamp": 4}
    assert bench.value("shaft/supervision/owner") == str(PLC)


def test_one_bit_is_written_beside_the_others(bench: Bench) -> None:
    go(bench)
    assert bench.ask(Action.WRITE, "shaft", values={"valves.0": False, "valves.6": True}).forwarded
    bench.run(0.05)
    assert held(bench)["valves"] == 0xC0
    assert bench.ask(Action.WRITE, "shaft", values={"valves.8": True}).code is Code.OUT_OF_RANGE


def test_a_silent_owner_makes_them_safe_until_it_acknowledges(bench: Bench) -> None:
    go(bench)
    bench.run(0.4)
    assert held(bench) == shown(bench) == {"valves": 0, "speed": 5.0, "lamp": 3}
    assert bench.value("shaft/supervision/trips") == 1
    assert bench.value("shaft/node/current_fault") == 102.0
    assert not write(bench, valves=1).forwarded
    assert held(bench)["valves"] == 0
    assert bench.ask(Action.RESET_FAULT, "shaft").ok
    bench.run(0.05)
    assert held(bench) == {"valves": 0, "speed": 5.0, "lamp": 3}
    assert write(bench, valves=1).forwarded
    assert held(bench) == {"valves": 1, "speed": 5.0, "lamp": 3}


def test_nobody_else_writes_them_and_anybody_stops_them(bench: Bench) -> None:
    go(bench)
    assert write(bench, OTHER, valves=1).code is Code.NOT_ALLOWED
    assert bench.ask(Action.STOP, "shaft", OTHER).ok
    bench.run(0.02)
    assert held(bench) == shown(bench) == {"valves": 0, "speed": 5.0, "lamp": 0}
    assert bench.value("shaft/supervision/refused_writes") == 1


@pytest.mark.landing(3)
@pytest.mark.parametrize("action", sorted(STOP_ACTIONS))
def test_a_stop_by_anybody_ends_what_a_dead_owner_left_on(bench: Bench, action: Action) -> None:
    """``hold`` speaks of silence, never of somebody's Stop (shared design, watchdog, third edition)."""
    go(bench)
    bench.run(0.4)
    assert (bench.value("shaft/supervision/watchdog_state"), held(bench)["lamp"]) == (3, 3)
    assert bench.ask(action, "shaft", OTHER) == Outcome(Code.OK)
    bench.run(0.02)
    assert held(bench) == shown(bench) == {"valves": 0, "speed": 5.0, "lamp": 0}


@pytest.mark.parametrize("is_dead", [False, True])
def test_an_acknowledge_takes_no_stop_by_somebody_else_back(bench: Bench, is_dead: bool) -> None:
    """A PLC that acknowledges in each cycle does not mean the colleague's stop."""
    go(bench)
    if is_dead:
        bench.run(0.4)
    bench.ask(Action.STOP, "shaft", OTHER)
    for _ in range(5):
        assert bench.ask(Action.RESET_FAULT, "shaft").ok
        assert not write(bench, valves=0x81, lamp=3).forwarded
        assert held(bench) == {"valves": 0, "speed": 5.0, "lamp": 0}
    assert write(bench, valves=0, speed=5.0, lamp=0).forwarded, "an edge of the owner's own"
    assert write(bench, valves=0x81, lamp=3).forwarded
    assert held(bench)["valves"] == 0x81


def test_a_node_that_was_away_gets_nothing_active_by_itself(bench: Bench) -> None:
    go(bench)
    bench.cut = True
    for _ in range(20):
        write(bench, valves=0x81)
    bench.cut = False
    bench.node.start(bench.now)
    for _ in range(60):
        write(bench, valves=0x81)
    assert bench.value("shaft/node/state") == 2
    assert held(bench)["valves"] == 0
    assert write(bench, valves=0).forwarded
    assert write(bench, valves=0x81).forwarded
    assert held(bench)["valves"] == 0x81


def test_a_bridge_that_hangs_leaves_nothing_active(bench: Bench) -> None:
    go(bench)
    bench.hang(0.5)
    bench.run(0.05)
    assert held(bench)["valves"] == 0


@pytest.mark.landing(4)
@pytest.mark.parametrize(
    ("values", "message"),
    [
        ({"valves": 256}, "valves takes 0…255, not 256"),
        ({"valves": 1.5}, "valves takes a whole number, not 1.5"),
        ({"speed": 1e9}, "speed takes -3276.8…3276.7, not 1000000000 Hz"),
        ({"pump": 1}, "shaft/output has no 'pump'; it has valves, speed, lamp"),
    ],
)
def test_what_is_no_value_is_refused(bench: Bench, values: dict[str, Value], message: str) -> None:
    assert bench.ask(Action.WRITE, "shaft", values=values).message == message


def test_what_the_node_does_by_itself_is_read(bench: Bench) -> None:
    stop = bench.plant.image.read("shaft/supervision/worst_case_bridge_ms")
    assert (stop.value, stop.quality) == (400, Quality.GOOD)
    assert bench.number("shaft/supervision/worst_case_stop_ms") > 200


@pytest.mark.landing(5)
@pytest.mark.parametrize(
    ("name", "size", "value", "why"),
    [
        ("6206:01", 1, 0xF0, "valves keeps 4 of its bits: 6206:01 is F0h"),
        ("6207:01", 1, 1, "valves becomes 1h by 6207:01, not 0h"),
        ("6443:01", 1, 0, "speed keeps its value: 6443:01 is 0"),
        ("1029:01", 1, 1, "1029:01 is 1: it runs on"),
        ("1016:01", 4, 0, "1016:01 is 0: it watches no heartbeat"),
    ],
)
def test_what_it_would_go_on_with_is_told(tmp_path: Path, name: str, size: int, value: int, why: str) -> None:
    node = io_block()
    node.put(name, size, value)
    bench = device_bench(tmp_path, node, IO_BLOCK, OUTPUTS)
    bench.run(2.0)
    stop = bench.plant.image.read("shaft/supervision/worst_case_bridge_ms")
    assert (stop.value, stop.quality) == (0, Quality.CONFIG_ERROR)
    assert why in stop.reason
    assert why in str(bench.value("shaft/node/boot_status"))


_STEPS = st.lists(
    st.tuples(
        st.sampled_from(
            ["safe", "active", "other", "acknowledge", "stop", "cut", "back", "restart", "hang", "gap"]
        ),
        st.integers(0, 40),
    ),
    min_size=3,
    max_size=25,
)


@pytest.mark.landing
@settings(max_examples=examples(60), suppress_health_check=list(HealthCheck))
@given(steps=_STEPS)
@example(steps=[("safe", 0), ("active", 0), ("cut", 0), ("restart", 1), ("back", 200)])
def test_whatever_happens_no_output_is_active_without_its_owner(
    tmp_path_factory: pytest.TempPathFactory, steps: list[tuple[str, int]]
) -> None:
    """Longer than published, while the device can hear the bridge. One that has restarted and was not heard
    takes no RPDO until the bridge has missed its heartbeat and booted it; this one keeps its outputs
    meanwhile."""
    bench = device_bench(tmp_path_factory.mktemp("site"), io_block(), IO_BLOCK, OUTPUTS)
    bench.run(2.0)
    limit_s = bench.number("shaft/supervision/worst_case_stop_ms") / 1000
    heard, is_deaf = -1000.0, False
    for what, pause in steps:
        match what:
            case "safe" | "active":
                values = {"valves": 0 if what == "safe" else 0x55, "speed": 5.0}
                if bench.ask(Action.WRITE, "shaft", values=values).ok:
                    heard = bench.now
            case "other":
                bench.ask(Action.WRITE, "shaft", OTHER, values={"valves": 0xAA})
            case "acknowledge":
                if bench.ask(Action.RESET_FAULT, "shaft").ok:
                    heard = bench.now
            case "stop":
                bench.ask(Action.STOP, "shaft", OTHER)
            case "cut" | "back":
                bench.cut = what == "cut"
            case "restart":
                bench.node.start(bench.now)
                is_deaf |= bench.cut
            case "hang":
                bench.hang(pause / 50)
            case _:
                bench.run(1.0)
        for _ in range(pause):
            bench.run(0.01)
            active = held(bench)["valves"] != 0 or held(bench)["speed"] != 5.0
            hears = not (bench.cut or is_deaf)
            assert not (active and hears) or bench.now <= heard + limit_s + 0.1, (what, bench.now - heard)
            is_booted = bench.node.state == NmtState.OPERATIONAL and bench.value("shaft/node/state") == 2
            is_deaf &= not is_booted


def test_another_sender_on_their_identifier_is_an_intruder(bench: Bench) -> None:
    go(bench)
    bench.receive(Frame(0x200 + 20, b"\x55"))
    bench.run(0.1)
    (told,) = [event.message for event in bench.events if event.kind is EventKind.INTRUDER]
    assert told.startswith("intruder: RPDO of shaft (214h): 55, which leaves outputs active, from somebody")
    assert "NMT stop of shaft" in told


def test_at_the_end_they_are_safe(bench: Bench) -> None:
    go(bench)
    bench.plant.close(bench.now)
    bench.run(0.05)
    assert held(bench) == {"valves": 0, "speed": 5.0, "lamp": 3}
    assert bench.ask(Action.WRITE, "shaft", values={"valves": 1}).code is Code.NOT_READY
