"""Bytes of a text file as lines, whatever its encoding."""

from __future__ import annotations

import codecs
import re
from typing import Final

from bridge.eds.model import Report

_LINE_END: Final = re.compile(r"\r\n|\n|\r")
_BYTE_LINE: Final = re.compile(rb"(\r\n|\n|\r)")


def decode(content: bytes, report: Report) -> str:
    """UTF-8 with or without a byte order mark, UTF-16 with one; a line that is neither is Windows-1252."""
    for mark, encoding in ((codecs.BOM_UTF16_LE, "utf-16-le"), (codecs.BOM_UTF16_BE, "utf-16-be")):
        if content.startswith(mark):
            report.warning(1, "is UTF-16: read as such")
            return content[len(mark) :].decode(encoding, "replace")
    if content.startswith(codecs.BOM_UTF8):
        report.warning(1, "begins with a byte order mark: skipped")
        content = content.removeprefix(codecs.BOM_UTF8)
    try:
        return content.decode("utf-8")
    except UnicodeDecodeError:
        return _by_lines(content, report)


def _by_lines(content: bytes, report: Report) -> str:
    """Each line by itself: tools join what they have from files of other encodings."""
    parts = _BYTE_LINE.split(content)
    others: list[int] = []
    is_mixed = False
    for number, line in enumerate(parts[::2], 1):
        try:
            text = line.decode("utf-8")
            is_mixed |= not text.isascii()
        except UnicodeDecodeError:
            text = line.decode("cp1252", "replace")
            others.append(number)
        parts[2 * number - 2] = text.encode()
    more = len(others) - 1
    told = "is neither ASCII nor UTF-8: read as Windows-1252"
    if is_mixed:
        too = f", as {more} other line{'s' if more > 1 else ''}" if more else ""
        told += f"{too}; the rest is UTF-8"
    report.warning(others[0], told)
    return b"".join(parts).decode()


def lines(text: str) -> list[str]:
    """Lines ended by LF, CR LF or CR, without their ends; no other character ends one."""
    return _LINE_END.split(text)
