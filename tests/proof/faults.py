"""The faults: how each is brought about and undone, from when its time counts, and its bound."""

from __future__ import annotations

import signal
from collections.abc import Callable, Sequence
from dataclasses import dataclass
from typing import Final, Literal

from tests.proof import acts, bounds, machine, others
from tests.proof.bounds import Bound
from tests.proof.drives import DRIVES, PROTOCOLS, Drive
from tests.proof.rig import Rig
from tests.proof.settings import PLANT

_SELDOM: Final = 3

Reference = Literal["telegram", "moment", "send", "sign of life", "boot-up"]


@dataclass(frozen=True, slots=True)
class Fault:
    """Drives of other protocols than ``protocols`` are to go on, and of other nodes than ``nodes`` where
    there are any. ``steady``: what of the fault is to stop no drive comes first. ``at_once``: to how many
    owners, connections or nodes a round does it; each of them counts. ``leaves_silence``: the bridge does not
    answer it with a stop: it is not there, or its bus is not. ``new_process``: a process is started anew for
    it, which takes its time. ``others_may_stop``: drives that it does not concern. Without a ``bus_bound``
    somebody else speaks there; without a ``drive_bound`` the drive says nothing."""

    name: str
    reference: Reference
    inject: acts.Inject
    undo: Callable[[Rig], None]
    bus_bound: Bound | None
    drive_bound: Bound | None
    protocols: tuple[str, ...] = PROTOCOLS
    nodes: tuple[str, ...] = ()
    steady: Callable[[Rig], None] | None = None
    possible: Callable[[], bool] = lambda: True
    at_once: int = 1
    leaves_silence: bool = False
    new_process: bool = False
    others_may_stop: bool = False

    @property
    def per_round(self) -> int:
        """What a round is worth: a new process takes its time, so such a fault is injected less often."""
        return self.at_once * (_SELDOM if self.new_process else 1)

    def rounds(self, times: int) -> int:
        """How many rounds are needed for what is asked for as ``times``."""
        return -(-times // self.per_round)

    def is_due(self, cycle: int, cycles: int) -> bool:
        """Whether it has a round in this one of ``cycles``, over which its rounds are spread evenly."""
        rounds = self.rounds(cycles)
        return (cycle + 1) * rounds // cycles > cycle * rounds // cycles

    @property
    def of_controller(self) -> bool:
        return self.reference in ("telegram", "send")

    def concerns(self, drive: Drive) -> bool:
        return drive.protocol in self.protocols and (not self.nodes or drive.node in self.nodes)

    def goes_on(self, drive: Drive) -> bool:
        """The drive is to move on all the time: the fault is not its own, or is only reported."""
        return not self.concerns(drive) or (self.of_controller and drive.reaction == "hold")

    def falls_silent(self, drive: Drive) -> bool:
        """What stops the drive is that its RPDOs end."""
        return self.leaves_silence or (self.of_controller and drive.reaction == "silence")


_OF_OWNERS: Final = (bounds.controller, bounds.controller_drive)
_DEAD: Final = (bounds.dead, bounds.dead_drive)
_GONE: Final = (bounds.at_once, bounds.gone_drive)
_ENDING: Final = (bounds.at_once, bounds.at_once_drive)
_OWNERS: Final = len(PROTOCOLS)
_NODES: Final = len({drive.node for drive in DRIVES})
FAULTS: Final = (
    Fault("owner stopped", "telegram", acts.stop_owners, acts.continue_owners, *_OF_OWNERS, at_once=_OWNERS),
    Fault(
        "owner killed",
        "telegram",
        acts.signal_owners(signal.SIGKILL),
        acts.new_owners,
        *_OF_OWNERS,
        at_once=_OWNERS,
    ),
    Fault(
        "owner stopped beside strangers",
        "telegram",
        acts.stop_owners_among_others,
        acts.continue_owners_alone,
        *_OF_OWNERS,
        at_once=_OWNERS,
    ),
    Fault(
        "drive released",
        "moment",
        acts.release_drives,
        acts.continue_modbus,
        bounds.asked,
        bounds.asked_drive,
        protocols=("modbus",),
    ),
    Fault(
        "client writes ahead and hangs",
        "send",
        others.write_ahead,
        others.stop_writing_ahead,
        *_OF_OWNERS,
        protocols=("modbus",),
        others_may_stop=True,
    ),
    Fault(
        "deaf drive",
        "telegram",
        acts.stop_owners,
        others.let_hear,
        bounds.controller,
        others.ignored_drive,
        steady=others.make_deaf,
    ),
    Fault("network cut", "telegram", acts.cut, acts.uncut, *_OF_OWNERS, at_once=_OWNERS),
    Fault("half-open connection", "telegram", acts.vanish, acts.come_back, *_OF_OWNERS, at_once=_OWNERS),
    Fault("disk full", "telegram", acts.stop_owners, acts.empty, *_OF_OWNERS, steady=acts.full),
    Fault(
        "clock stepped by an hour",
        "telegram",
        acts.stop_owners,
        acts.continue_owners,
        *_OF_OWNERS,
        steady=acts.step_clock,
        possible=machine.is_user_mode,
    ),
    Fault(
        "front stopped",
        "telegram",
        acts.signal_front(signal.SIGSTOP),
        acts.continue_front,
        *_OF_OWNERS,
        protocols=("opcua",),
    ),
    Fault(
        "node silent",
        "sign of life",
        acts.silence,
        acts.speak,
        bounds.lost,
        bounds.lost_drive,
        at_once=_NODES,
    ),
    Fault(
        "bus process paused",
        "moment",
        acts.pause_bridge,
        acts.nothing,
        bounds.dead,
        bounds.after(PLANT.paused_s),
        leaves_silence=True,
    ),
    Fault(
        "bus process paused with a frame of a second bridge waiting",
        "moment",
        others.pause_beside_twin,
        acts.nothing,
        bounds.dead,
        bounds.given_way(PLANT.paused_s),
        leaves_silence=True,
    ),
    Fault(
        "bus process stopped as it sends",
        "moment",
        acts.pause_as_it_sends,
        acts.nothing,
        bounds.dead,
        bounds.after(PLANT.paused_s),
        leaves_silence=True,
    ),
    Fault(
        "bus process stopped", "moment", acts.stop_bridge, acts.continue_bridge, *_DEAD, leaves_silence=True
    ),
    Fault(
        "bus process killed",
        "moment",
        Rig.kill_bridge,
        acts.renew_bridge,
        *_DEAD,
        leaves_silence=True,
        new_process=True,
    ),
    Fault("event loop blocked for 1 s", "moment", acts.block_loop, acts.nothing, *_DEAD, leaves_silence=True),
    Fault("interface down", "moment", acts.link_down, acts.link_up, *_GONE, leaves_silence=True),
    Fault(
        "interface down for 50 ms",
        "moment",
        acts.flap,
        acts.nothing,
        bounds.at_once,
        bounds.booted_drive,
        leaves_silence=True,
    ),
    Fault("bus-off", "moment", acts.bus_off, acts.bus_restarted, *_GONE, leaves_silence=True),
    Fault("node rebooting", "boot-up", acts.reboot, acts.nothing, bounds.lost, None, at_once=_NODES),
    Fault(
        "pause of the bridge across the deadline",
        "telegram",
        acts.pause_across_deadline,
        acts.continue_owners,
        bounds.controller,
        bounds.controller_and_bridge_drive,
        leaves_silence=True,
    ),
    Fault(
        "intruder on an RPDO",
        "moment",
        others.intrude,
        others.end_intruder,
        None,
        bounds.node_stopped,
        nodes=(others.VICTIM.node,),
    ),
    Fault(
        "intruder that is a master",
        "moment",
        others.intrude_as_master,
        others.end_intruder,
        None,
        bounds.node_stopped,
        nodes=(others.VICTIM.node,),
    ),
    Fault(
        "front killed",
        "telegram",
        acts.signal_front(signal.SIGKILL),
        acts.wait_front,
        *_OF_OWNERS,
        protocols=("opcua",),
        new_process=True,
    ),
    Fault(
        "SIGHUP to the bus process",
        "moment",
        acts.end_bridge(signal.SIGHUP),
        acts.renew_bridge,
        *_ENDING,
        new_process=True,
    ),
    Fault(
        "SIGTERM to the bus process",
        "moment",
        acts.end_bridge(signal.SIGTERM),
        acts.renew_bridge,
        *_ENDING,
        new_process=True,
    ),
    Fault(
        "front killed, starts fail",
        "telegram",
        others.kill_front_and_keep_it_down,
        others.let_front_up,
        *_OF_OWNERS,
        protocols=("opcua",),
        new_process=True,
    ),
    Fault(
        "second bridge",
        "telegram",
        acts.stop_owners,
        others.end_second_bridge,
        *_OF_OWNERS,
        steady=others.start_second_bridge,
        new_process=True,
    ),
    Fault(
        "boot-up fails after a restart",
        "moment",
        others.restart_unbooted,
        others.let_boot,
        None,
        bounds.at_once_drive,
        nodes=(others.VICTIM.node,),
        new_process=True,
        others_may_stop=True,
    ),
)
"""In the order of a cycle. A service that is started anew in the middle has forgotten which nodes it has lost
again and again, and how often its front has ended: it waits for neither longer than it has to."""


def in_turn(faults: Sequence[Fault]) -> list[Fault]:
    """The order of a cycle. Nodes that are lost again within half a minute are asked later each time, so the
    faults that lose them come in two bunches, with half of the others after each."""
    losing = [fault for fault in faults if fault.leaves_silence and not fault.new_process]
    others = [fault for fault in faults if fault not in losing]
    half = len(others) // 2
    return [*losing[::2], *others[:half], *losing[1::2], *others[half:]]
