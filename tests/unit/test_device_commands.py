"""Commands on nodes that are no drives."""

from __future__ import annotations

import csv
import json
import shutil
from pathlib import Path

import cantools
import pytest
from typer.testing import CliRunner

from bridge.base.errors import FileFaults
from bridge.bustools.bystander import Bystander, Standstill
from bridge.bustools.decode import Decoder
from bridge.bustools.parameter import ParameterTask
from bridge.canopen.frame import Frame
from bridge.cli.app import make_app
from bridge.cli.parameter_drive import find
from bridge.lint import family_dictionaries
from bridge.parameter import Names, ParameterReading
from bridge.project import load_project
from bridge.sim.catalogue import simulate_description
from tests.support import sites
from tests.support.devices import DEVICES, description_of

RUN = CliRunner()


@pytest.fixture
def site(tmp_path: Path) -> Path:
    shutil.copytree(DEVICES, tmp_path / "eds")
    return sites.write(
        tmp_path,
        sites.socketcan(
            sites.node(name="shaft", node_id=20, mapping="eds:eds/encoder.eds"),
            sites.node(name="io", node_id=21, mapping="eds:eds/io16.eds"),
            sites.node(sites.drive("fu1", "none", 0), sites.drive("fu2", "none", 0)),
        ),
        sites.modbus(),
        sites.zenoh(),
        sites.opcua(),
    )


def said(*arguments: str, code: int = 0) -> str:
    result = RUN.invoke(make_app(arguments[0]), arguments, catch_exceptions=False)
    assert result.exit_code == code, result.output
    return " ".join(result.output.replace("│", " ").split()) if code else result.stdout


def test_check_counts_them_beside_the_drives(site: Path) -> None:
    assert said("check", str(site)).endswith("2 drives and 2 devices on 1 bus, no faults\n")
    facts = json.loads(said("check", "--json", str(site)))
    assert (facts["drives"], facts["devices"]) == (["conveyor/fu1", "conveyor/fu2"], ["shaft", "io"])


@pytest.mark.parametrize(
    ("mapping", "told"),
    [
        ("eds:eds/encodr.eds", "there is no file {folder}/eds/encodr.eds (did you mean encoder.eds?)"),
        ("eds:none.eds", "there is no file {folder}/none.eds (a name is relative to the site file)"),
        (
            "eds/encoder.eds",
            "there is no mapping 'eds/encoder.eds' (a device description is \"eds:eds/encoder.eds\")",
        ),
    ],
)
def test_a_description_that_is_not_there_is_a_fault_of_the_site_file(
    site: Path, mapping: str, told: str
) -> None:
    text = site.read_text(encoding="utf-8")
    site.write_text(text.replace("eds:eds/encoder.eds", mapping), encoding="utf-8")
    line = text[: text.index("eds:eds/encoder.eds")].count("\n") + 1
    with pytest.raises(FileFaults) as caught:
        said("check", str(site))
    assert str(caught.value) == f"{site}:{line}: bus[0].node[0].mapping: {told.format(folder=site.parent)}"


def test_the_load_has_their_tpdos(site: Path) -> None:
    def load() -> float:
        return json.loads(said("check", "--json", str(site)))["buses"][0]["load_percent"]

    with_encoder = load()
    text = site.read_text(encoding="utf-8")
    site.write_text(text.replace("id = 20", "id = 20\nenabled = false"), encoding="utf-8")
    # TPDO2 alone, with each SYNC, is 100 frames of 11 … 13 bytes on a line of 1 Mbit/s.
    assert with_encoder - load() > 0.9


def test_identifiers_that_collide_are_found_in_their_eds(site: Path) -> None:
    text = site.read_text(encoding="utf-8")
    taken = '[[bus.node.configure]]\nobject = "1801:01"\ntype = "uint32"\nvalue = 0x194\n'
    at = text.index("[[bus.node]]", text.index('"io"'))
    site.write_text(f"{text[:at]}{taken}{text[at:]}", encoding="utf-8")
    with pytest.raises(FileFaults) as told:
        said("check", str(site))
    assert "TPDO2 of io has COB-ID 194h, which is TPDO1 of shaft's, too" in str(told.value)


def test_every_point_of_theirs_is_exported(site: Path) -> None:
    rows = list(csv.reader(said("export", "modbus", str(site)).splitlines()))
    assert [row[5] for row in rows if row[1] == "shaft" and row[5].startswith("input/")] == [
        "input/position_value",
        "input/speed_value_channel_1",
        "input/alarms",
        "input/warnings",
    ]
    for protocol in ("opcua", "zenoh"):
        assert "shaft/input/position_value" in said("export", protocol, str(site))


def test_a_dbc_file_has_their_tpdos(site: Path) -> None:
    dbc = cantools.database.load_string(said("export", "dbc", str(site)), "dbc")
    assert isinstance(dbc, cantools.database.Database)
    position = dbc.get_message_by_name("shaft_TPDO1")
    assert position.decode(bytes.fromhex("E8 03 00 00 18 FC")) == {
        "position_value": 1000,
        "speed_value_channel_1": -1000,
    }
    assert (position.frame_id, position.cycle_time) == (0x194, 100)
    inputs = dbc.get_message_by_name("io_TPDO1").decode(bytes.fromhex("81 00"))
    assert [name for name, bit in inputs.items() if bit] == [
        "digital_inputs_1_to_8_bit_0",
        "digital_inputs_1_to_8_bit_7",
    ]
    outputs = dbc.get_message_by_name("io_RPDO2")
    assert (outputs.frame_id, outputs.receivers) == (0x315, {"io"})


def test_a_monitor_says_what_their_tpdos_carry(site: Path) -> None:
    project = load_project(site)
    (bus,) = project.site.bus
    decoder = Decoder(bus.node, project.families, 127, family_dictionaries(project.families, site))
    said = decoder.decode(Frame(0x194, bytes.fromhex("E8 03 00 00 18 FC")))
    assert (said.label, said.text) == ("TPDO1 shaft", "position_value 1000, speed_value_channel_1 -1000")
    assert said.values == (("position_value", 1000), ("speed_value_channel_1", -1000))
    half = decoder.decode(Frame(0x194, bytes.fromhex("E8 03 00 00")))
    assert half.text == "position_value 1000, 4 bytes instead of 6"
    output = decoder.decode(Frame(0x215, bytes.fromhex("0F 00")))
    assert output.text == "6200:01 Fh, 6200:02 0h"


def test_there_is_nothing_to_stop(site: Path) -> None:
    assert "shaft has neither drives nor outputs: there is nothing to stop" in said(
        "drop-test", str(site), "shaft", "--yes-i-am-at-the-machine", code=2
    )
    assert "shaft is no drive" in said("exchange", str(site), "shaft", "old.toml", code=2)


def test_their_parameters_are_listed_by_the_nodes_name(site: Path) -> None:
    names = {row["name"] for row in json.loads(said("parameters", "list", str(site), "shaft", "--json"))}
    assert {"6000", "6002", "650A:01"} <= names
    assert "shaft" in said("parameters", "list", str(site), "conveyor/fu9", code=2)


def test_a_parameter_is_written_to_them_without_asking_for_a_status_word(site: Path) -> None:
    target = find(site, "shaft")
    guard = Standstill(Names(target.family), target.family, target.slot, None, force=False, whole=True)
    entry = target.access.names.resolve("6000")
    node = simulate_description(description_of("encoder.eds"), 20)
    node.start(0.0)
    found: list[ParameterReading] = []

    def procedure(now: float):
        yield from guard.check([entry])
        written = yield from target.access.write(entry, 5, now, guard.gate)
        found.append(written.reading)

    task = ParameterTask(target.node, target.family, target.slot, procedure, 0.0)
    now = 0.0
    while not task.is_finished(now) and now < 2.0:
        task.on_time(now)
        for frame in task.take_frames():
            node.on_frame(frame._replace(time=now), now)
        for frame in node.take_frames():
            task.on_frame(frame._replace(time=now))
        now += 0.001
    assert [one.value for one in found] == [5]
    assert node.dictionary.find(0x6000, 0).upload() == b"\5\0"


def test_somebody_who_commands_their_outputs_is_heard(site: Path) -> None:
    project = load_project(site)
    node = project.site.bus[0].node[1]
    bystander = Bystander(127, node, project.families[node.mapping], None, 0.0, 1.0)
    bystander.on_frame(Frame(0x200 + 21, b"\1\0", 0.5))
    assert bystander.found
