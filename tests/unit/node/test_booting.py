"""A bridge that is killed and started again, and whose boot-up fails: whatever the node answers or does not,
a drive that was running is stopped, by whatever identifier it listens to."""

from __future__ import annotations

from collections.abc import Callable
from pathlib import Path
from typing import Any, Final

import pytest

from bridge.canopen.frame import Frame
from bridge.command import Outcome, Request, Start
from bridge.command.drive_link import NodeState
from bridge.config import load_site
from bridge.mapping import load_family
from bridge.sim.catalogue import SIMULATED, simulate_node
from bridge.sim.cia402 import cia402_states
from bridge.sim.cia402.cia402_drive import Cia402Drive
from bridge.sim.core.nmt_slave import SlaveState
from bridge.sim.lenze.lenze_drive import DeviceState
from bridge.sim.lenze.lenze_motec import LenzeMotec
from bridge.sim.nord import nord_states
from bridge.sim.nord.nord_single import NordSingle
from bridge.sim.nord.nord_tu4 import NordTu4
from bridge.sim.stoeber.stoeber_5000 import Stoeber5000
from bridge.sim.stoeber.stoeber_axis import AxisState
from tests.support import sites
from tests.support.bench import PLC, Bench
from tests.support.nightly import by_night

SOME: Final = (
    "cia402/profile-velocity",
    "lenze/8400-motec",
    "nord/sk-54xe-rj45",
    "nord/sk-tu3-cao",
    "nord/sk-tu4-cao",
    "nord/sk-tu4-cao-ds402",
    "stoeber/5000",
    "stoeber/5000-four-axes",
)
"""One of each kind of node."""
SDO_REPLY, HEARTBEAT = 0x585, 0x705
ASKED_S: Final = 0.1
"""A node that answers is stopped in this time."""
SILENT_S: Final = 3.0
"""One that does not in this: what the site gives SDO, twice (``test_the_bound_is_that_of_the_site``)."""
OWN_ID: Final = 0x2B3
"""No factory has it, and neither has a node of the tests."""


def is_running(node: object) -> bool:
    """Whether any drive of the node has its motor energised and takes the controller's setpoint."""
    match node:
        case NordTu4():
            return any(drive.state is nord_states.NordState.ENABLED for drive in node.drives)
        case NordSingle():
            return node.drive.state is nord_states.NordState.ENABLED
        case Stoeber5000():
            return any(axis.state is AxisState.ENABLED for axis in node.axes)
        case LenzeMotec():
            return node.drive.state is DeviceState.OPERATION_ENABLED
        case Cia402Drive():
            return node.axis.state is cia402_states.Cia402State.ENABLED
        case _:
            raise AssertionError(node)


class RestartedBench(Bench):
    """``answers`` is how many SDO answers of the node still come."""

    answers = 1 << 30

    def receive(self, *frames: Frame) -> None:
        for frame in frames:
            if frame.can_id == SDO_REPLY:
                self.answers -= 1
                if self.answers < 0:
                    continue
            super().receive(frame)


def site(
    folder: Path, mapping: str, *, node: str = "", drive: str = "", bus: str = "", others: str = ""
) -> Any:
    family = load_family(mapping)
    slot = family.slot[0].name
    kind = "guarding" if mapping.startswith("stoeber/") else "heartbeat"
    table = sites.node(
        sites.drive(slot, "modbus", 20_000, f"telegram_downtime_s = 0\n{drive}"),
        name="n",
        mapping=mapping,
        more=f'supervision = "{kind}"\n{node}',
    )
    missing = others.format(mapping=mapping, slot=slot)
    return load_site(sites.write(folder, sites.bus(table, missing, more=bus), sites.modbus()))


def start(bench: Bench) -> None:
    """The first drive is enabled, as a controller does it."""
    bench.run(2.5)
    outcomes: list[Outcome] = []
    (name, *_) = bench.plant.drives
    bench.view.submit(Request(PLC, name, Start()), outcomes.append)
    bench.run(1.0)
    assert [outcome.ok for outcome in outcomes] == [True], outcomes
    assert is_running(bench.node)


PLACES: Final = {"factory": ("", ""), "site file": ("id", "id"), "the node's own": ("id", "")}
"""What the site says of the RPDO before and after the restart."""


class Restart:
    """``stopped_s`` is the time from the bridge's start to the drive's stop, None where it runs on."""

    def __init__(
        self,
        folder: Path,
        mapping: str,
        *,
        before: str = "",
        after: str = "",
        bus: str = "",
        node: str = "",
        others: str = "",
        prepare: Callable[[RestartedBench], None] = lambda bench: None,
        simulated: Any = None,
    ) -> None:
        family = load_family(mapping)
        simulated = simulated or simulate_node(mapping, 5, {})
        first = Bench(
            site(folder, mapping, drive=before, bus=bus), family=family, mapping=mapping, node=simulated
        )
        start(first)
        self.bench = RestartedBench(
            site(folder, mapping, node=node, drive=after, bus=bus, others=others),
            family=family,
            mapping=mapping,
            node=simulated,
            present=False,
            begin_s=first.now,
        )
        self.bench.powered = True  # the bridge was restarted, and the node was not
        prepare(self.bench)

    def stopped_s(self, limit_s: float) -> float | None:
        begun = self.bench.now
        while self.bench.now < begun + limit_s:
            if not is_running(self.bench.node):
                return self.bench.now - begun
            self.bench.run(0.01)
        return None if is_running(self.bench.node) else self.bench.now - begun


def rpdo(place: str) -> str:
    return f"rpdo = {{ cob_id = {OWN_ID} }}" if place else ""


MISSING: Final = """
[[bus.node]]
name = "m"
id = 9
mapping = "{mapping}"
mandatory = true
[[bus.node.drive]]
slot = "{slot}"
"""

FAILURES: Final = {
    "another vendor": ("[bus.node.identity]\nvendor_id = 0x123", "", None, ASKED_S),
    "a configuration that is refused": (
        'configure = [{ object = "5432:10", type = "uint8", value = 1 }]', "", None, ASKED_S,
    ),
    "no error control": ("", "", lambda bench: setattr(bench, "deaf_to", {HEARTBEAT}), ASKED_S),
    "waits for another": ("", MISSING, None, ASKED_S),
    "no SDO answer": ("", "", lambda bench: setattr(bench, "answers", 0), SILENT_S),
    "one SDO answer": ("", "", lambda bench: setattr(bench, "answers", 1), SILENT_S),
    "two SDO answers": ("", "", lambda bench: setattr(bench, "answers", 2), SILENT_S),
    "five SDO answers": ("", "", lambda bench: setattr(bench, "answers", 5), SILENT_S),
    "twenty SDO answers": ("", "", lambda bench: setattr(bench, "answers", 20), SILENT_S),
}  # fmt: skip


HOLDING: Final = 'mandatory_missing = "hold_all"'
CASES: Final = [
    *((mapping, failure, "the node's own") for mapping in SOME for failure in FAILURES),
    *((mapping, "another vendor", place) for mapping in SOME for place in PLACES),
    *((mapping, "no SDO answer", place) for mapping in SOME[:3] for place in PLACES),
]


@pytest.mark.landing(13)
@pytest.mark.parametrize(("mapping", "failure", "place"), by_night(dict.fromkeys(CASES)))
def test_a_drive_that_was_running_is_stopped_by_a_bridge_that_cannot_boot_it(
    tmp_path: Path, mapping: str, failure: str, place: str
) -> None:
    node, others, prepare, bound_s = FAILURES[failure]
    before, after = (rpdo(one) for one in PLACES[place])
    restart = Restart(
        tmp_path, mapping, before=before, after=after, bus=HOLDING, node=node, others=others,
        prepare=prepare or (lambda bench: None),
    )  # fmt: skip
    stopped_s = restart.stopped_s(bound_s + 1.0)
    assert stopped_s is not None, "the drive runs on"
    assert stopped_s <= bound_s
    restart.bench.run(10.0)
    assert not is_running(restart.bench.node), "and stays stopped"


@pytest.mark.landing
def test_every_family_that_can_be_simulated_is_stopped(tmp_path: Path) -> None:
    """Those that are not in the table above, with the identifier that only the node knows."""
    for mapping in sorted(set(SIMULATED) - set(SOME)):
        restart = Restart(tmp_path, mapping, before=rpdo("id"), node="[bus.node.identity]\nvendor_id = 0x123")
        stopped_s = restart.stopped_s(ASKED_S)
        assert stopped_s is not None, mapping
        assert stopped_s <= ASKED_S


def test_the_bound_is_that_of_the_site(tmp_path: Path) -> None:
    """Two reads, each sent sdo_retries times more, are what it takes to know that nobody answers."""
    node = site(tmp_path, "cia402/velocity").bus[0].node[0]
    looking_s = 2 * (node.sdo_retries + 1) * node.sdo_timeout_ms / 1000
    assert looking_s <= SILENT_S - 0.5


# what is sent where


def sent_to(bench: Bench, *can_ids: int) -> list[tuple[int, str]]:
    return [(frame.can_id, frame.data.hex()) for frame in bench.log if frame.can_id in can_ids]


def test_a_stop_has_the_layout_that_the_node_has(tmp_path: Path) -> None:
    swapped = 'rpdo = { cob_id = 691, mapping = ["3002:01/16", "3000:01/16", "3002:02/16", "3002:03/16"] }'
    restart = Restart(
        tmp_path, "nord/sk-tu4-cao", before=swapped, node="[bus.node.identity]\nvendor_id = 0x123"
    )
    assert restart.stopped_s(ASKED_S) is not None
    told = [data for _, data in sent_to(restart.bench, OWN_ID)]
    assert set(told) == {"0000000400000000"}, "the setpoint comes first, then the control word"


def test_an_rpdo_that_waits_for_sync_gets_one_before_the_node_leaves_operational(tmp_path: Path) -> None:
    restart = Restart(
        tmp_path, "lenze/8400-motec",
        before="rpdo = { cob_id = 691, transmission_type = 1 }",
        bus="sync_period_ms = 20", node="[bus.node.identity]\nvendor_id = 0x123",
    )  # fmt: skip
    assert restart.stopped_s(0.05) is not None
    seen = [frame.can_id for frame in restart.bench.log]
    restart.bench.run(0.1)
    seen = [(frame.can_id, frame.data[:1]) for frame in restart.bench.log]
    stop, sync = seen.index((OWN_ID, b"\0")), [n for n, one in enumerate(seen) if one[0] == 0x080]
    leaves = seen.index((0, b"\x80"))
    assert any(stop < one < leaves for one in sync)


def test_what_a_node_has_once_named_is_remembered(tmp_path: Path) -> None:
    """It answers no more: the next stop goes where it has listened before."""
    mapping = "cia402/profile-velocity"
    restart = Restart(tmp_path, mapping, before=rpdo("id"))
    bench = restart.bench
    bench.run(2.0)
    assert bench.network.nodes[0].state is NodeState.OPERATIONAL
    bench.answers, bench.cut = 0, True
    bench.run(2.0)
    bench.cut, since = False, len(bench.log)
    bench.run(3.0)
    assert OWN_ID in {frame.can_id for frame in bench.log[since:]}


OTHER: Final = """
[[bus.node]]
name = "other"
id = 9
mapping = "{mapping}"
[[bus.node.drive]]
slot = "{slot}"
rpdo = {{ cob_id = 0x205 }}
"""


def test_no_stop_goes_to_what_the_site_gives_to_another_node(tmp_path: Path) -> None:
    """205h is the factory's for node 5, and the site file's for node 9."""
    mapping = "cia402/profile-velocity"
    bench = Bench(
        site(tmp_path, mapping, drive=rpdo("id"), others=OTHER), family=load_family(mapping), mapping=mapping,
        node=simulate_node(mapping, 5, {}),
    )  # fmt: skip
    sent: list[int] = []
    core = bench.network.nodes[0]
    core.wire.send_stopped()
    sent += [frame.can_id for frame in core.wire.take_frames()]
    assert OWN_ID in sent
    assert 0x205 not in sent


# the node afterwards


def nmt(bench: Bench) -> list[int]:
    return [frame.data[0] for frame in bench.sent(0) if frame.data[1] == 5]


def failing(folder: Path, mapping: str) -> Bench:
    restart = Restart(folder, mapping, node="[bus.node.identity]\nvendor_id = 0x123")
    restart.bench.run(20.0)
    return restart.bench


def test_it_stays_stopped_between_attempts_and_is_woken_for_each(tmp_path: Path) -> None:
    bench = failing(tmp_path, "cia402/profile-velocity")
    assert bench.node.slave.state is SlaveState.STOPPED
    commands = nmt(bench)
    assert len(commands) > 6
    assert commands[:2] == [0x80, 0x02]
    assert set(commands) == {0x80, 0x02}
    assert commands[-1] == 0x02


@pytest.mark.landing(3)
@pytest.mark.parametrize("mapping", ["lenze/8400-motec", "nord/sk-tu4-cao", "stoeber/5000"])
def test_where_a_stopped_node_runs_on_it_is_reset_and_that_once(tmp_path: Path, mapping: str) -> None:
    bench = failing(tmp_path, mapping)
    assert bench.node.slave.state is SlaveState.STOPPED
    commands = nmt(bench)
    assert commands.count(0x81) == 1
    assert commands[-1] == 0x02


def test_a_node_that_is_switched_off_is_sent_nothing(tmp_path: Path) -> None:
    mapping = "cia402/profile-velocity"
    restart = Restart(tmp_path, mapping, node="enabled = false")
    restart.bench.run(5.0)
    assert not nmt(restart.bench)
    assert not restart.bench.sent(0x205)
    assert is_running(restart.bench.node), "it is somebody else's"


def test_a_node_that_can_be_booted_again_goes_on(tmp_path: Path) -> None:
    restart = Restart(tmp_path, "stoeber/5000", prepare=lambda bench: setattr(bench, "answers", 0))
    restart.bench.run(5.0)
    restart.bench.answers = 1 << 30
    restart.bench.run(15.0)
    assert restart.bench.network.nodes[0].state is NodeState.OPERATIONAL
