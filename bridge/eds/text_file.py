"""Bytes of a text file as lines, whatever its encoding."""

from __future__ import annotations

import codecs
import re
from typing import Final

from bridge.eds.model import Report
from bridge.text import Text

_LINE_END: Final = re.compile(r"\r\n|\n|\r")
_BYTE_LINE: Final = re.compile(rb"(\r\n|\n|\r)")


def decode(content: bytes, report: Report) -> str:
    """UTF-8 with or without a byte order mark, UTF-16 with one; a line that is neither is Windows-1252."""
    for mark, encoding in ((codecs.BOM_UTF16_LE, "utf-16-le"), (codecs.BOM_UTF16_BE, "utf-16-be")):
        if content.startswith(mark):
            report.warning(1, Text.of("eds.utf_16"))
            return content[len(mark) :].decode(encoding, "replace")
    if content.startswith(codecs.BOM_UTF8):
        report.warning(1, Text.of("eds.byte_order_mark"))
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
    report.warning(others[0], _said(len(others) - 1) if is_mixed else Text.of("eds.windows_1252"))
    return b"".join(parts).decode()


def _said(more: int) -> Text:
    """Text on the first of the lines that are not UTF-8, of which there are so many ``more``."""
    if not more:
        return Text.of("eds.mixed")
    return Text.of("eds.mixed_one" if more == 1 else "eds.mixed_many", count=more)


def lines(text: str) -> list[str]:
    """Lines ended by LF, CR LF or CR, without their ends; no other character ends one."""
    return _LINE_END.split(text)
