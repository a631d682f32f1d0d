"""Diagnostic information of operations and faults, for clients that ask for it (OPC 10000-4 §7.12, §7.32)."""

from __future__ import annotations

from collections.abc import Callable, Mapping
from dataclasses import dataclass, field
from typing import Any, Final

from bridge.uaserver.library import change, describe_code, get, make, status, text, ua

_SYMBOLIC_ID: Final = 0x20
_LOCALIZED_TEXT: Final = 0x40
_ADDITIONAL_INFO: Final = 0x80
_ASKED_FOR: Final = _SYMBOLIC_ID | _LOCALIZED_TEXT | _ADDITIONAL_INFO
"""Bits of ``returnDiagnostics`` for single operations (Part 4 §7.32)."""
_BITS_OF_SERVICE: Final = 5
"""Places by which the bits for the service as a whole are lower."""

_LONGEST: Final = 1_000
_MOST_CHARACTERS: Final = 50_000
"""Limit for all texts of one response; operations beyond it have no diagnostic information."""


@dataclass(frozen=True, slots=True)
class Explanation:
    """Reason why an operation ended as it did: ``symbol`` for programs, one of ``namespace``, "" for none,
    ``text`` for people, ``more`` as whoever has refused it says it."""

    symbol: str
    namespace: str
    text: ua.LocalizedText
    more: str = ""


Explain = Callable[[int, Explanation], None]
"""Takes the explanation of the operation at a place."""


@dataclass(slots=True)
class _Strings:
    """String table of a response."""

    known: dict[str, int] = field(default_factory=dict[str, int])
    characters: int = 0

    def place(self, words: str | None) -> int:
        words = (words or "")[:_LONGEST]
        if words not in self.known:
            self.known[words] = len(self.known)
            self.characters += len(words)
        return self.known[words]


def wants_explanations(header: ua.RequestHeader) -> bool:
    return bool(get(header, "ReturnDiagnostics") & _ASKED_FOR)


def add_explanations(
    header: ua.RequestHeader, response: Any, explained: Mapping[int, Explanation], operations: int
) -> None:
    """Give the ``response`` to a request with this ``header`` what it asks for of the operations that are
    explained."""
    asked: int = get(header, "ReturnDiagnostics")
    if not explained or not asked & _ASKED_FOR:
        return
    strings = _Strings()
    infos = [ua.DiagnosticInfo() for _ in range(operations)]
    for place, one in sorted(explained.items()):
        if strings.characters < _MOST_CHARACTERS:
            infos[place] = _info(one, asked, strings)
    response.DiagnosticInfos = infos
    response.ResponseHeader.StringTable = list(strings.known)


def fault(header: ua.RequestHeader, code: int, more: str = "") -> ua.ServiceFault:
    """Answer to a request with this ``header`` that is refused with ``code``. Who asks is told what the
    code means, and ``more`` of this one case. Codes of the standard have no symbol (Part 4 §7.12)."""
    fields: dict[str, object] = {"ServiceResult": status(code)}
    asked: int = get(header, "ReturnDiagnostics") << _BITS_OF_SERVICE
    if asked & (_LOCALIZED_TEXT | _ADDITIONAL_INFO):
        strings = _Strings()
        why = Explanation("", "", text(describe_code(code)), more)
        fields |= {"ServiceDiagnostics": _info(why, asked, strings), "StringTable": list(strings.known)}
    response = ua.ServiceFault()
    change(get(response, "ResponseHeader"), **fields)
    return response


def _info(one: Explanation, asked: int, strings: _Strings) -> ua.DiagnosticInfo:
    fields: dict[str, object] = {}
    if asked & _SYMBOLIC_ID and one.symbol:
        fields |= {
            "SymbolicId": strings.place(one.symbol),
            "NamespaceURI": strings.place(one.namespace),
        }
    if asked & _LOCALIZED_TEXT:
        # Always both: asyncua has their bits the wrong way round.
        fields |= {"Locale": strings.place(one.text.Locale), "LocalizedText": strings.place(one.text.Text)}
    if asked & _ADDITIONAL_INFO and one.more:
        more = one.more[:_LONGEST]
        strings.characters += len(more)
        fields["AdditionalInfo"] = more
    return make(ua.DiagnosticInfo, **fields)
