"""Encodings of device descriptions: one for the file, or, where tools have joined two, one for each line."""

from __future__ import annotations

import pytest

from bridge.eds.model import Report
from bridge.eds.text_file import decode


@pytest.mark.parametrize(
    ("content", "text", "findings"),
    [
        ("a=Größe\n".encode(), "a=Größe\n", []),
        ("a=Größe\n".encode("cp1252"), "a=Größe\n", ["is neither ASCII nor UTF-8: read as Windows-1252"]),
        (
            b"x=1\r\n" + "a=Größe\r".encode("cp1252") + "b=Überlast µ\n".encode() + "c=ß".encode("cp1252"),
            "x=1\r\na=Größe\rb=Überlast µ\nc=ß",
            ["is neither ASCII nor UTF-8: read as Windows-1252, as 1 other line; the rest is UTF-8"],
        ),
    ],
)
def test_each_line_is_read_in_its_encoding(content: bytes, text: str, findings: list[str]) -> None:
    report = Report()
    assert decode(content, report) == text
    assert [str(one.said) for one in report.findings()] == findings
    assert all(
        one.line == content[: content.index("ö".encode("cp1252"))].count(b"\n") + 1
        for one in report.findings()
    )
