"""What somebody else does while the bridge is dead for long: nobody but the witness can tell."""

from __future__ import annotations

from collections.abc import Callable
from typing import TYPE_CHECKING, Final

from bridge.canopen.frame import Frame
from tests.plant.outputs import stop_outputs
from tests.plant.plan import Step
from tests.plant.third_parties import Intruder
from tests.proof.drives import DRIVES, Drive
from tests.proof.families import CIA402

if TYPE_CHECKING:
    from tests.plant.plant import Plant

_EACH_S: Final = 0.1
_HEARTBEAT: Final = Frame(0x77F, b"\x05")
_NMT: Final = 0x000
_STOP: Final = 0x02
_ACTIVE_S: Final = 1.8
"""By then outputs are active, and their owner is still there."""
_LEAVES: Final = 0.8
"""Part of the time after which an intruder has gone: a bridge that hears one does not begin."""
_WATCHES_US: Final = tuple(drive for drive in DRIVES if drive.family is CIA402)
"""They watch the bridge's heartbeat alone."""
_RUNS_ON: Final = tuple(drive for drive in DRIVES if drive.family is not CIA402)
"""A node in Stopped does not stop them, as far as their manuals say."""


def be_dead(plant: Plant, step: Step) -> None:
    """``how`` says what goes on meanwhile."""
    if plant.bridge.process.is_dead:
        return
    kills_after_s = _ACTIVE_S if step.how == "outputs are active" else 0.0
    plant.world.after(kills_after_s, lambda: _kill(plant, step))
    _WAYS[step.how](plant, step)


def _kill(plant: Plant, step: Step) -> None:
    if not plant.bridge.process.is_dead:
        plant.down_s = step.seconds
        plant.bridge.process.kill(in_turn=False)


def _run_on(plant: Plant, step: Step) -> None:
    """A drive does not see that the bridge is dead."""
    drive = _WATCHES_US[step.which % len(_WATCHES_US)]
    node = plant.node_of(drive)
    _while_dead(plant, step, drive, lambda: node.feed(_HEARTBEAT))


def _take_out(plant: Plant, step: Step) -> None:
    """A tool stops a node by NMT, whose drive may run on."""
    drive = _RUNS_ON[step.which % len(_RUNS_ON)]
    port = plant.wire.port("tool", lambda frame: None)
    plant.world.after(_EACH_S, lambda: port.send(Frame(_NMT, bytes((_STOP, drive.node_id)))))
    _while_dead(plant, step, drive, lambda: None)


def _keep_running(plant: Plant, step: Step) -> None:
    """An intruder repeats the word that runs a drive."""
    drive = DRIVES[step.which % len(DRIVES)]
    intruder = Intruder(plant.world, plant.wire, drive, "rpdo")
    _while_dead(plant, step, drive, lambda: None)
    plant.world.after(_LEAVES * step.seconds, intruder.leave)


def _keep_active(plant: Plant, step: Step) -> None:
    """Outputs are active as it dies."""
    stop_outputs(plant, step._replace(how="acknowledges"))


def _while_dead(plant: Plant, step: Step, drive: Drive, act: Callable[[], None]) -> None:
    """Do it again and again; it is nothing of the bridge's that moves the drive then."""
    ends = plant.world.now + step.seconds

    def cycle() -> None:
        plant.oracle.intruded(drive, plant.world.now)
        if plant.world.now < ends:
            act()
            plant.world.after(_EACH_S, cycle)

    cycle()


_WAYS: Final[dict[str, Callable[[Plant, Step], None]]] = {
    "runs on": _run_on,
    "taken out": _take_out,
    "kept running": _keep_running,
    "outputs are active": _keep_active,
}
