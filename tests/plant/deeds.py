"""What happens to a plant by somebody beside bridge, bus and controllers, and in several steps of its own."""

from __future__ import annotations

from collections.abc import Callable
from functools import partial
from random import Random
from typing import TYPE_CHECKING, Final

from bridge.canopen.frame import Frame
from bridge.command import Code, EventKind, Identity, Outcome, Request, SetTimeout, Source, WriteParameter
from tests.plant.bridge_process import Bridge
from tests.plant.clients import Line, read, writes
from tests.plant.hoist import position
from tests.plant.keypad import answer_otherwise, change, run_in_other_set
from tests.plant.machine import LOOK_S
from tests.plant.plan import Step
from tests.plant.summaries import ALARM, DANGER
from tests.plant.third_parties import Intruder
from tests.proof.block import BLOCK
from tests.proof.drives import DRIVES
from tests.proof.families import CIA402, NORD
from tests.proof.settings import PLANT

if TYPE_CHECKING:
    from tests.plant.plant import Plant

_ROUND_S: Final = 0.25
_FOUND_S: Final = 0.5
"""An intruder's frame is found by then (docs: 10 ms; one that repeats what the bridge sends, later)."""
_TOLD_EACH_S: Final = 10.5
"""One that goes on, or comes again, is told each 10 s."""
_ORDER_S: Final = 3.0
"""By then a bridge that was passive acts again."""
_TIMEOUT_S: Final = PLANT.fieldbus_timeout_ms / 1000
_HEARTBEAT: Final = 0x77F
_OPERATIONAL, _PRE_OPERATIONAL = b"\x05", b"\x7f"
_EACH_S: Final = 0.1
_DELAY_S: Final = 0.002
_EXCEPTION: Final = 0x80
_SET_TIMEOUT: Final = 12
_LONG_MS: Final = 5 * PLANT.fieldbus_timeout_ms
_DEAF_S: Final = 5.0
"""By then a drive is taken for one that ignores its stop: 1.5 s in the site file, three TPDOs, and what a
process that is late takes."""
_EARLY_S: Final = 0.04
_JOGS_S: Final = 25.0
"""By then the stops of one that jogs come to as much."""
_FOR_GOOD_S: Final = 11.5
"""So long one goes on that nothing stops: by then the witness has told, too."""
_NMT: Final = 0x000
_VICTIMS: Final = tuple(drive for drive in DRIVES if drive.family is CIA402)
"""They watch the bridge's heartbeat, and no RPDO: so nothing but their words stops them."""
_RESERVED: Final = tuple(drive for drive in DRIVES if drive.family.reserved)
_NORDS: Final = tuple(drive for drive in DRIVES if drive.family is NORD)
_SILENT: Final = tuple(drive for drive in DRIVES if drive.reaction == "silence") or DRIVES
_REACHES_NODE: Final = (Code.OK, Code.REFUSED_BY_DRIVE, Code.TIMED_OUT)


def half_open(plant: Plant, step: Step) -> None:
    """Nothing gets through between the controller's machine and ours, and nobody is told."""
    controller = plant.controller(step)
    stream = controller.line.stream if controller.line else None
    if stream is None:
        plant.silence_controller(step)
        return
    stream.is_cut = True
    plant.world.after(step.seconds, stream.mend)


def backlog(plant: Plant, step: Step) -> None:
    """A controller writes ahead while the bridge stands still for a moment, and hangs."""
    controller = plant.controller(step)
    plant.bridge.process.hang(PLANT.short_s, in_turn=False)
    controller.write_ahead(int(step.how))
    plant.world.after(step.seconds, controller.start)


def slow(plant: Plant, step: Step) -> None:
    """The machine is busy: whatever the bridge does takes longer."""
    process = plant.bridge.process
    process.look_s = float(step.how)
    plant.world.after(step.seconds, lambda: setattr(process, "look_s", LOOK_S))


def start_by_command(plant: Plant, step: Step) -> None:
    """A controller starts its drive by a command and not by words."""
    able = [one for one in plant.controllers if one.line is None]
    controller = able[step.which % len(able)]
    controller.start_by_command(stands=step.how == "stands")
    plant.world.after(step.seconds, controller.go_on_by_words)


def put_in_order(plant: Plant) -> None:
    """An operator starts what was stopped."""
    plant.operator.start_nodes(sorted({drive.node for drive in DRIVES}))


def intrude(plant: Plant, step: Step) -> None:
    """A tool commands a node for a while; afterwards an operator starts what was stopped for it."""
    drive = DRIVES[step.which % len(DRIVES)]
    intruder = Intruder(plant.world, plant.wire, drive, step.how)
    now = plant.world.now
    quiet = partial(bool, plant.is_quiet())
    if plant.is_quiet() and now > plant.intruder_at + _TOLD_EACH_S:
        what = f"an intruder's {step.how} at {drive.path}"
        plant.causes.owes(EventKind.INTRUDER, plant.wire.name, now, now + _FOUND_S + step.seconds, what)
    if plant.is_quiet() and step.how != "nmt":
        plant.debts.intruded(drive, step.how, now)

    shown_at = now + _FOUND_S + step.seconds
    plant.summaries.wrong(None, ALARM, now, shown_at, shown_at + _ORDER_S, f"an intruder's {step.how}", quiet)

    def goes_on() -> None:
        plant.intruder_at = plant.world.now
        plant.summaries.intruded(plant.world.now)
        plant.oracle.intruded(drive, plant.world.now)
        if plant.world.now < now + step.seconds:
            plant.world.after(_ROUND_S, goes_on)

    def leave() -> None:
        intruder.leave()
        plant.oracle.intruded(drive, plant.world.now)
        if step.how == "master" and plant.is_quiet():
            plant.debts.master_left(drive, plant.world.now)
        plant.world.after(_ORDER_S, lambda: put_in_order(plant))

    goes_on()
    plant.world.after(step.seconds, leave)


def second_bridge(plant: Plant, step: Step) -> None:
    """Another bridge with the same site file, which no controller knows."""
    if plant.second is not None:
        return
    rng = Random(f"{plant.plan.seed} second {step.at}")
    wires = {plant.wire.name: plant.wire}
    plant.summaries.intruded(plant.world.now + step.seconds)
    second = plant.second = Bridge(plant.world, plant.project, wires, "two", rng)

    def leave() -> None:
        second.process.kill(in_turn=False)
        plant.second = None
        plant.world.after(_ORDER_S, lambda: put_in_order(plant))

    plant.world.after(step.seconds, leave)


def twin(plant: Plant, step: Step) -> None:
    """A frame of a second bridge waits for one that has stood still."""
    process, world = plant.bridge.process, plant.world
    process.hang(step.seconds, in_turn=False)
    since = process.still_since
    if since != world.now or not plant.is_quiet():
        return
    plant.summaries.intruded(world.now + step.seconds)
    port = plant.wire.port("twin", lambda frame: None)
    world.after(step.seconds / 2, lambda: port.send(Frame(_HEARTBEAT, _PRE_OPERATIONAL)))
    world.after(step.seconds, lambda: plant.debts.gives_way(since, world.now))
    world.after(step.seconds + _ORDER_S, lambda: put_in_order(plant))


def end(plant: Plant, step: Step) -> None:
    """The service is ended by a signal, and begun anew."""
    if plant.bridge.process.is_dead or plant.bridge.is_ending:
        return

    def told() -> None:
        # From now on nobody owns a drive, and each is stopped: nobody trips, and no setpoint goes out.
        now = plant.world.now
        plant.causes.disturbed(now)
        plant.answers.disturbed(now)
        plant.debts.ending(now)

    plant.down_s = step.seconds
    plant.bridge.end(told, lambda: plant.debts.ended(plant.world.now))


def deaf(plant: Plant, step: Step) -> None:
    """A drive does not hear its RPDO any more, and its controller is silent, or jogs; or it hears no NMT
    either, and nothing stops it."""
    drive = _VICTIMS[step.which % len(_VICTIMS)]
    node, controller, now = plant.node_of(drive), plant.controllers[drive.place], plant.world.now
    node.deaf_to = (drive.rpdo, _NMT) if step.how == "to everything" else (drive.rpdo,)
    if step.how == "jogs":
        controller.stops_long = True
        plant.debts.deaf(drive, now, _JOGS_S)
    else:
        controller.is_silent = True
        plant.debts.deaf(drive, now, _TIMEOUT_S + _DEAF_S)
    lasts_s = max(step.seconds, {"jogs": _JOGS_S + 1.0, "to everything": _FOR_GOOD_S}.get(step.how, 0.0))
    plant.witnessed.deaf(drive, now + lasts_s)
    plant.summaries.busy(now + lasts_s + 2 * _ORDER_S)
    if step.how == "to everything":
        ignores = partial(plant.debts.ignores, drive, now)
        text = f"{drive.path} ignores its stop"
        plant.summaries.wrong(
            drive.node, DANGER, now, now + _TIMEOUT_S + _DEAF_S, now + lasts_s, text, ignores
        )

    def hears() -> None:
        node.deaf_to = ()
        controller.stops_long = False
        put_in_order(plant)
        controller.start()

    plant.world.after(lasts_s, hears)


def unbooted(plant: Plant, step: Step) -> None:
    """The bridge starts anew, and cannot boot a node that runs and knows of nothing."""
    drive = _VICTIMS[step.which % len(_VICTIMS)]
    node, world = plant.node_of(drive), plant.world
    if plant.bridge.process.is_dead:
        return
    begins = plant.bridge.starts
    node.is_mute = True
    plant.down_s = _EACH_S
    plant.bridge.process.kill(in_turn=False)

    def feed() -> None:
        if plant.bridge.starts == begins or world.now < plant.bridge.started_at + 1.0:
            node.feed(Frame(_HEARTBEAT, _OPERATIONAL))
            world.after(_EACH_S, feed)

    def answers() -> None:
        node.is_mute = False
        put_in_order(plant)

    feed()
    world.after(step.seconds, answers)


def forget_acknowledge(plant: Plant, step: Step) -> None:
    """A controller that was silent for too long goes on without an acknowledge."""
    controller = plant.controller(step)
    controller.is_silent, controller.acknowledges = True, False

    def acknowledges() -> None:
        controller.acknowledges = True

    plant.world.after(_TIMEOUT_S + 0.3, controller.start)
    plant.world.after(_TIMEOUT_S + step.seconds, acknowledges)


def pause_at_deadline(plant: Plant, step: Step) -> None:
    """A controller is silent, and the bridge stands still as its time runs out."""
    controller, world = plant.controller(step), plant.world
    controller.is_silent = True
    due = plant.oracle.tracks[controller.drive].last_at + _TIMEOUT_S
    if due > world.now:
        early_s = Random(f"{plant.plan.seed} early {step.at}").uniform(0.0, _EARLY_S)
        world.at(due - early_s, lambda: plant.bridge.process.hang(step.seconds, in_turn=False))
    world.after(_TIMEOUT_S + 2.0, controller.start)


def write_invalid(plant: Plant, step: Step) -> None:
    """A controller goes on with words that are not valid."""
    if not _NORDS:
        return
    controller = plant.controllers[_NORDS[step.which % len(_NORDS)].place]
    controller.is_invalid = True
    plant.world.after(step.seconds, lambda: setattr(controller, "is_invalid", False))


def _each(plant: Plant, seconds: float, act: Callable[[], None]) -> None:
    ends = plant.world.now + seconds

    def cycle() -> None:
        if plant.world.now < ends:
            act()
            plant.world.after(_EACH_S, cycle)

    cycle()


def reads(plant: Plant, step: Step) -> None:
    """Another machine reads all that the drive is told."""
    drive = DRIVES[step.which % len(DRIVES)]
    line = Line(plant.world, plant.bridge, "127.0.3.202", lambda data: None)
    line.connect()
    _each(plant, step.seconds, lambda: line.ask(drive.unit, read(0, 2)))
    plant.world.after(step.seconds, line.leave)


def set_timeout(plant: Plant, step: Step) -> None:
    """Another machine gives the drive's owner a longer time-out."""
    drive = DRIVES[step.which % len(DRIVES)]
    line = Line(plant.world, plant.bridge, "127.0.3.203", lambda data: None)
    line.connect()

    def wrong() -> None:
        plant.oracle.wrong(plant.world.now, f"{drive.path}: somebody else sets its owner's time-out")

    def answered(pdu: bytes) -> None:
        if not pdu[0] & _EXCEPTION:
            wrong()

    def on_outcome(outcome: Outcome) -> None:
        if outcome.ok:
            wrong()

    def act() -> None:
        line.ask(drive.unit, writes(_SET_TIMEOUT, _LONG_MS), answered)
        who = Identity(Source.OPCUA, "operator", connection="session 98")
        plant.bridge.ask(Request(who, drive.path, SetTimeout(_LONG_MS)), _DELAY_S, lambda: None, on_outcome)

    _each(plant, step.seconds, act)
    plant.world.after(step.seconds, line.leave)


def stop_in_silence(plant: Plant, step: Step) -> None:
    """A controller is silent, and somebody asks for stops, again and again: of a drive that is to be silent
    then, where there is one."""
    controller = plant.controllers[_SILENT[step.which % len(_SILENT)].place]
    controller.is_silent = True
    for place, how in enumerate(("quick_stop", "quick_stop", "disable_voltage", "disable_voltage")):
        after_s = _TIMEOUT_S + 0.5 + 1.2 * place
        plant.world.after(after_s, lambda how=how: plant.stop_drive(controller.drive, how))
    plant.world.after(_TIMEOUT_S + 5.0 + step.seconds, controller.start)


def set_reserved(plant: Plant, step: Step) -> None:
    """Somebody who is no engineer sets, as parameters, what moves a drive or outputs and what stops them."""
    drive = _RESERVED[step.which % len(_RESERVED)]
    who = Identity(Source.ZENOH, "colleague", sets_parameters=True)

    def sets(path: str, name: str, value: int) -> None:
        def answered(outcome: Outcome) -> None:
            if outcome.code in _REACHES_NODE:
                text = f"{path}: {name} is set by who may not ({outcome.code})"
                plant.oracle.wrong(plant.world.now, text)

        plant.bridge.ask(Request(who, path, WriteParameter(name, value)), _DELAY_S, lambda: None, answered)

    for one in drive.family.reserved:
        sets(drive.path, one.name, one.value)
    for name in BLOCK.reserved:
        sets(BLOCK.path, name, 0)


MORE: Final[dict[str, Callable[[Plant, Step], None]]] = {
    "half open": half_open,
    "backlog": backlog,
    "box slow": slow,
    "starts by command": start_by_command,
    "intruder": intrude,
    "second bridge": second_bridge,
    "twin": twin,
    "end": end,
    "deaf": deaf,
    "unbooted": unbooted,
    "no acknowledge": forget_acknowledge,
    "pause at the deadline": pause_at_deadline,
    "invalid telegrams": write_invalid,
    "reads": reads,
    "sets time-out": set_timeout,
    "stops in a silence": stop_in_silence,
    "reserved parameter": set_reserved,
    "late answers": answer_otherwise,
    "wrong answers": answer_otherwise,
    "keypad": change,
    "other set": run_in_other_set,
    "positions": position,
}
"""Kinds of steps (tests/plant/plan.py), and what they do."""
CALM: Final = (
    "controller silent",
    "all controllers silent",
    "controller crashed",
    "stop",
    "no acknowledge",
    "invalid telegrams",
    "reads",
    "sets time-out",
    "stops in a silence",
    "outputs stopped",
    "reserved parameter",
    "late answers",
    "wrong answers",
    "keypad",
    "other set",
    "positions",
    "clock stepped",
)
"""Kinds beside which it is known why a drive is stopped."""
