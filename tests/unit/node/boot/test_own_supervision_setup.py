"""What drives of every family do by themselves when the bridge falls silent: read, enforced, measured."""

from __future__ import annotations

from pathlib import Path

import pytest

from bridge.bustools.drop_test import ForeignMaster, Proof
from bridge.canopen.frame import REMOTE, Frame
from bridge.config import load_site
from bridge.drive import OwnVerdict
from bridge.image import Quality
from bridge.mapping import load_family
from bridge.node.boot import BootError, BootMemory, BootResult, SdoRead, SdoWrite
from bridge.node.boot.own_supervision_setup import set_own_supervision
from bridge.sim.catalogue import simulate_node
from tests.support import sites
from tests.support.bench import Bench
from tests.support.muted_bench import MutableBench, drop

EMCY = 0x085
SLOTS = {"nord/sk-tu4-cao": "fu1", "stoeber/5000": "axis1"}
GUARDED = 'supervision = "guarding"\nsupervision_ms = 100'
HEARTBEAT_LENZE = """
configure = [
  { object = "1016:01", type = "uint32", value = 0x7F012C },
  { object = "5DAF:05", type = "uint8", value = 1 },
]
"""
ENFORCED = "own_timeout_ms = 300\nenforce = true"


@pytest.fixture
def make(tmp_path: Path):
    def make(
        mapping: str, node: str = "", *, drive: str = "", drives: str = "", bus: str = "", **parameters: float
    ) -> MutableBench:
        slot = SLOTS.get(mapping, "drive")
        whole = sites.node(
            sites.drive(slot, "modbus", 500, drive), drives, name="n", mapping=mapping, more=node
        )
        path = sites.write(tmp_path, sites.bus(whole, more=bus), sites.modbus())
        simulated = simulate_node(mapping, 5, parameters)
        bench = MutableBench(load_site(path), family=load_family(mapping), mapping=mapping, node=simulated)
        bench.run(2.0)
        return bench

    return make


def leaf(mapping: str) -> str:
    slot = SLOTS.get(mapping, "drive")
    return f"n/{slot if mapping.startswith('nord/sk-tu4') else 'drive'}"


def worst_case(bench: Bench, drive: str):
    return bench.plant.image.read(f"{drive}/supervision/worst_case_bridge_ms")


STOPPING = [
    ("nord/sk-tu4-cao", "", {"P151": 300.0}, 100 + 300),
    ("nord/sk-tu4-cao", GUARDED, {}, 100 + 300),
    ("nord/sk-tu4-cao", ENFORCED, {}, 100 + 300),
    ("nord/sk-tu3-cao", "", {"P513": 0.5}, 100 + 500),
    ("nord/sk-54xe-rj45", "", {"P513": 0.5}, 100 + 500),
    ("lenze/8400-motec", "", {"C00593/1": 1.0, "C00357/1": 400.0}, 100 + 400),
    ("lenze/8400-motec", HEARTBEAT_LENZE, {}, 100 + 300),
    ("lenze/8400-motec", ENFORCED, {}, 100 + 300),
    ("stoeber/5000", GUARDED, {}, 100 + 300),
    ("cia402/profile-velocity", ENFORCED, {}, 100 + 300),
    ("cia402/profile-velocity", GUARDED, {}, 100 + 300),
]


@pytest.mark.landing(11)
@pytest.mark.parametrize(("mapping", "node", "parameters", "bound_ms"), STOPPING)
def test_a_dead_bridge_shows_in_the_drive_within_the_published_time(
    make, mapping: str, node: str, parameters: dict[str, float], bound_ms: int
) -> None:
    bench = make(mapping, node, **parameters)
    point = worst_case(bench, leaf(mapping))
    assert (point.value, point.quality) == (bound_ms, Quality.GOOD), bench.value("n/node/boot_status")
    hung_at = bench.now
    bench.hang(2.0)
    emergencies = [frame for frame in bench.sent(EMCY) if frame.time > hung_at and any(frame.data[:2])]
    assert emergencies, "the drive says that the bridge is gone"
    measured_ms = 1000 * (emergencies[0].time - hung_at)
    assert 0.5 * bound_ms <= measured_ms <= bound_ms + 1e-6


RUNNING_ON = [
    ("lenze/8400-motec", "", {}, "C00593/1 is 0 (no reaction)"),
    ("lenze/8400-motec", "", {"C00593/1": 4.0}, "C00593/1 is 4 (warning locked)"),
    ("nord/sk-tu4-cao", "", {}, "P151 is 0 (off)"),
    ("nord/sk-tu4-cao", "", {"P151": 300.0, "fu1/P513": -0.1}, "P513 is -1"),
    ("nord/sk-tu3-cao", "", {"P513": -0.1}, "P513 is -1 (off)"),
    ("stoeber/5000", "", {}, "life guarding is off"),
    ("cia402/velocity", "", {}, "1016:01 is 0"),
    ("cia402/velocity", GUARDED, {"6007": 0.0}, "6007 is 0 (no action)"),
]


@pytest.mark.landing(8)
@pytest.mark.parametrize(("mapping", "node", "parameters", "why"), RUNNING_ON)
def test_a_drive_that_would_run_on_is_a_configuration_error(
    make, mapping: str, node: str, parameters: dict[str, float], why: str
) -> None:
    bench = make(mapping, node, **parameters)
    point = worst_case(bench, leaf(mapping))
    assert (point.value, point.quality) == (0, Quality.CONFIG_ERROR)
    assert point.reason.startswith("the drive runs on: ")
    assert why in point.reason
    assert "runs on when the bridge falls silent" in str(bench.value("n/node/boot_status"))


def test_a_heartbeat_of_somebody_else_does_not_count(make) -> None:
    other = HEARTBEAT_LENZE.replace("0x7F012C", "0x10012C")
    point = worst_case(make("lenze/8400-motec", other), "n/drive")
    assert point.quality is Quality.CONFIG_ERROR
    assert "watches node 16, the bridge is 127" in point.reason


def test_a_slow_heartbeat_of_ours_counts_as_long_as_it_may_still_come(make) -> None:
    """A burst has one more heartbeat, and that comes after heartbeat_ms, however short deadman_ms is."""
    slow = HEARTBEAT_LENZE.replace("0x7F012C", "0x7F0320")
    bench = make("lenze/8400-motec", slow, bus="heartbeat_ms = 350")
    assert worst_case(bench, "n/drive").value == 350 + 800
    hung_at = bench.now
    bench.hang(3.0)
    first = next(frame for frame in bench.sent(EMCY) if frame.time > hung_at)
    assert 1000 * (first.time - hung_at) <= 350 + 800


def test_what_cannot_be_read_is_not_known(make) -> None:
    bench = make("nord/sk-tu4-cao", drives=sites.drive("fu2", "modbus", 500, ""), P151=300.0)
    point = worst_case(bench, "n/fu2")
    assert (point.quality, point.reason) == (Quality.CONFIG_ERROR, "not known: P513 is not known")
    opened = "sdo_channels = [2]"
    bench = make("nord/sk-tu4-cao", opened, drives=sites.drive("fu2", "modbus", 500, ""), P151=300.0)
    assert worst_case(bench, "n/fu2").value == 400


def test_what_is_accepted_is_no_error(make) -> None:
    accepted = '[[bus.node.drive]]\nslot = "fu2"\naccepts = { runs_on = "a fan, which may turn" }\n'
    bench = make("nord/sk-tu4-cao", "sdo_channels = [2]", drives=accepted)
    point = worst_case(bench, "n/fu2")
    assert (point.value, point.quality, point.reason) == (0, Quality.GOOD, "a fan, which may turn")
    assert "(fu1)" in str(bench.value("n/node/boot_status"))


# enforce


def writes(bench: Bench, head: str) -> int:
    """SDO downloads that begin so, on any channel."""
    return sum(frame.can_id in (0x605, 0x345) and frame.data.hex().startswith(head) for frame in bench.log)


def test_enforced_values_are_written_once_where_they_differ(make) -> None:
    bench = make("lenze/8400-motec", ENFORCED)
    assert (writes(bench, "2b9a5e01"), writes(bench, "2fae5d01")) == (1, 1)
    assert "n: C00357/1 is" not in str(bench.value("n/node/boot_status"))
    assert "n: C00593/1 was 0, is 1 now (enforced)" in str(bench.value("n/node/boot_status"))
    bench.receive(Frame(0x705, b"\0"))
    bench.run(3.0)
    assert (writes(bench, "2b9a5e01"), writes(bench, "2fae5d01")) == (1, 1), "compared, and not written again"


def test_a_reaction_that_stops_the_drive_is_left_as_it_is(make) -> None:
    bench = make("lenze/8400-motec", ENFORCED, **{"C00593/1": 2.0})
    assert writes(bench, "2fae5d01") == 0
    assert bench.plant.drives["n/drive"].own.watches[0].reaction == "C00593/1 is 2 (trouble)"


def test_without_enforce_the_difference_is_only_told(make) -> None:
    bench = make("nord/sk-tu4-cao", "own_timeout_ms = 300")
    assert writes(bench, "2b972001") == 0
    assert "n: P151 is 0, the site file says 300" in str(bench.value("n/node/boot_status"))


def test_what_goes_to_an_eeprom_is_counted(make) -> None:
    node = f"{ENFORCED}\nsdo_channels = [2]"
    ignoring = {"P151": 300.0, "fu2/P513": -0.1}
    bench = make("nord/sk-tu4-cao", node, drives=sites.drive("fu2", "modbus", 500, ""), **ignoring)
    assert bench.node.drives[1].parameters.raw(513) == 10
    assert bench.plant.eeprom_writes.writes(("n/fu2", "2201:00")) == 1
    assert bench.plant.eeprom_writes.writes(("n", "2097:01")) == 0, "P151 is right"
    assert worst_case(bench, "n/fu2").value == 400


def test_who_wears_out_the_eeprom_is_not_started(make) -> None:
    bench = make("nord/sk-tu3-cao", "own_timeout_ms = 500\nenforce = true", P513=0.5)
    ledger = bench.plant.eeprom_writes
    for _ in range(10):
        ledger.count(("n", "2201:00"), "P513", 100000, bench.now)
    bench.node.drive.parameters.commission(513, 2.0)
    bench.receive(Frame(0x705, b"\0"))
    bench.run(2.0)
    assert "P513 was written 10 times within 10 min" in str(bench.value("n/node/boot_status"))
    assert bench.node.drive.parameters.raw(513) == 20


def test_a_value_that_is_not_kept_is_written_once(make) -> None:
    """A node that takes every write and goes on holding what it held."""
    node = make("cia402/velocity", ENFORCED).plant.nodes["n"]
    memory = BootMemory()

    def boot_up() -> tuple[int, str]:
        asked, written = set_own_supervision(node, BootResult(memory=memory)), 0
        answer = None
        try:
            while True:
                action = asked.send(answer)
                written += isinstance(action, SdoWrite)
                answer = bytes(4) if isinstance(action, SdoRead) else None
        except BootError as error:
            return written, str(error)

    written, told = boot_up()
    assert written == 1
    assert "1016:01 is 0 after 8323372 was written" in told
    written, told = boot_up()
    assert (written, "it is not written again until the node restarts or is reset" in told) == (0, True)


# the drop test


@pytest.mark.landing(4)
@pytest.mark.parametrize(("mapping", "node", "parameters", "bound_ms"), STOPPING)
def test_a_drop_test_proves_the_drives_own_time(
    make, mapping: str, node: str, parameters: dict[str, float], bound_ms: int
) -> None:
    bench = make(mapping, node, **parameters)
    test = drop(bench)
    assert not test.failure
    (outcome,) = test.outcomes
    own_ms = bound_ms - 100
    assert outcome.own.own_ms == own_ms
    assert outcome.proof is Proof.REACTED, outcome.seen
    assert outcome.is_proven
    assert own_ms - 110 <= outcome.reacted_ms <= own_ms + 1


def test_a_drop_test_sends_nothing_while_it_is_silent(make) -> None:
    bench = make("nord/sk-tu4-cao", P151=300.0)
    ours = {0x000, 0x080, 0x205, 0x605, 0x77F}
    test = drop(bench)
    emergency = next(frame for frame in bench.sent(EMCY) if any(frame.data[:2]))
    last = max(frame.time for frame in bench.log if frame.can_id in ours and frame.time < emergency.time)
    assert abs(1000 * (emergency.time - last) - test.outcomes[0].reacted_ms) < 0.2
    again = min(frame.time for frame in bench.log if frame.can_id in ours and frame.time > emergency.time)
    assert again - last >= test.silent_s - 0.02
    enabling = [frame for frame in bench.sent(0x205) if frame.data[0] & 0x0F == 0x0F]
    assert not enabling, "no drive is ever enabled"


SILENCE = 'on_expiry = "silence"'


@pytest.mark.parametrize("silent", [SILENCE, "then_silence_ms = 100"])
def test_where_the_site_stops_by_silence_a_drop_test_ends_the_rpdos_alone(make, silent: str) -> None:
    bench = make("nord/sk-tu4-cao", drive=silent, P151=300.0)
    test = drop(bench)
    (outcome,) = test.outcomes
    assert test.rpdos_alone
    assert outcome.proof is Proof.REACTED, outcome.seen
    emergency = next(frame for frame in bench.sent(EMCY) if any(frame.data[:2]))
    last = max(frame.time for frame in bench.sent(0x205) if frame.time < emergency.time)
    assert abs(1000 * (emergency.time - last) - outcome.reacted_ms) < 0.2
    again = min(frame.time for frame in bench.sent(0x205) if frame.time > emergency.time)
    assert again - last >= test.silent_s - 0.02
    for other in (0x080, 0x77F):
        assert [frame for frame in bench.sent(other) if last + 0.1 < frame.time < again - 0.1]


@pytest.mark.landing(2)
@pytest.mark.parametrize(
    ("mapping", "node"), [("lenze/8400-motec", HEARTBEAT_LENZE), ("stoeber/5000", GUARDED)]
)
def test_a_drive_that_watches_something_else_does_not_pass_it(make, mapping: str, node: str) -> None:
    """`check` and `run` refuse such a site; a drive may be set otherwise than it says."""
    assert drop(make(mapping, node)).outcomes[0].is_proven
    (outcome,) = drop(make(mapping, node, drive=SILENCE)).outcomes
    assert (outcome.proof, outcome.is_proven) == (Proof.NOTHING, False)
    assert outcome.bound_ms == 0


def test_the_published_time_of_silence_has_the_drives_own(make) -> None:
    def stop_ms(mapping: str, node: str, drive: str, **held: float) -> int:
        return make(mapping, node, drive=drive, **held).number(
            f"{leaf(mapping)}/supervision/worst_case_stop_ms"
        )

    assert stop_ms("nord/sk-tu4-cao", "", "", P151=300.0) + 300 == stop_ms(
        "nord/sk-tu4-cao", "", SILENCE, P151=300.0
    )
    assert stop_ms("stoeber/5000", GUARDED, SILENCE) == stop_ms("stoeber/5000", GUARDED, ""), (
        "by silence it never stops, so it gets disable voltage"
    )


def test_a_drop_test_of_a_drive_that_runs_on_fails(make) -> None:
    test = drop(make("lenze/8400-motec"))
    (outcome,) = test.outcomes
    assert (outcome.proof, outcome.is_proven) == (Proof.NOTHING, False)
    assert outcome.own.verdict is OwnVerdict.RUNS_ON


def test_a_late_reaction_is_no_proof(make) -> None:
    bench = make("nord/sk-tu4-cao", P151=300.0)
    bench.node.on_frame(Frame(0x605, bytes.fromhex("2b97200184030000")), bench.now)  # P151 = 900 by now
    outcome = drop(bench).outcomes[0]
    assert outcome.reacted_ms is not None
    assert outcome.reacted_ms > 800
    assert outcome.proof is Proof.LATE
    assert not outcome.is_proven


def test_a_node_that_is_not_there_is_no_result(make) -> None:
    bench = make("nord/sk-tu4-cao")
    bench.powered = False
    bench.run(3.0)
    test = drop(bench)
    assert "n is not operational" in test.failure
    assert not test.outcomes


@pytest.mark.parametrize(
    ("frame", "found"),
    [
        (Frame(0x77F, b"\x05"), "the heartbeat of node 127"),
        (Frame(0x000, b"\x01\x05"), "an NMT command"),
        (Frame(0x080), "SYNC"),
        (Frame(0x205, bytes(8)), "commands for this node (205h)"),
        (Frame(0x705 | REMOTE), "guarding of node 5"),
        (Frame(0x185, bytes(8)), ""),
        (Frame(0x705, b"\x05"), ""),
    ],
)
def test_a_second_master_is_heard(frame: Frame, found: str) -> None:
    listener = ForeignMaster(127, frozenset({0x205}), 10.0, 1.0)
    listener.on_frame(frame)
    assert found in listener.found
    assert bool(listener.found) is bool(found)
    assert listener.is_finished(10.5) is bool(found)
    assert listener.is_finished(11.0)
