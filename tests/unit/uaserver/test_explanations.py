"""Diagnostic information on the wire; no server."""

from __future__ import annotations

import pytest
from asyncua import ua
from asyncua.common.utils import Buffer
from asyncua.ua.ua_binary import struct_from_binary, struct_to_binary

from bridge.uaserver.explanations import Explanation, add_explanations, fault

WHY = Explanation("parameter.refused", "urn:codes", ua.LocalizedText("no", "en"), "SDO abort 06090030h")
ALL, SYMBOL, TEXT, MORE = 0xE0, 0x20, 0x40, 0x80


def answer(asked: int, explained: dict[int, Explanation], operations: int = 3) -> ua.WriteResponse:
    response = ua.WriteResponse()
    add_explanations(ua.RequestHeader(ReturnDiagnostics=asked), response, explained, operations)
    return struct_from_binary(ua.WriteResponse, Buffer(struct_to_binary(response)))


def test_an_operation_that_is_explained_has_what_was_asked_for() -> None:
    told = answer(ALL, {1: WHY})
    table = told.ResponseHeader.StringTable
    empty, info, _ = told.DiagnosticInfos
    assert (empty.SymbolicId, empty.AdditionalInfo) == (None, None)
    assert [table[one] for one in (info.SymbolicId, info.NamespaceURI, info.Locale, info.LocalizedText)] == [
        "parameter.refused",
        "urn:codes",
        "en",
        "no",
    ]
    assert info.AdditionalInfo == "SDO abort 06090030h"


@pytest.mark.parametrize(("asked", "mask"), [(SYMBOL, 0x03), (TEXT, 0x0C), (MORE, 0x10), (ALL, 0x1F)])
def test_the_mask_is_that_of_the_standard(asked: int, mask: int) -> None:
    """Part 6 §5.2.2.12."""
    response = ua.WriteResponse()
    add_explanations(ua.RequestHeader(ReturnDiagnostics=asked), response, {0: WHY}, 1)
    assert struct_to_binary(response.DiagnosticInfos[0])[0] == mask


@pytest.mark.parametrize("asked", [0, 0x1F, 0x300])
def test_who_asks_for_nothing_of_operations_gets_nothing(asked: int) -> None:
    assert answer(asked, {1: WHY}).DiagnosticInfos == []


def test_texts_are_told_once_and_not_without_end() -> None:
    same = answer(ALL, dict.fromkeys(range(1000), WHY), 1000)
    assert len(same.ResponseHeader.StringTable) == 4
    long = {n: Explanation(f"{n}", "", ua.LocalizedText("x" * 5000 + str(n), "en")) for n in range(500)}
    told = answer(TEXT, long, 500)
    assert sum(map(len, told.ResponseHeader.StringTable)) < 52_000
    assert len(told.DiagnosticInfos) == 500


def refused(asked: int, more: str = "") -> ua.ResponseHeader:
    response = fault(ua.RequestHeader(ReturnDiagnostics=asked), ua.StatusCodes.BadTooManyOperations, more)
    header = struct_from_binary(ua.ServiceFault, Buffer(struct_to_binary(response))).ResponseHeader
    assert header.ServiceResult.value == ua.StatusCodes.BadTooManyOperations
    return header


def test_a_fault_says_what_its_code_means_and_what_is_wrong_in_this_case() -> None:
    header = refused(0x07, "7 operations")
    info, table = header.ServiceDiagnostics, header.StringTable
    assert (info.SymbolicId, info.NamespaceURI) == (None, None), "codes of the standard have none"
    assert table[info.Locale] == "en"
    assert table[info.LocalizedText].startswith("The request could not be processed because it specified too")
    assert info.AdditionalInfo == "7 operations"


@pytest.mark.parametrize(("asked", "mask"), [(0x01, 0), (0x02, 0x0C), (0x04, 0x10), (0x07, 0x1C), (0xE0, 0)])
def test_a_fault_has_what_was_asked_for_of_the_service(asked: int, mask: int) -> None:
    header = refused(asked, "7 operations")
    assert struct_to_binary(header.ServiceDiagnostics)[0] == mask
    assert len(header.StringTable) == (2 if mask & 0x0C else 0)
