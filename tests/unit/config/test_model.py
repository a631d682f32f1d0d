"""Keys of the site file: their defaults, and values that none of them may have."""

from __future__ import annotations

from pathlib import Path

import pytest

from tests.support.small_site import SMALL, faults, load


def test_defaults_are_those_of_the_contract(tmp_path: Path):
    site = load(tmp_path, SMALL)
    (bus,) = site.bus
    (node,) = bus.node
    (drive,) = node.drive
    assert site.site.state_dir == "/var/lib/drivebridge"
    assert (bus.bitrate, bus.master_node_id, bus.heartbeat_ms) == (250_000, 127, 100)
    assert (bus.sync_period_ms, bus.deadman_ms) == (10, 100)
    assert (node.supervision, node.supervision_ms, node.hold_ms) == ("heartbeat", 200, 2000)
    assert (node.mandatory, node.enabled) == (False, True)
    assert (drive.control, drive.fieldbus_timeout_ms) == ("none", None)
    assert (drive.telegram_downtime_s, drive.on_expiry, drive.then_silence_ms) == (0.5, "disable_voltage", 0)
    assert (site.modbus, site.opcua, site.zenoh) == (None, None, None)


def test_served_protocols_listen_on_loopback_unless_told_otherwise(tmp_path: Path):
    site = load(tmp_path, SMALL + "[modbus]\n[opcua]\n[zenoh]\n")
    assert site.modbus is not None
    assert site.opcua is not None
    assert site.zenoh is not None
    assert site.modbus.listen == "127.0.0.1:502"
    assert site.opcua.listen == "127.0.0.1:4840"
    assert site.zenoh.listen == ["tcp/127.0.0.1:7447"]


@pytest.mark.parametrize(
    ("sync_ms", "rpdo_ms", "period_s"), [(10, None, 0.01), (10, 25, 0.025), (0, None, 0.02), (0, 5, 0.005)]
)
def test_process_data_go_with_sync_or_every_20_ms(
    tmp_path: Path, sync_ms: int, rpdo_ms: int | None, period_s: float
):
    period = f"rpdo_period_ms = {rpdo_ms}\n" if rpdo_ms else ""
    lines = f'interface = "virtual"\nsync_period_ms = {sync_ms}\n{period}'
    site = load(tmp_path, SMALL.replace('interface = "virtual"\n', lines))
    assert site.bus[0].rpdo_period_s == period_s


@pytest.mark.parametrize("value", ["nan", "inf", "-0.2", "0.09", "100.1", "true", '"0.5"'])
def test_a_telegram_downtime_is_that_of_p513(tmp_path: Path, value: str):
    assert "telegram_downtime_s" in faults(tmp_path, f"{SMALL}telegram_downtime_s = {value}\n")[0]


@pytest.mark.parametrize("value", ["nan", "inf", "0", "-1.5", '"50"'])
def test_a_scaling_parameter_is_more_than_nothing(tmp_path: Path, value: str):
    assert "parameters.P105" in faults(tmp_path, f"{SMALL}parameters = {{ P105 = {value} }}\n")[0]
