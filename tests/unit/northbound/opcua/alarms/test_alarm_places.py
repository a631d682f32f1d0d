"""Which alarms a site has, and their ids."""

from __future__ import annotations

from bridge.northbound.opcua.alarms.alarm_places import alarm_places


def test_each_object_that_sends_events_has_an_alarm_and_the_bridge_those_of_its_fronts() -> None:
    found = list(alarm_places(["conveyor", "conveyor/fu1", "bus/can0", "bridge"], ["modbus", "opcua"]))
    assert [(one.id, one.kind, one.source_name) for one in found] == [
        ("conveyor/Alarm", "node", "conveyor"),
        ("conveyor/fu1/Alarm", "drive", "conveyor/fu1"),
        ("bus/can0/Alarm", "bus", "can0"),
        ("bridge/Alarm", "bridge", "bridge"),
        ("bridge/ModbusAlarm", "front", "bridge"),
        ("bridge/OpcuaAlarm", "front", "bridge"),
        ("bridge/CertificateAlarm", "certificate", "bridge"),
    ]
