"""Files of any content, read or refused: nothing but ``FileFaults`` is ever raised, and all is told in both
languages."""

from __future__ import annotations

import json
from pathlib import Path
from tempfile import TemporaryDirectory

from hypothesis import given, settings
from hypothesis import strategies as st
from typer.testing import CliRunner

from bridge.base.errors import FileFaults
from bridge.cli.app import make_app
from bridge.eds import configuration, read_device
from bridge.eds.model import Report
from bridge.eds.pdos import pdos
from bridge.mapping.loader import mappings_dir
from bridge.text import LANGUAGES, render
from tests.support.nightly import examples
from tests.unit.eds.test_configuration import DCF
from tests.unit.eds.test_xdd import XDD

EDS = (mappings_dir() / "nord" / "sk-tu4-cao.eds").read_bytes()[1500:9000]
SCRAPS = [
    *(b"[1018sub", b"[2000]\n", b"$NODEID", b"=0x", b"DataType=", b"0x99999999999999999999", b"-1", b"\n"),
    *(b"CompactSubObj=254\n", b"CompactPDO=255\nNrOfRXPDO=512\n", b"ObjectType=8\n", b"SubNumber=", b"]"),
    *(b"<", b">", b"&a;", b"<!DOCTYPE a>", b'encoding="utf-7"', b"1e999", b"nan", b"\xff\xfe", b"\0"),
    *("²", "٣", "０"),
]
JUNK = st.sampled_from([scrap.encode() if isinstance(scrap, str) else scrap for scrap in SCRAPS])


@st.composite
def mutated(draw: st.DrawFn) -> bytes:
    content = draw(st.sampled_from([EDS, DCF.encode(), XDD.encode()]))
    for _ in range(draw(st.integers(1, 8))):
        place = draw(st.integers(0, len(content)))
        removed = draw(st.integers(0, 40))
        content = content[:place] + draw(JUNK | st.binary(max_size=8)) + content[place + removed :]
    return content


def use(content: bytes) -> None:
    try:
        description = read_device(content, "wild.eds")
    except FileFaults as error:
        assert all(render(fault.text, language) for fault in error.faults for language in LANGUAGES)
        return
    report = Report()
    for node_id in (None, 127):
        configuration(description, node_id, report)
        list(pdos(description, node_id))
    findings = (*description.findings, *report.findings())
    assert all(str(finding) for finding in findings)
    assert all(render(finding.said, language) for finding in findings for language in LANGUAGES)


def test_what_a_value_has_wrong_is_told_in_both_languages() -> None:
    content = b"[1000]\nParameterName=x\nDataType=5\nAccessType=ro\nDefaultValue=010\nHighLimit=300\n"
    odd, wrong = read_device(content, "wild.eds").findings[-2:]
    assert str(odd.said) == "DefaultValue: 010 is taken as 10, not as octal 8"
    assert render(odd.said, "de") == "DefaultValue: 010 wird als 10 gelesen, nicht oktal als 8"
    assert str(wrong.said) == "HighLimit: 300 is beyond UNSIGNED8: left out"
    assert render(wrong.said, "de") == "HighLimit: 300 liegt außerhalb von UNSIGNED8: weggelassen"


@given(st.binary(max_size=400))
@settings(max_examples=examples(300), deadline=None)
def test_random_bytes(content: bytes) -> None:
    use(content)


@given(mutated())
@settings(max_examples=examples(300), deadline=None)
def test_mutated_files(content: bytes) -> None:
    use(content)


@given(mutated())
@settings(max_examples=examples(30), deadline=None)
def test_the_command_prints_what_it_read(content: bytes) -> None:
    with TemporaryDirectory() as folder:
        file = Path(folder) / "wild.eds"
        file.write_bytes(content)
        result = CliRunner().invoke(make_app(), ["eds", str(file), "--json"])
    if result.exit_code == 0:
        assert "findings" in json.loads(result.stdout)
    else:
        assert isinstance(result.exception, FileFaults)
