"""Supervision of the simulated 8400 motec on its bus."""

from __future__ import annotations

from bridge.sim.core.emcy_producer import EmcyProducer
from bridge.sim.core.nmt_slave import SlaveState
from bridge.sim.core.store import Store
from bridge.sim.lenze.lenze_drive import LenzeDrive
from bridge.sim.lenze.lenze_settings import RULES, LenzeCodes, communication
from bridge.sim.lenze.lenze_supervision import LenzeError
from bridge.sim.lenze.lenze_watch import BUS_OFF, LenzeWatch


class Rig:
    def __init__(self, **codes: object) -> None:
        self.codes = LenzeCodes(5, **codes)
        self.drive = LenzeDrive(lambda: self.codes)
        self.emcy = EmcyProducer(Store(lambda: communication(self.codes, (4, 4))), RULES)
        self.watch = LenzeWatch(lambda: self.codes, self.drive, self.emcy)

    def sent(self) -> list[int]:
        return [int.from_bytes(frame[:2], "little") for frame in self.emcy.due(1e9)]


def test_an_rpdo_must_come_again_while_the_node_is_operational() -> None:
    rig = Rig(rpdo_time_ms=[100, 3000], rpdo_reactions=[1, 0])
    assert rig.watch.next_deadline() is None
    rig.watch.nmt_changed(SlaveState.OPERATIONAL, 1.0)
    assert rig.watch.next_deadline() == 1.1
    rig.watch.on_rpdo(0, 1.05)
    assert not rig.watch.expire(1.1)
    assert rig.drive.errors == []
    rig.watch.expire(1.2)
    assert rig.drive.errors == [LenzeError.RPDO1_LATE]
    rig.watch.nmt_changed(SlaveState.PRE_OPERATIONAL, 1.3)
    assert rig.watch.next_deadline() is None


def test_a_lost_heartbeat_is_told_and_leaves_operational() -> None:
    rig = Rig(watched_node=127, watched_ms=200, bus_reactions=[0, 0, 0, 0, 1])
    assert rig.watch.node == 127
    rig.watch.on_heartbeat(b"\x05", 1.0)
    assert rig.watch.expire(1.2)
    assert (rig.sent(), rig.drive.errors) == ([0x8130], [LenzeError.HEARTBEAT])
    rig.watch.on_heartbeat(b"\x05", 2.0)
    assert (rig.sent(), rig.watch.node_status) == ([0], 5)


def test_lengths_bus_and_supply_have_their_messages() -> None:
    rig = Rig(bus_reactions=[1, 1, 0, 0, 0])
    rig.watch.check_length(7, 8)
    rig.watch.check_length(8, 8)
    rig.watch.bus_error(1)
    rig.watch.bus_error(BUS_OFF)
    rig.watch.supply(there=False)
    assert rig.sent() == [0x8210, 0, 0x8100, 0, 0x3100]
    assert set(rig.drive.errors) == {LenzeError.FAULTY_TELEGRAM, LenzeError.BUS_OFF}


def test_one_identifier_for_two_pdos_is_a_collision() -> None:
    rig = Rig()
    settings = communication(rig.codes, (4, 4))
    rig.watch.report(settings)
    assert rig.sent() == []
    settings.tpdo[0].cob_id = settings.rpdo[0].cob_id
    rig.watch.report(settings)
    assert rig.sent() == [0x8150]
