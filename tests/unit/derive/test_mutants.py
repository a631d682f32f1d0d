"""Descriptions with changes that contradict what is left: each becomes a mapping that can be read, or is
refused in words."""

from __future__ import annotations

import contextlib
from pathlib import Path
from tempfile import TemporaryDirectory
from typing import Final

import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from bridge.base.errors import FileFaults, OperationFailed
from bridge.cli.family_command import new
from bridge.eds.model import Report
from bridge.eds.text_file import decode
from bridge.mapping.loader import mappings_dir, read_family
from tests.support.invented_eds import FIXED, SPIN, eds
from tests.support.nightly import examples

FILES: Final = [
    decode(content, Report()).splitlines()
    for content in (eds(SPIN), eds(FIXED), (mappings_dir() / "cia402" / "cia402.eds").read_bytes())
]
VALUES: Final = [
    *("", "0", "-1", "1", "7", "254", "0xFF", "0xFFFF", "0xFFFFFFFF", "0x100000000", "-0x80000000", "9" * 30),
    *("$NODEID", "$NODEID+0xFFFFFFFF", "0x", "nan", "1e999", "text", "const", "wo", "x" * 300, "a = [b]"),
    *('"', '"""', "'''", "\\", "ü", "\x1b[31m", "\u2028", "0x10 ; remark", "0x60400010", "0x60410020"),
]


@st.composite
def mutants(draw: st.DrawFn) -> str:
    text = list(draw(st.sampled_from(FILES)))
    places = st.integers(0, len(text) - 8)
    for _ in range(draw(st.integers(1, 6))):
        here, there = draw(places), draw(places)
        match draw(st.sampled_from(("value", "value", "value", "drop", "repeat", "exchange"))):
            case "value":
                while "=" not in text[here]:
                    here += 1
                key = text[here].partition("=")[0]
                other = text[there].partition("=")[2]
                text[here] = f"{key}={draw(st.sampled_from([*VALUES, other]))}"
            case "drop":
                text[here] = ""
            case "repeat":
                text[here] += f"\n{text[there]}"
            case _:
                text[here], text[there] = text[there], text[here]
    return "\n".join(text) + "\n"


@pytest.mark.landing
@given(mutants())
@settings(max_examples=examples(60), deadline=None)
def test_a_mapping_is_whole_or_not_there(text: str) -> None:
    with TemporaryDirectory() as folder:
        file, output = Path(folder) / "wild.eds", Path(folder) / "wild.toml"
        file.write_text(text, encoding="utf-8")
        with contextlib.suppress(FileFaults, OperationFailed):
            new(file, None, output)
            assert output.exists()
        if output.exists():
            read_family(output, (mappings_dir(),))
