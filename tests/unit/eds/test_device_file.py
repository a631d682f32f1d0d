"""Files of any content, read or refused: nothing but ``FileFaults`` is ever raised."""

from __future__ import annotations

import contextlib
import json
from pathlib import Path
from tempfile import TemporaryDirectory

from hypothesis import given, settings
from hypothesis import strategies as st
from typer.testing import CliRunner

from bridge.base.errors import FileFaults
from bridge.cli.app import make_app
from bridge.eds import configuration, read_device
from bridge.eds.pdos import pdos
from bridge.mapping.loader import mappings_dir
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
    with contextlib.suppress(FileFaults):
        description = read_device(content, "wild.eds")
        for node_id in (None, 127):
            configuration(description, node_id)
            list(pdos(description, node_id))
        assert all(str(finding) for finding in description.findings)


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
