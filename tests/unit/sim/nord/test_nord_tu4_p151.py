"""The bus interface SK TU4-CAO: P151 and P513, when the telegrams stop (BU 2500 §6.4, §7.1, §8)."""

from __future__ import annotations

import pytest

from bridge.canopen.frame import Frame
from bridge.sim.nord.nord_states import NordState

P151, P160, P161, P162, P163, P164, P165, P166, P167 = 0x2097, *range(0x20A0, 0x20A8)
P170, P173, P176, P177 = 0x20AA, 0x20AD, 0x20B0, 0x20B1
P513, P700, P701 = 0x2201, 0x22BC, 0x22BD


def emcys(bench) -> list[str]:
    return [data.hex().upper() for _, data in bench.of(0x085)]


def test_p151_trips_every_drive_when_the_telegrams_stop(watched):
    watched.run(0.099)
    assert watched.node.drives[0].state is NordState.ENABLED
    watched.run(0.002)
    assert [drive.state for drive in watched.node.drives] == [NordState.FAULT_REACTION] * 4
    assert watched.node.drives[0].output_hz == 0.0
    assert emcys(watched) == [f"008111{drive:02X}00000000" for drive in range(4)]
    watched.run(0.1)
    assert [watched.answer(drive)[0] & 0x4F for drive in (1, 2, 3, 4)] == [0x08] * 4
    assert (watched.read(P700, 1), watched.read(P701, 1)) == (103, 103)
    assert (watched.read(P170, 1), watched.read(P170, 2)) == (1020, 0)
    assert watched.read(P173, 1) & 0x08
    assert watched.read(0x1001, 0) == 0x11
    assert watched.read(0x1003, 0) == 4


def test_the_interface_forgives_and_the_drive_wants_the_acknowledge(watched):
    watched.run(0.2)
    watched.command(0x047F, 0x2000)
    assert (watched.read(P170, 1), watched.read(P170, 2)) == (0, 1020)
    assert not watched.read(P173, 1) & 0x08
    assert watched.node.drives[0].state is NordState.FAULT
    watched.command(0x04FF, 0x2000)
    assert watched.node.drives[0].state is NordState.SWITCH_ON_INHIBITED
    assert emcys(watched)[4:] == ["0000110000000000"], "FU2…4 still have their fault"
    for drive in (2, 3, 4):
        watched.command(0x0480, drive=drive)
    assert emcys(watched)[5:] == ["0000110100000000", "0000110200000000", "0000000300000000"]
    watched.command(0x047E, 0x2000)
    watched.command(0x047F, 0x2000)
    watched.run(0.05)
    assert watched.node.drives[0].state is NordState.ENABLED


def test_p151_waits_for_the_first_valid_telegram(make_bench):
    bench = make_bench(operational=True, p151_ms=100)
    bench.run(5.0)
    bench.command(0x007E)  # bit 10 is missing
    bench.run(5.0)
    assert bench.node.drives[0].fault_tenths == 0
    bench.command(0x0400)  # valid, though it commands nothing
    bench.run(0.2)
    assert bench.node.drives[0].fault_tenths == 103


def test_any_drives_telegram_restarts_p151(watched):
    for drive in (2, 3, 4, 2):
        watched.run(0.09)
        watched.command(0x0400, drive=drive)
    assert watched.node.drives[0].state is NordState.ENABLED


@pytest.mark.landing(7)
@pytest.mark.parametrize(
    "frame",
    [
        Frame(0x205, bytes.fromhex("7F00002000000000")),  # "control data valid" is 0
        Frame(0x205, bytes.fromhex("7F040020")),  # two words
        Frame(0x205, bytes.fromhex("7F040020000000")),
        Frame(0x080, b""),
        Frame(0x605, bytes.fromhex("4008100000000000")),
        Frame(0x605, bytes.fromhex("2B0030017F040000")),  # control word by SDO
        Frame(0x245, bytes.fromhex("FFFF")),  # PDO5 carries no control word
    ],
    ids=["invalid", "two words", "seven bytes", "sync", "sdo", "control word by sdo", "pdo5"],
)
def test_other_traffic_does_not_restart_p151(watched, frame):
    for _ in range(4):
        watched.run(0.03)
        watched.put(frame.can_id, frame.data)
    assert watched.node.drives[0].fault_tenths == 103


def test_synchronous_telegrams_count_when_the_sync_comes(watched):
    watched.write(0x1400, 2, 1, 1)
    for _ in range(3):
        watched.run(0.04)
        watched.command(0x047F, 0x2000)
    assert watched.node.drives[0].fault_tenths == 103, "no SYNC, no telegram"


@pytest.mark.parametrize("command", [0x80, 0x02, 0x82], ids=["pre-op", "stop", "reset communication"])
def test_leaving_operational_lets_p151_run_out(watched, command):
    watched.nmt(command)
    watched.run(0.05)
    watched.command(0x047F, 0x2000)
    assert watched.node.drives[0].state is NordState.ENABLED
    watched.run(0.06)
    assert watched.node.drives[0].fault_tenths == 103


def test_without_p151_a_drive_runs_on(make_bench):
    bench = make_bench(operational=True)
    bench.command(0x047E)
    bench.command(0x047F, 0x2000)
    bench.run(60.0)
    assert bench.node.drives[0].output_hz == 25.0


def test_p513_minus_0_1_ignores_the_time_out_and_keeps_the_state(watched):
    assert watched.write(P513, 0, -1, 2) == "60"
    watched.run(10.0)
    assert [drive.fault_tenths for drive in watched.node.drives] == [0, 103, 103, 103]
    assert watched.node.drives[0].output_hz == 25.0
    assert watched.read(P170, 1) == 1020, "the interface still reports it"


def test_a_reset_of_the_node_stops_a_running_drive(watched):
    watched.nmt(0x81)
    assert [drive.fault_tenths for drive in watched.node.drives] == [109, 0, 0, 0]
