"""Objects of a node's configuration: from the site file, and from a concise DCF."""

from __future__ import annotations

from dataclasses import replace
from pathlib import Path

import pytest
from hypothesis import example, given
from hypothesis import strategies as st

from bridge.base.errors import FileFaults
from bridge.config import load_site
from bridge.config.download import COMMANDS, Download, parse_concise_dcf, to_concise_dcf

# Store and restore (1010h, 1011h) come back as commands, which are not read back.
downloads = st.builds(
    Download,
    st.integers(0, 0xFFFF).filter(lambda index: index not in COMMANDS),
    st.integers(0, 0xFF),
    st.binary(min_size=1, max_size=40),
)


@given(st.lists(downloads, max_size=20))
@example([Download(0x1010, 1, b"save"), Download(0x1011, 1, b"load"), Download(0x1012, 0, b"\0")])
def test_a_concise_dcf_comes_back_as_it_was(objects: list[Download]) -> None:
    """But for what stores and restores: that is a command, and reads back as something else."""
    expected = [replace(one, read_back=one.index not in (0x1010, 0x1011)) for one in objects]
    assert parse_concise_dcf(to_concise_dcf(tuple(objects))) == tuple(expected)


@given(st.lists(downloads, min_size=1, max_size=5), st.data())
def test_a_concise_dcf_that_was_cut_is_refused(objects: list[Download], data: st.DataObject) -> None:
    whole = to_concise_dcf(tuple(objects))
    with pytest.raises(ValueError, match=r"ends|short|size"):
        parse_concise_dcf(whole[: data.draw(st.integers(0, len(whole) - 1))])


@given(st.binary(max_size=200))
def test_nonsense_is_refused_or_understood_never_more(content: bytes) -> None:
    try:
        found = parse_concise_dcf(content)
    except ValueError:
        return
    assert to_concise_dcf(found) == content


SITE = """\
[site]
name = "s"
[[bus]]
name = "can0"
interface = "virtual"
[[bus.node]]
name = "n"
id = 5
mapping = "nord/sk-tu4-cao"
[[bus.node.configure]]
object = {object}
type = "{type}"
value = {value}
[[bus.node.drive]]
slot = "fu1"
{drive}
"""


@pytest.mark.parametrize(
    ("changed", "line", "words"),
    [
        ({"object": '"2097"'}, 11, 'must be an object as "2097:01"'),
        ({"type": "uint17"}, 12, "must be"),
        ({"value": "70000"}, 13, "a uint16 is 0…65535"),
        ({"value": '"five"'}, 13, "a uint16 is a whole number"),
        ({"value": "[1]"}, 13, "must be a number, true or false, or a text in quotes"),
        ({"value": "{ a = 1 }"}, 13, "must be a number, true or false, or a text in quotes"),
        ({"type": "uint17", "value": "70000"}, 12, 'did you mean "uint16"?'),
        ({"drive": "tpdo = { transmission_type = 256 }"}, 16, "must be at most 255"),
        ({"drive": 'rpdo = { mapping = ["3000:01"] }'}, 16, "its length in bits"),
        ({"drive": f"rpdo = {{ mapping = {['3000:01/16'] * 5} }}"}, 16, "has 80 bits, a PDO has 64"),
    ],
)
def test_what_does_not_fit_is_a_fault_with_its_line(
    tmp_path: Path, changed: dict[str, str], line: int, words: str
) -> None:
    given_keys = {"object": '"2097:01"', "type": "uint16", "value": "500", "drive": ""}
    path = tmp_path / "site.toml"
    path.write_text(SITE.format(**given_keys | changed), encoding="utf-8")
    with pytest.raises(FileFaults) as caught:
        load_site(path)
    [fault] = caught.value.faults
    assert fault.line == line, fault
    assert words in str(fault)
