"""What the OPC UA front knows of its site for the alarms."""

from __future__ import annotations

from pathlib import Path

from bridge.project import load_project
from bridge.service.opcua_front import alarm_site_of
from tests.support import sites

HOLD = 'on_expiry = "hold"\n'


def test_alarms_know_the_fronts_the_reactions_and_the_faults_in_german(tmp_path: Path) -> None:
    node = sites.node(sites.drive("fu1", "lease", 1000, HOLD), sites.drive("fu2", "opcua", 0))
    project = load_project(sites.write(tmp_path, sites.bus(node), sites.opcua(), sites.modbus()))
    found = alarm_site_of(project.site, project.families)
    assert found.fronts == ("modbus", "opcua")
    assert found.words.on_expiry == {"conveyor/fu1": "hold", "conveyor/fu2": "disable_voltage"}
    german = found.words.fault_in("conveyor/fu1", "E003/3.0", "de")
    assert german["text"].lower() == "überstrom wechselrichter"
    assert german["remedy"]
    assert found.words.fault_in("conveyor/fu1", "E003/3.0", "en") == {}
    assert found.words.fault_in("conveyor/fu9", "E003/3.0", "de") == {}
    assert found.words.fault_in("conveyor/fu1", "E999", "de") == {}
