"""Opens a device description of any format."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import replace
from pathlib import Path
from typing import Final

from bridge.base.errors import Fault, FileFaults
from bridge.config import MODULES
from bridge.config.download import Download, parse_concise_dcf
from bridge.eds.configuration import configuration
from bridge.eds.contradictions import contradictions
from bridge.eds.eds import read_eds
from bridge.eds.model import Description, FindingSeverity, Report
from bridge.eds.modules import UnknownModule
from bridge.eds.text_file import decode
from bridge.eds.xdd import read_xdd
from bridge.text import Text
from bridge.tomlfile import Unfit

CONCISE_SUFFIXES: Final = (".cdcf", ".concise", ".bin")
_MOST_BYTES: Final = 16 << 20
_XML_STARTS: Final = (b"<", b"\xef\xbb\xbf<", b"\xff\xfe<", b"\xfe\xff\0<")


def read_device_file(path: Path, modules: Sequence[str] = ()) -> Description:
    """The description in ``path``, with its oddities in ``findings``. ``modules`` are those that are plugged
    in, in their order, by order code, name or number; left out, those that the file itself connects.

    Raises ``FileFaults`` if it cannot be opened, is no device description, or has no such module.
    """
    return read_device(contents(path), str(path), modules)


def read_device(content: bytes, name: str, modules: Sequence[str] = ()) -> Description:
    """Description as ``read_device_file`` gives it, from a file's content; ``name`` is for messages."""
    report = Report()
    is_xml = content.lstrip(b" \t\r\n").startswith(_XML_STARTS)
    if is_xml and modules:
        said = Text.of("eds.xdd_has_modules")
        raise FileFaults([Fault(name, 0, MODULES, said, Text.of("eds.xdd_has_modules_advice"))])
    try:
        description = (
            read_xdd(content, report) if is_xml else read_eds(decode(content, report), report, modules)
        )
    except UnknownModule as error:
        raise FileFaults([Fault(name, 0, MODULES, error.said, error.hint)]) from None
    findings = report.findings()
    if not description.objects:
        first = next((one for one in findings if one.severity is FindingSeverity.ERROR), None)
        line = first.line if first else 0
        said = Text.of("eds.no_objects_because", why=first.said) if first else Text.of("eds.no_objects")
        raise FileFaults([Fault(name, line, "", said, Text.of("eds.no_objects_advice"))])
    for one in contradictions(description):
        report.warning(one.line, one.said)
    return replace(description, findings=report.findings(), broken_off_at=report.broken_off_at)


def read_whole_device_file(path: Path, modules: Sequence[str] = ()) -> Description:
    """Description as ``read_device_file`` gives it, for those who make something of it: half a description is
    none, and raises ``FileFaults``, too."""
    description = read_device_file(path, modules)
    line = description.broken_off_at
    if line is None:
        return description
    why = next(one.said for one in reversed(description.findings) if one.line == line)
    said = Text.of("eds.breaks_off", why=why)
    raise FileFaults([Fault(str(path), line, "", said, Text.of("eds.breaks_off_advice"))])


def contents(path: Path) -> bytes:
    """The bytes of ``path``. Raises ``FileFaults``."""
    try:
        with path.open("rb") as file:
            content = file.read(_MOST_BYTES + 1)
    except (OSError, ValueError) as error:
        why = getattr(error, "strerror", None) or str(error)
        raise FileFaults([Fault(str(path), 0, "", Text.of("toml.unreadable", why=str(why)))]) from error
    if len(content) > _MOST_BYTES:
        said = Text.of("eds.too_large", most_mib=_MOST_BYTES >> 20)
        raise FileFaults([Fault(str(path), 0, "", said)])
    return content


def read_configuration(path: Path, node_id: int | None = None) -> tuple[Download, ...]:
    """The downloads of a DCF, XDC or concise DCF for the node ``node_id``.

    Raises ``FileFaults`` if the file, or any part of it, cannot be read: half a configuration is none.
    """
    content = contents(path)
    if path.suffix.lower() in CONCISE_SUFFIXES:
        try:
            return parse_concise_dcf(content)
        except Unfit as error:
            raise FileFaults([Fault(str(path), 0, "", error.said)]) from error
    report = Report()
    description = read_device(content, str(path))
    downloads = configuration(description, node_id, report)
    findings = (*description.findings, *report.findings())
    faults = [
        Fault(str(path), one.line, "", one.said) for one in findings if one.severity is FindingSeverity.ERROR
    ]
    if faults:
        raise FileFaults(faults)
    return downloads
