"""A plant: the bridge, its drives and their controllers on one clock, and an oracle that sees all of it."""

from __future__ import annotations

from collections import Counter
from collections.abc import Callable
from dataclasses import dataclass
from pathlib import Path
from random import Random
from typing import Final

from bridge.canopen.frame import Frame
from bridge.cli.simulation import simulated_nodes
from bridge.command import Event, EventKind, Outcome
from bridge.project import Project, load_project
from tests.plant import hoist
from tests.plant.answers import Answers
from tests.plant.bridge_process import Bridge
from tests.plant.bus_deeds import bus_off, cut, noise, reset_node, silence_node
from tests.plant.causes import Causes
from tests.plant.clients import Controller, Operator, Stranger
from tests.plant.dead_bridge import be_dead
from tests.plant.debts import Debts
from tests.plant.deeds import CALM, MORE
from tests.plant.field import FieldNode
from tests.plant.front import Front, judge_front
from tests.plant.meeting import Meeting
from tests.plant.oracle import Oracle
from tests.plant.outputs import Outputs, stop_outputs
from tests.plant.plan import Plan, Step, length_s
from tests.plant.process_deeds import hang, hang_front, kill, kill_front
from tests.plant.summaries import Summaries
from tests.plant.truths import truths_of
from tests.plant.ways import Ways
from tests.plant.wire import Port, Wire
from tests.plant.witness import Witness
from tests.plant.witnessed import Witnessed
from tests.plant.world import BEGIN_S, World
from tests.proof.block import BLOCK
from tests.proof.drives import DRIVES, Drive, write_site

_BITRATE: Final = 1_000_000
_LOOK_S: Final = 0.25
_SECOND: Final = "bridge two"
_ROUND_S: Final = 0.05
_QUIET_S: Final = 1.0
_MIRROR_S: Final = 1.3
"""By so much a value may be older in a front: after a second without news, and a look each 0.1 s, it says
that the bus process is gone."""
_SETTLES_S: Final = 5.0
"""What a step has left behind is put in order by then."""


@dataclass(frozen=True, slots=True)
class Result:
    """End of a run. ``counts`` is how often each kind of step was there, ``frames`` what was on the wire,
    ``moved`` how many of the drives moved at the end, and ``played_s`` when that was."""

    plan: Plan
    violations: list[str]
    hash: str
    frames: int
    looks: int
    moved: int
    counts: Counter[str]
    log: list[str]
    played_s: float


def project(folder: Path) -> Project:
    """The site of this run's plant, written to ``folder``."""
    for name in ("state", "run"):
        (folder / name).mkdir(exist_ok=True)
    site = folder / "site.toml"
    others = BLOCK.site(folder), hoist.site()
    return load_project(write_site(site, "can0", folder / "state", folder / "run", others=others))


class Plant:
    def __init__(
        self,
        project: Project,
        plan: Plan,
        *,
        logs: bool = False,
        records: Callable[[bytes], None] | None = None,
    ) -> None:
        """``records`` takes the notes of each turn of the bridge while its tape is on."""
        self.world = World()
        self.world.log = [] if logs else None
        self.plan = plan
        table = project.site.bus[0]
        self.wire = Wire(self.world, table.name, _BITRATE, Random(f"{plan.seed} wire"))
        self.wire.witness.append(self._on_frame)
        self.oracle = Oracle(list(DRIVES))
        self.answers = Answers(self.oracle, list(DRIVES))
        self.causes = Causes(self.oracle)
        self.debts = Debts(self.oracle)
        self.before_telegram: Callable[[], None] = lambda: None
        """Called once before the bridge's next turn with a controller's telegram."""
        self.ways = Ways(self.oracle)
        self.outputs = Outputs(self.oracle)
        self.summaries = Summaries(self.oracle, table.name)
        self.witnessed = Witnessed(self.oracle, table.name)
        Witness(self.world, self.wire, project, self.witnessed)
        self.answers.is_quiet = self.debts.is_quiet = self.witnessed.is_quiet = self.is_quiet
        self.has_outputs = False
        """Whether the outputs have an owner."""
        self.oracle.on_trip = self._on_trip
        self.oracle.on_stop = self._on_stop
        self.second: Bridge | None = None
        self.project = project
        self.names = {node.id: node.name for node in table.node}
        self.nodes = [
            FieldNode(self.world, self.wire, device) for device in simulated_nodes(table, project.path)
        ]
        self.nodes_by_id = {node.device.node_id: node for node in self.nodes}
        meeting = Meeting(self.world)
        chance = Random(f"{plan.seed} bridge")
        self.bridge = Bridge(self.world, project, {table.name: self.wire}, "one", chance, records, meeting)
        self.front = Front(self.world, meeting, "opcua", self.bridge.faults)
        judge_front(self.front, self.bridge, self.answers)
        self.bridge.on_start.append(self._on_start)
        self.truths = truths_of(self)
        self.bridge.on_event.append(self._on_event)
        self.bridge.watchers += [self.oracle, self.debts, self]
        self.bridge.on_request.append(
            lambda number, asked: self.answers.asked(("", number), asked, self.world.now)
        )
        self.bridge.on_answer.append(lambda number, outcome: self._on_answer(number, outcome))
        self.controllers = [
            Controller(
                self.world,
                self.bridge,
                self.front if drive.protocol == "opcua" else self.bridge,
                drive,
                self._on_telegram,
                self._on_refused,
            )
            for drive in DRIVES
        ]
        self._last_stops: dict[Drive, float | None] = dict.fromkeys(DRIVES)
        self.operator = Operator(self.world, self.bridge)
        self.hoist = hoist.Hoist(self)
        for node in self.nodes:
            node.power_on()
        self.counts: Counter[str] = Counter()
        self._silent_since = BEGIN_S
        self._loud_until = BEGIN_S
        self.intruder_at = 0.0
        """When somebody has last commanded a node beside the bridge."""
        self.down_s = 0.0
        for step in plan.steps:
            self.world.at(BEGIN_S + step.at, self._doing(step))
        self.world.after(_LOOK_S, self._look)

    def run(self, *, to_first: bool = False) -> Result:
        """Play the plan, or as much of it as there is before the first violation is found."""
        end = BEGIN_S + self.plan.seconds
        while self.world.now < end and not (to_first and (self.oracle.violations or self.bridge.faults)):
            self.world.run_until(min(end, self.world.now + _LOOK_S) if to_first else end)
        self.close()
        return Result(
            self.plan,
            self.oracle.violations + self.bridge.faults,
            self.world.hash,
            self.wire.frames,
            self.oracle.looks,
            sum(self._moves(drive) for drive in DRIVES),
            self.counts,
            self.world.log or [],
            self.world.now - BEGIN_S,
        )

    def close(self) -> None:
        """No task of its processes is left."""
        self.front.end()
        self.bridge.process.loop.end()

    def _moves(self, drive: Drive) -> bool:
        track = self.oracle.tracks[drive]
        mask, value = drive.family.enabled
        return bool(track.said) and track.said[-1][1] & mask == value

    # what the oracle is told

    def _on_frame(self, frame: Frame, sender: Port) -> None:
        of_bridge = sender.name.startswith("bridge")
        self.world.tell_frame(sender.name, frame)
        self.witnessed.sender = sender.name
        if sender.name == _SECOND:
            self.oracle.frame_of_other(frame.time, frame.can_id, frame.data)
            self.debts.frame_of_other(frame.time, frame.can_id)
            self.disturbed()
            return
        self.oracle.frame(frame.time, frame.can_id, frame.data, of_bridge=of_bridge)
        who = "bridge" if of_bridge else sender.name.partition(" ")[0]
        self.debts.frame(frame.time, frame.can_id, frame.data, who)
        if of_bridge:
            self.ways.frame(frame.time, frame.can_id, frame.data)
            self.outputs.frame(frame.time, frame.can_id, frame.data)

    def _on_event(self, event: Event) -> None:
        self.causes.told(event, self.world.now)
        self.truths.told(event)

    def _on_telegram(self, drive: Drive, word: int) -> None:
        self.oracle.telegram(drive, self.world.now, word)
        before, self.before_telegram = self.before_telegram, lambda: None
        before()

    def _on_answer(self, number: int, outcome: Outcome) -> None:
        self.world.tell(f"request {number} {outcome.code} {outcome.forwarded}")
        self.answers.answered(("", number), outcome, self.world.now)

    def _on_refused(self, drive: Drive, setpoint: int, sent: float, code: int) -> None:
        self.answers.refused(drive, setpoint, sent, self.world.now, code)

    def _on_start(self) -> None:
        self.oracle.started()
        self.witnessed.restarted(self.world.now)
        self.debts.started()
        self.truths.started()
        self.disturbed()

    def on_still(self, now: float) -> None:
        self._silent_since = now
        self.disturbed()

    def on_going_on(self, since: float, now: float) -> None:
        self.disturbed()

    def on_end(self, now: float) -> None:
        self._silent_since = now
        self.answers.ended(now)
        self.disturbed()
        self.world.after(self.down_s, self.bridge.restart)

    def disturbed(self) -> None:
        for judge in (self.answers, self.causes, self.debts, self.outputs, self.summaries, self.truths):
            judge.disturbed(self.world.now)
        self.ways.excuse(self.world.now)

    def loud(self, seconds: float) -> None:
        """Frames may be lost from now on for so long."""
        self._loud_until = max(self._loud_until, self.world.now + seconds + _QUIET_S)

    def is_quiet(self) -> bool:
        """Whether frames reach everybody, and have done so for a while."""
        return self.world.now > self._loud_until

    def _on_trip(self, drive: Drive, since: float, due: float) -> None:
        what = f"the controller of {drive.path} was silent for too long"
        self.causes.owes(EventKind.WATCHDOG, drive.path, since - _ROUND_S, due + _ROUND_S, what)

    def _on_stop(self, drive: Drive, told: float) -> None:
        def look() -> None:
            process, now = self.bridge.process, self.world.now
            # A node in Stopped may be all that a drive has to say.
            is_told = not self.debts.is_halted(drive.node_id)
            if is_told and not (process.is_dead or process.still_since < now):
                said = self.bridge.good_number(f"{drive.path}/supervision/last_stop")
                self.answers.still_running(drive, told, now, said)

        self.world.after(_ROUND_S, look)

    def _look(self) -> None:
        self.world.after(_LOOK_S, self._look)
        process = self.bridge.process
        now = self.world.now
        is_still = process.is_dead or process.still_since < now
        self.answers.look(now, is_still=is_still or self.bridge.is_ending)
        self.causes.look(now, is_still=is_still or self.bridge.is_ending)
        self.debts.look(now, is_still=is_still)
        if process.is_dead or process.still_since < now:
            for drive in DRIVES:
                self.oracle.dead_for(drive, self._silent_since, now)
            return
        for drive in DRIVES:
            at = f"{drive.path}/supervision"
            self.oracle.published(
                drive,
                self.bridge.good_number(f"{at}/worst_case_stop_ms"),
                self.bridge.good_number(f"{at}/worst_case_bridge_ms"),
            )
            name = f"{drive.path}/status/drive_status_word"
            word, mirrored = self.bridge.good_number(name), self.front.good_number(name)
            if word is not None:
                self.oracle.value(drive, now, int(word))
            if mirrored is not None:
                self.oracle.value(drive, now, int(mirrored), _MIRROR_S)
            said = self.bridge.good_number(f"{at}/last_stop")
            self.answers.last_stop(drive, now, self._last_stops[drive], said)
            self._last_stops[drive] = said
        self.truths.look(now)
        self.summaries.look(now, self.bridge)

    # what happens

    def _doing(self, step: Step) -> Callable[[], None]:
        def do() -> None:
            self.counts[step.what] += 1
            self.world.tell(f"step {step.what} {step.which} {step.seconds} {step.how}")
            if step.what not in CALM:
                self.ways.excuse(self.world.now + step.seconds)
            if step.what != "bus cut":
                self.summaries.busy(self.world.now + length_s(step) + _SETTLES_S)
            _STEPS[step.what](self, step)

        return do

    def node_of(self, drive: Drive) -> FieldNode:
        return next(node for node in self.nodes if node.device.node_id == drive.node_id)

    def controller(self, step: Step) -> Controller:
        return self.controllers[step.which % len(self.controllers)]

    def silence_controller(self, step: Step) -> None:
        controller = self.controller(step)
        controller.is_silent = True
        self.world.after(step.seconds, controller.start)

    def silence_all(self, step: Step) -> None:
        for controller in self.controllers:
            controller.is_silent = True
            self.world.after(step.seconds, controller.start)

    def crash_controller(self, step: Step) -> None:
        controller = self.controller(step)
        controller.crash()
        self.oracle.left(controller.drive, self.world.now)
        self.world.after(step.seconds, controller.start)

    def release(self, step: Step) -> None:
        controller = self.controller(step)
        controller.is_silent = True
        drive = controller.drive
        controller.release(lambda came: self.oracle.released(drive, came, self.world.now))
        self.oracle.left(drive, self.world.now)
        self.world.after(step.seconds, controller.start)

    def jog(self, step: Step) -> None:
        controller = self.controller(step)
        controller.pauses = True
        self.world.after(step.seconds, lambda: setattr(controller, "pauses", False))

    def acknowledge_always(self, step: Step) -> None:
        controller = self.controller(step)
        controller.acknowledges_always = True
        self.world.after(step.seconds, lambda: setattr(controller, "acknowledges_always", False))

    def stop(self, step: Step) -> None:
        self.stop_drive(DRIVES[step.which % len(DRIVES)], step.how)

    def stop_drive(self, drive: Drive, how: str) -> None:
        """An operator stops it."""

        def answered(came: float, outcome: Outcome) -> None:
            now = self.world.now
            self.world.tell(f"{drive.path} {how} answered {outcome.code} {outcome.forwarded}")
            self.ways.stop_asked(drive, now)
            if outcome.ok:
                self.ways.stop_answered(drive, how, came, now, is_forwarded=outcome.forwarded)
                self.oracle.stop_answered(drive, came, now)

        self.ways.stop_asked(drive, self.world.now)
        self.operator.stop(drive, how, answered)

    def stranger(self, step: Step) -> None:
        drive = DRIVES[step.which % len(DRIVES)]
        is_same = step.how == "same host" and drive.protocol == "modbus"
        host = f"127.0.1.{10 + drive.place}" if is_same else "127.0.3.200"
        stranger = Stranger(self.world, self.bridge, drive, host)
        if is_same:
            self.oracle.shared(drive, self.world.now + step.seconds)
        self.world.after(step.seconds, stranger.leave)

    def step_clock(self, step: Step) -> None:
        self.world.wall_step_s += step.seconds


_STEPS: Final[dict[str, Callable[[Plant, Step], None]]] = {
    "controller silent": Plant.silence_controller,
    "all controllers silent": Plant.silence_all,
    "controller crashed": Plant.crash_controller,
    "release": Plant.release,
    "jog": Plant.jog,
    "acknowledges": Plant.acknowledge_always,
    "stop": Plant.stop,
    "stranger": Plant.stranger,
    "hang": hang,
    "kill": kill,
    "front hangs": hang_front,
    "front killed": kill_front,
    "bus off": bus_off,
    "bus cut": cut,
    "noise": noise,
    "node reset": reset_node,
    "node silent": silence_node,
    "clock stepped": Plant.step_clock,
    "outputs stopped": stop_outputs,
    "dead bridge": be_dead,
    **MORE,
}
