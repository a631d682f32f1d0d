"""XML as a small tree with line numbers, read by expat alone. Nothing outside the text is ever opened:
a document type, and with it every entity, is refused."""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import dataclass, field
from typing import Final, NoReturn
from xml.parsers import expat

from bridge.eds.model import Report
from bridge.text import Text

_DEEPEST: Final = 64
_MOST_ELEMENTS: Final = 500_000


class _XmlRefused(Exception):
    """XML that we refuse to read further; ``said`` is why."""

    def __init__(self, said: Text) -> None:
        super().__init__(said)
        self.said = said


@dataclass(slots=True)
class Element:
    """``tag`` and the names of ``attributes`` are without their namespace, attributes in lower case."""

    tag: str
    line: int
    attributes: dict[str, str] = field(default_factory=dict[str, str])
    children: list[Element] = field(default_factory=list["Element"])
    text: str = ""

    def walk(self) -> Iterator[Element]:
        """This element and all below it, in the order of the file."""
        waiting: list[Element] = [self]
        while waiting:
            element = waiting.pop()
            yield element
            waiting.extend(reversed(element.children))

    def all(self, tag: str) -> Iterator[Element]:
        """The elements with this name: this one and those below it."""
        return (element for element in self.walk() if element.tag == tag)

    def first(self, tag: str) -> Element | None:
        return next(self.all(tag), None)


def parse(content: bytes, report: Report) -> Element:
    """The tree of ``content``; if that breaks off, the part before, and a report of it."""
    builder = _Builder()
    # Expat decides on the encoding; an unknown one is an error like any other.
    parser = expat.ParserCreate()
    parser.buffer_text = True
    builder.attach(parser)
    try:
        parser.Parse(content, True)
    except expat.ExpatError as error:
        why = expat.ErrorString(error.code)
        report.breaks_off(error.lineno, Text.of("eds.not_xml", why=str(why)))
    except _XmlRefused as error:
        report.breaks_off(parser.CurrentLineNumber, error.said)
    except (ValueError, LookupError) as error:  # it declares an encoding that Python does not have
        report.error(1, Text.of("eds.not_decoded", why=str(error)))
    return builder.root


class _Builder:
    def __init__(self) -> None:
        self.root = Element("", 0)
        self._open = [self.root]
        self._count = 0

    def attach(self, parser: expat.XMLParserType) -> None:
        def start(tag: str, attributes: dict[str, str]) -> None:
            self._start(tag, attributes, parser.CurrentLineNumber)

        parser.StartElementHandler = start
        parser.EndElementHandler = self._end
        parser.CharacterDataHandler = self._characters
        parser.StartDoctypeDeclHandler = self._refuse
        parser.EntityDeclHandler = self._refuse
        parser.ExternalEntityRefHandler = self._refuse

    @staticmethod
    def _refuse(*details: object) -> NoReturn:
        del details
        raise _XmlRefused(Text.of("eds.document_type"))

    def _start(self, tag: str, attributes: dict[str, str], line: int) -> None:
        self._count += 1
        if self._count > _MOST_ELEMENTS or len(self._open) > _DEEPEST:
            raise _XmlRefused(Text.of("eds.too_many_xml_elements"))
        named = {_local(name).lower(): value.strip() for name, value in attributes.items()}
        element = Element(_local(tag), line, named)
        self._open[-1].children.append(element)
        self._open.append(element)

    def _end(self, tag: str) -> None:
        del tag
        self._open.pop()

    def _characters(self, text: str) -> None:
        self._open[-1].text += text


def _local(name: str) -> str:
    return name.rpartition(":")[2]
