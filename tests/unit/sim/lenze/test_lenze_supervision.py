"""Emergency messages of the simulated 8400 motec."""

from __future__ import annotations

from bridge.sim.core.communication_settings import CobId, CommunicationSettings, SlaveRules
from bridge.sim.core.emcy_producer import EmcyProducer
from bridge.sim.core.store import Store
from bridge.sim.lenze.lenze_supervision import HEARTBEAT_LOST, SUPPLY_FAILED, ErrorReporter


class Rig:
    def __init__(self) -> None:
        store = Store(lambda: CommunicationSettings(emcy=CobId(0x85), sdo=[]))
        self.emcy = EmcyProducer(store, SlaveRules())
        self.reporter = ErrorReporter(self.emcy)

    def sent(self) -> list[str]:
        return [frame.hex().upper() for frame in self.emcy.due(1.0)]


def test_an_error_is_told_once_when_it_comes_and_once_when_it_goes() -> None:
    rig = Rig()
    for _ in range(3):
        rig.reporter.communication_error(HEARTBEAT_LOST, is_there=True)
    assert rig.sent() == ["3081110000000000"]
    for _ in range(3):
        rig.reporter.communication_error(HEARTBEAT_LOST, is_there=False)
    assert rig.sent() == ["0000000000000000"]


def test_the_supply_is_no_error_of_communication_and_a_drives_has_its_number() -> None:
    rig = Rig()
    rig.reporter.communication_error(SUPPLY_FAILED, is_there=True)
    assert rig.reporter.device_errors([7])
    assert not rig.reporter.device_errors([7])
    assert rig.sent() == ["0031010000000000", "00F0010007000000"]
    assert rig.reporter.device_errors([])
    assert rig.sent() == ["0000010000000000"], "the supply is still there as an error"
    rig.reporter.reset()
    assert rig.emcy.error_register == 0
