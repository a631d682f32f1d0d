"""Bytes of a text file as lines, whatever its encoding."""

from __future__ import annotations

import codecs
import re
from typing import Final

from bridge.eds.model import Report

_LINE_END: Final = re.compile(r"\r\n|\n|\r")


def decode(content: bytes, report: Report) -> str:
    """UTF-8 with or without a byte order mark, UTF-16 with one, otherwise Windows-1252."""
    for mark, encoding in ((codecs.BOM_UTF16_LE, "utf-16-le"), (codecs.BOM_UTF16_BE, "utf-16-be")):
        if content.startswith(mark):
            report.warning(1, "is UTF-16: read as such")
            return content[len(mark) :].decode(encoding, "replace")
    if content.startswith(codecs.BOM_UTF8):
        report.warning(1, "begins with a byte order mark: skipped")
        content = content.removeprefix(codecs.BOM_UTF8)
    try:
        return content.decode("utf-8")
    except UnicodeDecodeError as error:
        line = len(re.findall(rb"\r\n|\n|\r", content[: error.start])) + 1
        report.warning(line, "is neither ASCII nor UTF-8: read as Windows-1252")
        return content.decode("cp1252", "replace")


def lines(text: str) -> list[str]:
    """Lines ended by LF, CR LF or CR, without their ends; no other character ends one."""
    return _LINE_END.split(text)
