"""The table of the faults, and the order of a cycle."""

from __future__ import annotations

import signal
from collections.abc import Sequence
from typing import Final

from tests.proof import acts, bounds, examine, machine, others
from tests.proof.drives import DRIVES, SPOKEN
from tests.proof.fault import Fault
from tests.proof.rig import Rig
from tests.proof.settings import PLANT

_OF_OWNERS: Final = (bounds.controller, bounds.controller_drive)
_DEAD: Final = (bounds.dead, bounds.dead_drive)
_GONE: Final = (bounds.at_once, bounds.gone_drive)
_ENDING: Final = (bounds.at_once, bounds.at_once_drive)
_OWNERS: Final = len(SPOKEN)
_NODES: Final = len({drive.node for drive in DRIVES})
_NOBODY: Final = ("",)
_SILENT: Final = tuple(drive.node for drive in DRIVES if drive.reaction == "silence") or _NOBODY
_RESERVED: Final = tuple({drive.node for drive in DRIVES if drive.family.reserved})
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
        acts.write_run,
        bounds.asked,
        bounds.asked_drive,
        protocols=("modbus",),
    ),
    Fault(
        "owner's telegrams are not valid",
        "telegram",
        acts.write_invalid,
        acts.write_run,
        *_OF_OWNERS,
        protocols=("modbus",),
        nodes=("conveyor",),
        is_long=True,
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
    Fault(
        "deaf drive whose owner jogs",
        "moment",
        others.jog,
        others.let_hear,
        None,
        others.jogged,
        nodes=(others.VICTIM.node,),
        steady=others.make_deaf,
        is_long=True,
    ),
    Fault(
        "stop asked for in a silence",
        "moment",
        acts.now,
        examine.continue_silent,
        nodes=_SILENT,
        is_long=True,
        others_may_stop=True,
        examine=examine.stop_in_silence,
        demand="a stop by anybody goes out once, and silence follows; the answer is *forwarded* then, and "
        "*not forwarded* where nothing was sent",
    ),
    Fault(
        "stop of outputs that their silent owner's time-out holds",
        "moment",
        acts.now,
        acts.nothing,
        is_long=True,
        examine=examine.stop_of_held_outputs,
        demand="a stop by anybody makes them safe, and is answered *forwarded*",
        of_outputs=True,
    ),
    Fault(
        "acknowledge after somebody's stop",
        "moment",
        acts.now,
        acts.write_run,
        protocols=("modbus",),
        is_long=True,
        examine=examine.acknowledge_after_stop,
        demand="the drive stays stopped, though its owner acknowledges in each cycle and goes on enabling",
    ),
    Fault(
        "acknowledge after somebody's stop of outputs",
        "moment",
        acts.now,
        acts.nothing,
        is_long=True,
        examine=examine.acknowledge_after_stop_of_outputs,
        demand="they stay safe, though their owner acknowledges in each cycle and goes on with its telegram",
        of_outputs=True,
    ),
    Fault(
        "second connection of the owner's address",
        "moment",
        acts.now,
        acts.nothing,
        protocols=("modbus",),
        is_long=True,
        examine=examine.alternate,
        demand="each of its words is refused, and it is named; the drive moves on all the time",
    ),
    Fault(
        "what moves a drive as a parameter",
        "moment",
        acts.now,
        acts.nothing,
        nodes=_RESERVED,
        is_long=True,
        examine=examine.set_what_moves,
        demand="each write is refused and none reaches the node: command words for everybody, what stops the "
        "drive for who is no engineer",
    ),
    Fault("network cut", "telegram", acts.cut, acts.uncut, *_OF_OWNERS, at_once=_OWNERS),
    Fault(
        "half-open connection",
        "telegram",
        acts.vanish,
        acts.come_back,
        *_OF_OWNERS,
        at_once=_OWNERS,
        hands_over=True,
    ),
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
        "OPC UA front stopped",
        "telegram",
        acts.signal_front("opcua", signal.SIGSTOP),
        acts.continue_front("opcua"),
        *_OF_OWNERS,
        protocols=("opcua",),
        ends_soon=True,
    ),
    Fault(
        "zenoh front stopped",
        "telegram",
        acts.signal_front("zenoh", signal.SIGSTOP),
        acts.continue_front("zenoh"),
        *_OF_OWNERS,
        protocols=("zenoh",),
        ends_soon=True,
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
        lacks=others.owed_stop,
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
        speaks_on=True,
    ),
    Fault(
        "intruder that is a master",
        "moment",
        others.intrude_as_master,
        others.end_intruder,
        None,
        others.answered,
        nodes=(others.VICTIM.node,),
        is_long=True,
        brings_back=True,
    ),
    Fault(
        "OPC UA front killed",
        "telegram",
        acts.signal_front("opcua", signal.SIGKILL),
        acts.wait_front("opcua"),
        *_OF_OWNERS,
        protocols=("opcua",),
        new_process=True,
    ),
    Fault(
        "zenoh front killed",
        "telegram",
        acts.signal_front("zenoh", signal.SIGKILL),
        acts.wait_front("zenoh"),
        *_OF_OWNERS,
        protocols=("zenoh",),
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
