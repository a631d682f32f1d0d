"""Browsing, on the standard's own address space; no server."""

from __future__ import annotations

import pytest
from asyncua import ua
from asyncua.common.utils import Buffer
from asyncua.server.address_space import AddressSpace
from asyncua.ua.ua_binary import struct_from_binary

from bridge.uaserver.browsing import MOST_CONTINUATION_POINTS, Browser
from bridge.uaserver.encoding import Results
from bridge.uaserver.library import ServiceError

Codes, Ids = ua.StatusCodes, ua.ObjectIds
ROOT, OBJECTS = ua.NodeId(Ids.RootFolder), ua.NodeId(Ids.ObjectsFolder)
NAMES = ["Objects", "Types", "Views"]


class Kept(Results):
    """Results as they were before they were encoded."""

    def __init__(self) -> None:
        super().__init__(1_000_000)
        self.found: list[ua.BrowseResult] = []

    async def add(self, result: object) -> None:
        self.found.append(result)
        await super().add(result)


def asked(where: ua.NodeId = ROOT, **more: object) -> ua.BrowseDescription:
    fields = {
        "NodeId": where,
        "ReferenceTypeId": ua.NodeId(Ids.HierarchicalReferences),
        "ResultMask": ua.BrowseResultMask.All,
    }
    return ua.BrowseDescription(**(fields | more))


async def browse(browser: Browser, *wanted: ua.BrowseDescription, most: int = 0) -> list[ua.BrowseResult]:
    results = Kept()
    params = ua.BrowseParameters(RequestedMaxReferencesPerNode=most, NodesToBrowse=list(wanted))
    await browser.browse(params, results)
    return results.found


def names(result: ua.BrowseResult) -> list[str]:
    return [one.BrowseName.Name for one in result.References]


@pytest.mark.landing
async def test_a_browse_goes_on_where_it_stopped(space: AddressSpace) -> None:
    browser = Browser(space)
    (whole,) = await browse(browser, asked())
    assert (names(whole), whole.ContinuationPoint) == (NAMES, None)
    (first,) = await browse(browser, asked(), most=2)
    assert names(first) == NAMES[:2]
    again = ua.BrowseNextParameters(False, [first.ContinuationPoint])
    (rest,) = browser.browse_next(again)
    assert names(rest) == NAMES[2:]
    (used,) = browser.browse_next(again)
    assert used.StatusCode.value == Codes.BadContinuationPointInvalid


async def test_continuation_points_are_few_and_can_be_released(space: AddressSpace) -> None:
    browser = Browser(space)
    found = await browse(browser, *[asked()] * (MOST_CONTINUATION_POINTS + 1), most=1)
    assert [one.StatusCode.value for one in found[-2:]] == [Codes.Good, Codes.BadNoContinuationPoints]
    points = [one.ContinuationPoint for one in found[:-1]]
    assert browser.browse_next(ua.BrowseNextParameters(True, points)) == []
    (one,) = await browse(browser, asked(), most=1)
    assert one.StatusCode.is_good()


@pytest.mark.parametrize(
    ("wanted", "code"),
    [
        (asked(ua.NodeId("nowhere", 7)), Codes.BadNodeIdUnknown),
        (asked(BrowseDirection=ua.BrowseDirection.Invalid), Codes.BadBrowseDirectionInvalid),
        (asked(ReferenceTypeId=ua.NodeId("nowhere", 7)), Codes.BadReferenceTypeIdInvalid),
        (asked(ReferenceTypeId=ROOT), Codes.BadReferenceTypeIdInvalid),
    ],
)
async def test_what_cannot_be_browsed_is_refused(
    space: AddressSpace, wanted: ua.BrowseDescription, code: int
) -> None:
    (found,) = await browse(Browser(space), wanted)
    assert found.StatusCode.value == code


async def test_directions_types_classes_and_fields_count(space: AddressSpace) -> None:
    browser = Browser(space)
    inverse, exact, classes, masked = await browse(
        browser,
        asked(OBJECTS, BrowseDirection=ua.BrowseDirection.Inverse),
        asked(IncludeSubtypes=False),
        asked(NodeClassMask=ua.NodeClass.Variable),
        asked(ResultMask=ua.BrowseResultMask.BrowseName),
    )
    assert names(inverse) == ["Root"]
    assert names(exact) == [] == names(classes)
    assert names(masked) == NAMES
    assert {(one.NodeClass, one.DisplayName.Text) for one in masked.References} == {
        (ua.NodeClass.Unspecified, None)
    }


async def test_views_are_not_known(space: AddressSpace) -> None:
    params = ua.BrowseParameters(ua.ViewDescription(ua.NodeId(87)), 0, [asked()])
    with pytest.raises(ServiceError) as refused:
        await Browser(space).browse(params, Kept())
    assert refused.value.code == Codes.BadViewIdUnknown


@pytest.mark.parametrize(
    ("start", "path", "code"),
    [
        (ROOT, ["Objects", "Server"], Codes.Good),
        (ROOT, ["Objects", "Nothing"], Codes.BadNoMatch),
        (ROOT, [], Codes.BadNothingToDo),
        (ROOT, [""], Codes.BadBrowseNameInvalid),
        (ROOT, ["Objects"] * 101, Codes.BadTooManyMatches),
        (ua.NodeId("nowhere", 7), ["Objects"], Codes.BadNodeIdUnknown),
    ],
)
async def test_a_path_leads_to_each_target_once(
    space: AddressSpace, start: ua.NodeId, path: list[str], code: int
) -> None:
    elements = [
        ua.RelativePathElement(ua.NodeId(Ids.HierarchicalReferences), False, True, ua.QualifiedName(name))
        for name in path
    ]
    wanted = ua.BrowsePath(start, ua.RelativePath(elements))
    (found,) = await Browser(space).translate(ua.TranslateBrowsePathsToNodeIdsParameters([wanted]))
    assert found.StatusCode.value == code
    targets = [one.TargetId for one in found.Targets]
    assert targets == ([ua.NodeId(Ids.Server)] if code == Codes.Good else [])


async def test_what_is_encoded_is_what_was_found(space: AddressSpace) -> None:
    results = Results(1_000_000)
    await Browser(space).browse(ua.BrowseParameters(NodesToBrowse=[asked()]), results)
    decoded = struct_from_binary(ua.BrowseResult, Buffer(bytes(results.encoded)))
    assert names(decoded) == NAMES
