"""Deviations of CAN 5000's slave from CiA 301 (ID 441684.06 §7 … §9)."""

from __future__ import annotations

from bridge.canopen.frame import Frame
from bridge.sim.core.communication_settings import PdoSettings
from bridge.sim.stoeber.stoeber_5000 import Stoeber5000
from bridge.sim.stoeber.stoeber_slave import StoeberTpdo


def test_type_254_answers_and_does_not_tell_changes() -> None:
    tpdo, settings = StoeberTpdo(), PdoSettings(0x185, transmission_type=254, inhibit_100us=100)
    assert tpdo.due(settings, lambda: b"a", 1.0) is None
    tpdo.ask()
    assert tpdo.due(settings, lambda: b"a", 1.0) == b"a"
    tpdo.sent(b"a", 1.0)
    assert tpdo.due(settings, lambda: b"b", 2.0) is None
    tpdo.ask()
    assert tpdo.next_deadline(settings) == 1.01
    assert tpdo.due(settings, lambda: b"b", 1.005) is None
    tpdo.start()
    assert tpdo.due(settings, lambda: b"b", 2.0) is None


def test_reset_communication_keeps_what_was_written(bench_of) -> None:
    drive = bench_of(Stoeber5000(5))
    drive.run(0.3)
    drive.write(0x1017, 0, 200, 2)
    drive.nmt(0x82)
    assert drive.read(0x1017, 0) == 200


def test_surplus_bytes_are_ignored_and_an_object_half_covered_stays(bench_of) -> None:
    drive = bench_of(Stoeber5000(5))
    drive.run(0.3)
    drive.nmt(1)
    drive.put(0x205, "00F401FFFF")
    axis = drive.node.axes[0]
    assert axis.setpoint == 500
    drive.put(0x205, "0007")
    assert axis.setpoint == 500


def test_an_emergency_is_sent_in_stopped_too(bench_of) -> None:
    drive = bench_of(Stoeber5000(5))
    drive.run(0.3)
    drive.nmt(2)
    drive.node.fail(41)
    assert Frame(0x085, bytes.fromhex("1043080000000000")).can_id in {
        frame.can_id for frame in drive.run(0.1)
    }
