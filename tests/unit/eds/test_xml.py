"""XML as a small tree with lines: names without their namespace, and nothing outside the text is opened."""

from __future__ import annotations

import pytest
from hypothesis import given
from hypothesis import strategies as st

from bridge.eds.model import Report
from bridge.eds.xml import parse

DOCUMENT = b"""<?xml version="1.0"?>
<x:Profile xmlns:x="http://x" xmlns:y="http://y">
  <x:Object Index=" 1018 " y:subIndex="01">text</x:Object>
  <Object><Object/></Object>
</x:Profile>"""


def test_names_are_without_their_namespace_and_values_without_blanks() -> None:
    report = Report()
    (root,) = parse(DOCUMENT, report).children
    assert (root.tag, root.line) == ("Profile", 2)
    first = root.first("Object")
    assert first is not None
    assert (first.attributes, first.line, first.text) == ({"index": "1018", "subindex": "01"}, 3, "text")
    assert report.findings() == ()


def test_elements_are_found_wherever_they_stand_in_their_order() -> None:
    root = parse(DOCUMENT, Report())
    assert [one.line for one in root.all("Object")] == [3, 4, 4]
    assert root.first("object") is None


@pytest.mark.parametrize(
    "content",
    [
        b"<!DOCTYPE a><a/>",
        b'<!DOCTYPE a [<!ENTITY b "c">]><a>&b;</a>',
        b'<!DOCTYPE a SYSTEM "file:///etc/passwd"><a/>',
        b'<!DOCTYPE a [<!ENTITY b SYSTEM "file:///etc/passwd">]><a>&b;</a>',
    ],
)
def test_a_document_type_is_refused(content: bytes) -> None:
    report = Report()
    root = parse(content, report)
    assert "document type or an entity" in str(report.findings()[0].said)
    assert report.broken_off_at == 1
    assert root.children == []


def test_what_stands_before_a_break_is_there() -> None:
    report = Report()
    root = parse(b"<a>\n<b/>\n<c", report)
    assert [one.tag for one in root.walk()] == ["", "a", "b"]
    assert report.broken_off_at == 3
    assert str(report.findings()[0].said).startswith("is not XML from here on: ")


def test_too_deep_a_tree_is_refused() -> None:
    report = Report()
    parse(b"<a>" * 100 + b"</a>" * 100, report)
    assert str(report.findings()[0].said) == "has too many elements, or too many within each other"
    fine = Report()
    parse(b"<a>" * 64 + b"</a>" * 64, fine)
    assert fine.findings() == ()


def test_an_encoding_that_nobody_has_is_told() -> None:
    report = Report()
    parse(b'<?xml version="1.0" encoding="klingon"?><a/>', report)
    assert len(report.findings()) == 1


@given(st.binary(max_size=60))
def test_no_content_raises(content: bytes) -> None:
    parse(b"<a>" + content, Report())
