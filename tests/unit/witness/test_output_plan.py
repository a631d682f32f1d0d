"""Outputs as the witness knows them by files, compared with the bridge's: two hands wrote the two."""

from __future__ import annotations

from pathlib import Path

import pytest

from bridge.command.output_words import OutputWords
from bridge.config import load_site
from bridge.drive.own_judgement import OwnVerdict
from bridge.lint import lint
from bridge.lint.own import WorstCase
from bridge.project import load_project
from bridge.witness.plan import UnknownFamily, WatchedOutputs, plan
from tests.support import sites
from tests.support.devices import DEVICES

EDS = (DEVICES / "io16.eds").read_text(encoding="utf-8")
DIGITAL, ANALOGUE = 0x215, 0x315
OWNED = 'control = "modbus"\nfieldbus_timeout_ms = 200\n'
_FULL_PERCENT = 75
"""Above such a load frames may wait for as long as one likes."""
DIGITAL_TITLE = "ParameterName=Digital outputs 1 to 8"


def io(more: str = "", outputs: str = OWNED, mapping: str = "eds:io.eds", node_id: int = 21) -> str:
    return sites.node(
        name="io", node_id=node_id, mapping=mapping, more=f"{more}\n[bus.node.outputs]\n{outputs}"
    )


def written(folder: Path, *nodes: str, eds: str = EDS, more: str = "") -> Path:
    (folder / "io.eds").write_text(eds, encoding="utf-8")
    return sites.write(folder, sites.bus(*nodes, more=more), sites.modbus(0))


def watched(
    folder: Path,
    more: str = "",
    outputs: str = OWNED,
    *,
    eds: str = EDS,
    bus: str = "",
    own: int | None = None,
) -> WatchedOutputs:
    path = written(folder, io(more, outputs), eds=eds, more=bus)
    (bus_of_it,) = plan(load_site(path), path.parent, own_timeout_ms=own)
    (found,) = bus_of_it.outputs
    return found


def with_value(section: str, value: str, key: str = "DefaultValue", eds: str = EDS) -> str:
    """The file with another value in this section."""
    before, header, after = eds.partition(f"[{section}]\n")
    assert header
    body, blank, rest = after.partition("\n\n")
    kept = [line for line in body.splitlines() if not line.startswith(f"{key}=")]
    return before + header + "\n".join([*kept, f"{key}={value}"]) + blank + rest


def test_the_rpdos_are_those_of_the_file(tmp_path: Path) -> None:
    found = watched(tmp_path)
    assert not found.why_unknown
    assert set(found.rpdos) == {DIGITAL, ANALOGUE}
    assert [one.bytes for one in found.rpdos.values()] == [2, 4]
    assert (found.name, found.unit_id, found.node_id, found.rpdo_ms) == ("io", 1, 21, 10.0)


@pytest.mark.parametrize("bit", range(16))
def test_any_bit_that_is_not_safe_is_active(tmp_path: Path, bit: int) -> None:
    values = watched(tmp_path).rpdos[DIGITAL]
    assert values.are_active((1 << bit).to_bytes(2, "little")) is True
    assert values.are_active(bytes(2)) is False
    assert values.are_active(bytes(1)) is None


def bridges(folder: Path, eds: str, outputs: str) -> OutputWords:
    """Output words that the bridge makes of the same."""
    project = load_project(written(folder, io("", outputs), eds=eds))
    (node,) = project.site.bus[0].node
    return OutputWords("io", project.families[node.mapping].output, node.outputs.on_expiry)


ODD_TITLES = (
    EDS,
    EDS.replace(DIGITAL_TITLE, "ParameterName=Out"),
    EDS.replace(DIGITAL_TITLE, "ParameterName=1. Ausgänge (A-1)"),
    EDS.replace(DIGITAL_TITLE, "ParameterName=Größe, Ventilé, Łódź"),
    EDS.replace("Digital outputs 9 to 16", "Digital outputs 1 to 8"),
    EDS.replace("ParameterName=Digital outputs\n", "ParameterName=8 Relais\n"),
)


@pytest.mark.landing(24)
@pytest.mark.parametrize("eds", ODD_TITLES)
@pytest.mark.parametrize("place", range(4))
@pytest.mark.parametrize("value", ['"hold"', "3", "0"])
def test_both_call_them_the_same_and_know_the_same_safe_value(
    tmp_path: Path, eds: str, place: int, value: str
) -> None:
    name = list(bridges(tmp_path, eds, OWNED).places)[place]
    outputs = f"{OWNED}on_expiry = {{ {name} = {value} }}"
    safe = [one.safe for one in bridges(tmp_path, eds, outputs).places.values()]
    found = watched(tmp_path, outputs=outputs, eds=eds)
    words = [(DIGITAL, 0, 8), (DIGITAL, 8, 8), (ANALOGUE, 0, 16), (ANALOGUE, 16, 16)]
    for raw, (cob_id, shift, bits) in zip(safe, words, strict=True):
        values, full = found.rpdos[cob_id], (1 << bits) - 1
        assert values.mask >> shift & full == (0 if raw is None else full)
        assert values.safe >> shift & full == (raw or 0)


@pytest.mark.parametrize(
    ("kind", "bits", "value", "raw"),
    [
        ("0x0003", 16, "-2", 0xFFFE),
        ("0x0008", 32, "1.5", 0x3FC0_0000),
        ("0x0011", 64, "1.5", 0x3FF8_0000_0000_0000),
        ("0x0001", 1, "true", 1),
        ("0x001B", 64, "7", 7),
    ],
)
def test_safe_values_have_their_type(tmp_path: Path, kind: str, bits: int, value: str, raw: int) -> None:
    eds = with_value("1601sub0", "1", eds=with_value("6411sub1", kind, "DataType"))
    eds = with_value("1601sub1", f"0x641101{bits:02X}", eds=eds)
    found = watched(tmp_path, outputs=f"{OWNED}on_expiry = {{ analogue_output_1 = {value} }}", eds=eds)
    assert found.rpdos[ANALOGUE].safe == raw
    assert found.rpdos[ANALOGUE].mask == (1 << bits) - 1
    assert found.rpdos[ANALOGUE].bytes == (bits + 7) // 8


@pytest.mark.parametrize(
    ("section", "word"), [("1600sub1", "0x00050008"), ("1600sub1", "0x62000104"), ("1600sub1", "0x60000108")]
)
def test_what_is_no_output_there_is_left_out(tmp_path: Path, section: str, word: str) -> None:
    """A dummy, a part of an output, an object that its type does not make one."""
    eds = with_value("6000sub1", "0x0009", "DataType", with_value(section, word))
    values = watched(tmp_path, eds=eds).rpdos[DIGITAL]
    assert values.mask == 0xFF << (4 if word.endswith("04") else 8)


def test_the_type_of_an_array_is_that_of_its_first_element(tmp_path: Path) -> None:
    before, header, after = EDS.partition("[6200sub2]\n")
    eds = before + header + after.replace("DataType=0x0005\n", "", 1)
    assert watched(tmp_path, eds=eds).rpdos[DIGITAL].mask == 0xFFFF


@pytest.mark.parametrize("cob_id", ["$NODEID+0x80000300", "0x20000315", ""])
def test_a_pdo_that_is_off_or_has_29_bits_carries_nothing(tmp_path: Path, cob_id: str) -> None:
    assert set(watched(tmp_path, eds=with_value("1401sub1", cob_id)).rpdos) == {DIGITAL}


@pytest.mark.parametrize("cob_id", ["0x300 + $NODEID", "315h", "789", "$NODEID+0x300 ; RPDO2", "NODE_ID+768"])
def test_identifiers_are_written_in_many_ways(tmp_path: Path, cob_id: str) -> None:
    assert set(watched(tmp_path, eds=with_value("1401sub1", cob_id)).rpdos) == {DIGITAL, ANALOGUE}


@pytest.mark.parametrize("cob_id", ["$NODEID*2", "later"])
def test_what_is_no_number_is_none(tmp_path: Path, cob_id: str) -> None:
    assert set(watched(tmp_path, eds=with_value("1401sub1", cob_id)).rpdos) == {DIGITAL}


def test_a_negative_number_is_one(tmp_path: Path) -> None:
    eds = with_value("6444sub1", "-1")
    outputs = f"{OWNED}on_expiry = {{ analogue_output_1 = -1 }}"
    assert not watched(tmp_path, outputs=outputs, eds=eds).why_active


def test_what_the_site_file_writes_counts(tmp_path: Path) -> None:
    more = (
        'configure = [{ object = "1400:01", type = "uint32", value = 0x345 }, '
        '{ object = "1600:00", type = "uint8", value = 1 }]'
    )
    found = watched(tmp_path, more)
    assert set(found.rpdos) == {0x345, ANALOGUE}
    assert found.rpdos[0x345].bytes == 1


def test_a_configuration_file_counts_where_it_configures(tmp_path: Path) -> None:
    dcf = with_value("1400sub1", "0x345", "ParameterValue", with_value("1401sub1", "0x346"))
    (tmp_path / "io.dcf").write_text(dcf, encoding="utf-8")
    assert set(watched(tmp_path, 'configuration = "io.dcf"').rpdos) == {0x345, ANALOGUE}


def test_tpdos_that_show_them_are_looked_at(tmp_path: Path) -> None:
    assert not watched(tmp_path).tpdos
    eds = with_value("1800sub5", "200", eds=with_value("1A00sub2", "0x62000108"))
    found = watched(tmp_path, eds=eds)
    assert set(found.tpdos) == {0x195}
    assert found.tpdos[0x195].mask == 0xFF00
    assert (found.follow_ms, watched(tmp_path).follow_ms) == (1100, 500)


# what the node does by itself

CONSUMER = 'configure = [{ object = "1016:01", type = "uint32", value = 0x7F015E }]'
"""Watches node 127, our own, for 350 ms."""
SAFE_1 = f"{OWNED}on_expiry = {{ digital_outputs_1_to_8 = 1 }}"
HELD_1 = f'{OWNED}on_expiry = {{ digital_outputs_1_to_8 = "hold" }}'


@pytest.mark.landing(12)
@pytest.mark.parametrize(
    ("section", "value", "outputs", "why"),
    [
        ("6206sub1", "0xFF", OWNED, ""),
        ("6206sub1", "0xFE", OWNED, "digital_outputs_1_to_8 keeps its value: 6206:01 is FEh"),
        ("6206sub1", "0x00", HELD_1, ""),
        ("6206sub1", "", OWNED, "what digital_outputs_1_to_8 does then is in no file"),
        ("6207sub1", "", OWNED, "what digital_outputs_1_to_8 does then is in no file"),
        ("6207sub1", "2", OWNED, "digital_outputs_1_to_8 becomes 2h, and not 0h"),
        ("6207sub1", "1", SAFE_1, ""),
        ("6443sub2", "0", OWNED, "analogue_output_2 keeps its value: 6443:02 is 0h"),
        ("6444sub2", "5", OWNED, "analogue_output_2 becomes 5h, and not 0h"),
        ("1029sub1", "1", OWNED, "it stays operational: 1029:01 is 1"),
        ("1029sub1", "2", OWNED, ""),
        ("1029sub1", "", OWNED, ""),
    ],
)
def test_both_know_what_becomes_of_them_without_a_bridge(
    tmp_path: Path, section: str, value: str, outputs: str, why: str
) -> None:
    eds = with_value(section, value)
    assert watched(tmp_path, CONSUMER, outputs, eds=eds).why_active == why
    verdict = judged(written(tmp_path, io(CONSUMER, outputs), eds=eds))[1]["io"].own.verdict
    if value:
        assert verdict is (OwnVerdict.RUNS_ON if why else OwnVerdict.STOPS)


@pytest.mark.parametrize(
    ("more", "stays"),
    [
        ("own_timeout_ms = 500\nenforce = true", False),
        ("own_timeout_ms = 500", True),
    ],
)
def test_the_bridge_has_the_node_act_where_it_sets_its_time_out(
    tmp_path: Path, more: str, stays: bool
) -> None:
    eds = with_value("1029sub1", "1")
    assert bool(watched(tmp_path, more, eds=eds).why_active) is stays


def test_outputs_of_no_known_profile_are_not_known_to_become_safe(tmp_path: Path) -> None:
    eds = EDS.replace("[6411", "[2411").replace("0x6411", "0x2411")
    assert watched(tmp_path, eds=eds).why_active == "what analogue_output_1 does then is in no file"


@pytest.mark.parametrize(
    ("more", "bus", "own", "silent_ms"),
    [
        ("", "", None, 0),
        ("", "", 500, 500 + 100 + 200),
        ("own_timeout_ms = 400", "", 500, 400 + 100 + 200),
        ("own_timeout_ms = 400", "deadman_ms = 150", None, 400 + 150 + 200),
        ("own_timeout_ms = 400", "heartbeat_ms = 160", None, 400 + 160 + 200),
        ("own_timeout_ms = 400", "heartbeat_ms = 0", None, 0),
        ("supervision_ms = 300", "", 500, 500 + 100 + 300),
        (CONSUMER, "", None, 350 + 100 + 200),
        (CONSUMER.replace("0x7F", "0x7E"), "", None, 0),
        ('supervision = "guarding"', "", None, 600 + 100 + 200),
        ('supervision = "guarding"\nown_timeout_ms = 400', "", None, 400 + 100 + 200),
    ],
)
def test_after_what_time_the_node_notices(
    tmp_path: Path, more: str, bus: str, own: int | None, silent_ms: int
) -> None:
    """One heartbeat or the bridge's dead man later it begins to count, one of its own later that is seen."""
    assert watched(tmp_path, more, bus=bus, own=own).silent_ms == silent_ms


@pytest.mark.parametrize(
    ("more", "lost_ms"),
    [("", 1200), ('supervision = "guarding"', 1600), ('supervision = "none"', 0)],
)
def test_after_what_time_the_node_is_cut_off(tmp_path: Path, more: str, lost_ms: int) -> None:
    assert watched(tmp_path, more).lost_ms == lost_ms


def test_what_moves_them_or_makes_them_safe_is_left_alone(tmp_path: Path) -> None:
    assert watched(tmp_path).written == {0x1029, 0x6200, 0x6206, 0x6207, 0x6411, 0x6443, 0x6444}


# the owner


def judged(path: Path) -> tuple[float, dict[str, WorstCase]]:
    """The load in percent, and what is published of each node's outputs."""
    project = load_project(path)
    verdict = lint(project.site, project.families, path, project.downloads)
    return verdict.loads[0].most_percent, {case.drive: case for case in verdict.worst_cases}


@pytest.mark.landing(9)
@pytest.mark.parametrize("rate", [50_000, 125_000, 1_000_000])
@pytest.mark.parametrize("nodes", [1, 3, 9])
def test_nobody_is_held_to_less_than_the_bridge_publishes(tmp_path: Path, rate: int, nodes: int) -> None:
    tables = [
        sites.node(name=f"n{one}", node_id=one, mapping="eds:io.eds", more=f"[bus.node.outputs]\n{OWNED}")
        for one in range(1, nodes + 1)
    ]
    path = written(tmp_path, *tables, more=f"bitrate = {rate}\nsync_period_ms = 50")
    load, published = judged(path)
    if load > _FULL_PERCENT:
        return
    (bus,) = plan(load_site(path), tmp_path)
    for outputs in bus.outputs:
        stop = published[outputs.name].stop
        on_the_bus = sum(term.ms for term in stop.terms if term.name not in ("way_ms", "sync_ms"))
        assert stop.terms
        assert on_the_bus <= outputs.stop_ms <= 3 * on_the_bus


ALL_HELD = ", ".join(
    f'{name} = "hold"'
    for name in (
        "digital_outputs_1_to_8",
        "digital_outputs_9_to_16",
        "analogue_output_1",
        "analogue_output_2",
    )
)


@pytest.mark.parametrize(
    "outputs",
    [
        "",
        'control = "modbus"\nfieldbus_timeout_ms = 0',
        f"{OWNED}on_expiry = {{ {ALL_HELD} }}",
    ],
)
def test_where_nothing_is_promised_nothing_is_expected(tmp_path: Path, outputs: str) -> None:
    assert watched(tmp_path, outputs=outputs).stop_ms == 0


def test_their_frames_may_go_first(tmp_path: Path) -> None:
    one, two = (watched(tmp_path, eds=eds).beside_ms for eds in (with_value("1401sub1", "0x80000000"), EDS))
    assert one is not None and two is not None and two > one


def test_units_are_those_of_the_reference(tmp_path: Path) -> None:
    drive = sites.node(sites.drive("fu1", "modbus", 200))
    path = written(tmp_path, drive, io())
    (bus,) = plan(load_site(path), tmp_path)
    assert ([one.unit_id for one in bus.drives], [one.unit_id for one in bus.outputs]) == ([1], [2])


# which files


def test_an_encoder_and_a_node_that_is_not_used_have_none(tmp_path: Path) -> None:
    (tmp_path / "encoder.eds").write_bytes((DEVICES / "encoder.eds").read_bytes())
    shaft = sites.node(name="shaft", node_id=20, mapping="eds:encoder.eds")
    path = written(tmp_path, shaft, io("enabled = false"))
    assert not plan(load_site(path), tmp_path)[0].outputs


XDD = """\
<?xml version="1.0" encoding="utf-8"?>
<ISO15745ProfileContainer xmlns="http://www.canopen.org/xml/1.0"><ISO15745Profile>
<CANopenObjectList>
<CANopenObject index="1400" name="RPDO1" objectType="9">
 <CANopenSubObject subIndex="01" name="COB-ID" dataType="0007" defaultValue="$NODEID+0x200"
   actualValue="0x345" />
</CANopenObject>
<CANopenObject index="1600" name="RPDO1 mapping" objectType="9">
 <CANopenSubObject subIndex="00" name="Number" dataType="0005" defaultValue="1" />
 <CANopenSubObject subIndex="01" name="Object 1" dataType="0007" defaultValue="0x62000108" />
</CANopenObject>
<CANopenObject index="6200" name="Valves" objectType="8" dataType="0005">
 <CANopenSubObject subIndex="01" name="Valves 1 to 8" defaultValue="0" />
</CANopenObject>
</CANopenObjectList></ISO15745Profile></ISO15745ProfileContainer>
"""


def test_an_xdd_is_read_as_well(tmp_path: Path) -> None:
    found = watched(tmp_path, outputs=f"{OWNED}on_expiry = {{ valves_1_to_8 = 2 }}", eds=XDD)
    assert not found.why_unknown
    assert set(found.rpdos) == {0x345}
    assert (found.rpdos[0x345].mask, found.rpdos[0x345].safe) == (0xFF, 2)


@pytest.mark.parametrize("encoding", ["utf-8", "utf-8-sig", "utf-16", "cp1252"])
@pytest.mark.parametrize("end", ["\n", "\r\n"])
def test_encodings_and_ends_of_lines_do_not_matter(tmp_path: Path, encoding: str, end: str) -> None:
    path = written(tmp_path, io())
    text = EDS.replace("Digital outputs", "Ausgänge").replace("\n", end)
    (tmp_path / "io.eds").write_bytes(text.encode(encoding))
    (bus,) = plan(load_site(path), tmp_path)
    assert set(bus.outputs[0].rpdos) == {DIGITAL, ANALOGUE}


def test_lines_in_utf_8_may_stand_among_others_in_windows_1252(tmp_path: Path) -> None:
    """The file is like two that were joined; the names are those of the bridge."""
    first, second = "ParameterName=Lüfter", "ParameterName=Größe"
    text = EDS.replace(DIGITAL_TITLE, first).replace("ParameterName=Digital outputs 9 to 16", second)
    content = text.encode().replace(second.encode(), second.encode("cp1252"))
    assert content not in (text.encode(), text.encode("cp1252"))
    on_hold = 'on_expiry = { digital_outputs_luefter = "hold", digital_outputs_groesse = "hold" }'
    path = written(tmp_path, io("", OWNED + on_hold))
    (tmp_path / "io.eds").write_bytes(content)
    (bus,) = plan(load_site(path), path.parent)
    assert bus.outputs[0].rpdos[DIGITAL].are_active(b"\xff\xff") is False
    assert {one.name for one in load_project(path).families["eds:io.eds"].output} >= {
        "digital_outputs_luefter",
        "digital_outputs_groesse",
    }


def test_what_is_there_twice_counts_as_it_stands_first(tmp_path: Path) -> None:
    eds = EDS + "\n[1400sub1]\nDefaultValue=0x345\n; DefaultValue=1\n[Comments]\nDefaultValue=2\n"
    assert set(watched(tmp_path, eds=eds).rpdos) == {DIGITAL, ANALOGUE}


@pytest.mark.parametrize(
    ("eds", "why"),
    [
        ("hello", "io.eds: describes no objects"),
        ("<a>", "io.eds: no element found"),
        (
            XDD.replace("<ISO15745ProfileContainer", "<!DOCTYPE a><ISO15745ProfileContainer", 1),
            "document type",
        ),
        (XDD.replace('index="1400"', 'index="14x0"'), 'io.eds: index = "14x0" is no number'),
        (
            with_value("1400sub1", "0x80000000", eds=with_value("1401sub1", "0x80000000")),
            "no file says which",
        ),
    ],
)
def test_what_cannot_be_known_is_said(tmp_path: Path, eds: str, why: str) -> None:
    found = watched(tmp_path, eds=eds)
    assert why in found.why_unknown
    assert not found.rpdos
    assert not plan(load_site(tmp_path / "site.toml"), tmp_path)[0].judged_outputs


def test_a_file_that_is_not_there_is_named(tmp_path: Path) -> None:
    path = sites.write(tmp_path, sites.bus(io()), sites.modbus(0))
    (bus,) = plan(load_site(path), tmp_path)
    assert "io.eds" in bus.outputs[0].why_unknown


# mapping files

MAPPING = """\
extends = "acme/all"
[family]
name = "IO"
vendor = "Acme"
source = "none"
[[output]]
name = "valves"
on_expiry = 3
"""
BASE = """\
extends = "generic/device"
without = ["output:spare"]
[family]
name = "IO"
vendor = "Acme"
source = "none"
profile = 401
[[output]]
name = "valves"
object = "6200:01"
data_type = "uint8"
error_mode = "6206:01"
error_value = "6207:01"
[[output]]
name = "pressure"
object = "6411:01"
data_type = "int16"
factor = 0.5
offset = 10.0
"""


def mapped(
    folder: Path, text: str = MAPPING, base: str = BASE, more: str = "", outputs: str = OWNED
) -> WatchedOutputs:
    for name, content in (("io", text), ("all", base)):
        file = folder / "mappings" / "acme" / f"{name}.toml"
        file.parent.mkdir(parents=True, exist_ok=True)
        file.write_text(content, encoding="utf-8")
    path = sites.write(folder, sites.bus(io(more, outputs, mapping="acme/io")), sites.modbus(0))
    (bus,) = plan(load_site(path), path.parent)
    (found,) = bus.outputs
    return found


def test_a_mapping_file_of_the_profile_has_its_default_rpdos(tmp_path: Path) -> None:
    found = mapped(tmp_path, outputs=f"{OWNED}on_expiry = {{ pressure = 15.0 }}")
    assert not found.why_unknown
    assert [(can_id, one.mask, one.safe) for can_id, one in found.rpdos.items()] == [
        (DIGITAL, 0xFF, 3),
        (ANALOGUE, 0xFFFF, 10),
    ]
    assert found.why_active == "what valves does then is in no file"


@pytest.mark.parametrize("number", [4, 5, 8, 9, 12, 13])
def test_further_analogue_outputs_have_the_next_rpdos(tmp_path: Path, number: int) -> None:
    found = mapped(tmp_path, base=BASE.replace("6411:01", f"6411:{number:02X}"))
    place = (number - 1) // 4
    known = {DIGITAL, ANALOGUE + 0x100 * place} if number < 13 else set()
    assert set(found.rpdos) == known
    assert bool(found.why_unknown) is (number == 13)


@pytest.mark.parametrize(
    ("old", "new"),
    [
        ("profile = 401\n", ""),
        ("profile = 401\n", "profile = 402\n"),
        ('object = "6411:01"', 'object = "2411"'),
        ('data_type = "int16"', 'data_type = "int32"'),
    ],
)
def test_of_another_device_no_rpdos_are_guessed(tmp_path: Path, old: str, new: str) -> None:
    assert mapped(tmp_path, base=BASE.replace(old, new)).why_unknown == "no file says which RPDO carries them"


def test_what_the_site_file_writes_counts_for_a_mapping_file_too(tmp_path: Path) -> None:
    more = (
        'configure = [{ object = "6206:01", type = "uint8", value = 0xFF }, '
        '{ object = "6207:01", type = "uint8", value = 3 }, '
        '{ object = "1401:01", type = "uint32", value = 0x80000315 }]'
    )
    found = mapped(tmp_path, more=more)
    assert set(found.rpdos) == {DIGITAL}
    assert found.why_active == "what pressure does then is in no file"


def test_a_mapping_file_may_leave_outputs_out(tmp_path: Path) -> None:
    text = MAPPING.replace("[family]", 'without = ["output:pressure", "parameter:1000"]\n[family]', 1)
    assert set(mapped(tmp_path, text).rpdos) == {DIGITAL}


def test_one_may_be_on_hold_by_the_mapping_file(tmp_path: Path) -> None:
    found = mapped(tmp_path, MAPPING.replace("on_expiry = 3", 'on_expiry = "hold"'))
    assert found.rpdos[DIGITAL].mask == 0
    assert found.rpdos[ANALOGUE].mask == 0xFFFF


@pytest.mark.parametrize(
    ("base", "why"),
    [
        (BASE.replace("[family]", "[family", 1), "all.toml"),
        (BASE.replace("6200:01", "P150"), "acme/io: is no mapping file"),
        (BASE.replace('object = "6200:01"\n', ""), "acme/io: is no mapping file"),
    ],
)
def test_a_mapping_file_that_cannot_be_read_is_said(tmp_path: Path, base: str, why: str) -> None:
    assert why in mapped(tmp_path, base=base).why_unknown


def test_a_mapping_that_extends_itself_ends(tmp_path: Path) -> None:
    found = mapped(tmp_path, base=BASE.replace("generic/device", "acme/io"))
    assert set(found.rpdos) == {DIGITAL, ANALOGUE}


# what is odd


def test_a_node_with_drives_has_no_outputs(tmp_path: Path) -> None:
    drive = sites.node(sites.drive("fu1", "modbus", 200), mapping="acme/io")
    mapped(tmp_path)
    path = sites.write(tmp_path, sites.bus(drive), sites.modbus(0))
    with pytest.raises(UnknownFamily):
        plan(load_site(path), tmp_path)
    path = sites.write(tmp_path, sites.bus(sites.node(sites.drive("fu1", "modbus", 200))), sites.modbus(0))
    assert not plan(load_site(path), tmp_path)[0].outputs


def test_what_is_on_hold_is_never_active(tmp_path: Path) -> None:
    outputs = f'{OWNED}on_expiry = {{ digital_outputs_1_to_8 = "hold" }}'
    values = watched(tmp_path, outputs=outputs).rpdos[DIGITAL]
    assert values.are_active(b"\xff\x00") is False
    assert values.are_active(b"\x00\x01") is True


def test_a_safe_value_that_does_not_fit_is_said(tmp_path: Path) -> None:
    eds = with_value("6411sub1", "0x0008", "DataType")
    outputs = f"{OWNED}on_expiry = {{ analogue_output_1 = 1e300 }}"
    assert watched(tmp_path, outputs=outputs, eds=eds).why_unknown


def test_the_slowest_tpdo_counts(tmp_path: Path) -> None:
    eds = with_value("1800sub5", "200", eds=with_value("1A00sub2", "0x62000108"))
    eds = with_value("1801sub5", "300", eds=with_value("1A01sub1", "0x64110110", eds=eds))
    assert watched(tmp_path, eds=eds).follow_ms == 3 * 300 + 500


def test_a_mapping_without_its_rpdo_names_nothing(tmp_path: Path) -> None:
    """The bridge does not count it: the name is free for the next one."""
    eds = with_value("1600sub1", "0x24000008").replace("[1400", "[2401")
    eds += "\n[2400]\nParameterName=Analogue output 1\nObjectType=7\nDataType=0x0005\nDefaultValue=0\n"
    found = watched(tmp_path, outputs=f'{OWNED}on_expiry = {{ analogue_output_1 = "hold" }}', eds=eds)
    assert found.rpdos[ANALOGUE].mask == 0xFFFF_0000


def test_a_dummy_that_is_described_is_no_output(tmp_path: Path) -> None:
    """CiA 301 §7.4.7: it fills a gap."""
    eds = with_value("1600sub1", "0x00050008")
    eds += "\n[0005]\nParameterName=Unsigned 8\nObjectType=7\nDataType=0x0005\nDefaultValue=0\n"
    assert watched(tmp_path, eds=eds).rpdos[DIGITAL].mask == 0xFF00


def test_what_is_mapped_twice_is_one_output(tmp_path: Path) -> None:
    eds = with_value("1600sub2", "0x62000108")
    outputs = f"{OWNED}on_expiry = {{ digital_outputs_1_to_8 = 1 }}"
    assert watched(tmp_path, outputs=outputs, eds=eds).rpdos[DIGITAL].safe == 0x0101


def test_a_parameter_of_the_same_name_is_no_output(tmp_path: Path) -> None:
    text = MAPPING.replace("[family]", 'without = ["parameter:pressure"]\n[family]', 1)
    assert set(mapped(tmp_path, text).rpdos) == {DIGITAL, ANALOGUE}


def test_an_object_may_have_no_sub_index(tmp_path: Path) -> None:
    more = (
        'configure = [{ object = "1400:01", type = "uint32", value = 0x345 }, '
        '{ object = "1600:00", type = "uint8", value = 1 }, '
        '{ object = "1600:01", type = "uint32", value = 0x24110010 }]'
    )
    found = mapped(tmp_path, base=BASE.replace("6411:01", "2411"), more=more)
    assert found.rpdos[0x345].mask == 0xFFFF


def test_the_default_rpdos_are_those_with_outputs(tmp_path: Path) -> None:
    more = 'configure = [{ object = "1602:01", type = "uint32", value = 0x62000108 }]'
    found = mapped(tmp_path, more=more)
    assert set(found.rpdos) == {DIGITAL, ANALOGUE}
    more = more.replace("}]", '}, { object = "1602:00", type = "uint8", value = 1 }]')
    assert set(mapped(tmp_path, more=more).rpdos) == {DIGITAL, ANALOGUE}


def test_a_text_in_a_configuration_file_is_no_number(tmp_path: Path) -> None:
    dcf = with_value("1400sub1", "later", "ParameterValue")
    (tmp_path / "io.dcf").write_text(dcf, encoding="utf-8")
    assert set(watched(tmp_path, 'configuration = "io.dcf"').rpdos) == {DIGITAL, ANALOGUE}


def test_a_bit_has_no_scale(tmp_path: Path) -> None:
    base = BASE.replace('data_type = "int16"', 'data_type = "bool"').replace("6411:01", "6220:01")
    more = (
        'configure = [{ object = "1401:01", type = "uint32", value = 0x315 }, '
        '{ object = "1601:00", type = "uint8", value = 1 }, '
        '{ object = "1601:01", type = "uint32", value = 0x62200101 }]'
    )
    found = mapped(tmp_path, base=base, more=more, outputs=f"{OWNED}on_expiry = {{ pressure = true }}")
    assert (found.rpdos[ANALOGUE].mask, found.rpdos[ANALOGUE].safe) == (1, 1)


def test_an_empty_place_is_no_output(tmp_path: Path) -> None:
    found = watched(tmp_path, eds=with_value("1600sub1", ""))
    assert (found.rpdos[DIGITAL].bytes, found.rpdos[DIGITAL].mask) == (1, 0xFF)


def test_no_more_is_mapped_than_there_may_be(tmp_path: Path) -> None:
    """CiA 301 §7.5.2.36: 64 at the most, whatever a file says."""
    eds = with_value("1600sub0", "65") + "\n[1600sub41]\nDefaultValue=0x62000108\n"
    assert watched(tmp_path, eds=eds).rpdos[DIGITAL].bytes == 2


def test_a_section_of_another_kind_is_none_of_an_object(tmp_path: Path) -> None:
    eds = EDS.replace("[1400sub2]", "[Comments]\nParameterValue=0x345\n\n[1400sub2]")
    assert set(watched(tmp_path, eds=eds).rpdos) == {DIGITAL, ANALOGUE}


def test_a_mark_before_a_section_is_none(tmp_path: Path) -> None:
    path = written(tmp_path, io())
    at = EDS.index("[1400sub1]")
    section = EDS[at : EDS.index("[1400sub2]")]
    text = section + EDS.replace(section, "")
    (tmp_path / "io.eds").write_bytes(text.encode("utf-8-sig"))
    (bus,) = plan(load_site(path), tmp_path)
    assert set(bus.outputs[0].rpdos) == {DIGITAL, ANALOGUE}


def test_a_comment_is_no_key(tmp_path: Path) -> None:
    eds = EDS.replace("[1400sub1]\n", "[1400sub1]\n#DefaultValue=1\n;DefaultValue=1\n")
    assert set(watched(tmp_path, eds=eds).rpdos) == {DIGITAL, ANALOGUE}


def test_an_empty_key_is_none(tmp_path: Path) -> None:
    eds = EDS.replace("[1400sub1]\n", "[1400sub1]\nDefaultValue=\n")
    assert set(watched(tmp_path, eds=eds).rpdos) == {DIGITAL, ANALOGUE}


def test_other_elements_of_an_object_are_none(tmp_path: Path) -> None:
    eds = XDD.replace('objectType="9">', 'objectType="9">\n <Label lang="en" />')
    assert set(watched(tmp_path, eds=eds).rpdos) == {0x345}


def test_an_xdd_has_hexadecimal_types(tmp_path: Path) -> None:
    """0011h is a REAL64."""
    eds = XDD.replace(
        'dataType="0005">\n <CANopenSubObject subIndex="01" name="V',
        'dataType="0011">\n <CANopenSubObject subIndex="01" name="V',
    )
    eds = eds.replace("0x62000108", "0x62000140")
    found = watched(tmp_path, eds=eds)
    assert found.rpdos[0x345].mask == (1 << 64) - 1
