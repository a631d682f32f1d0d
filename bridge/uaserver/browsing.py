"""Browse, BrowseNext and TranslateBrowsePathsToNodeIds (OPC 10000-4 §5.9).

asyncua gives back more references than are asked for, knows no BrowseNext, looks at no result mask, and
finds the target of a path as often as there are references to it.
"""

from __future__ import annotations

import asyncio
import secrets
from collections.abc import Sequence
from dataclasses import dataclass
from typing import Final

from asyncua.server.address_space import AddressSpace

from bridge.uaserver.encoding import Results
from bridge.uaserver.hierarchy import subtypes
from bridge.uaserver.library import (
    AttributeIds,
    ObjectIds,
    ServiceError,
    StatusCodes,
    get,
    make,
    node_id,
    status,
    ua,
)

MOST_CONTINUATION_POINTS: Final = 20
"""Limit for one session."""

_NULL: Final = node_id(ObjectIds.Null)
_BEFORE_YIELD: Final = 5_000
"""References that are looked at before others have their turn."""

_MOST_REFERENCES: Final = 100_000
"""Limit for one response."""

_LONGEST_PATH: Final = 100
_POINT_BYTES: Final = 8
_WHOLE_PATH: Final = 0xFFFF_FFFF
_FIELDS: Final = {
    ua.BrowseResultMask.ReferenceTypeId: ("ReferenceTypeId", _NULL),
    ua.BrowseResultMask.IsForward: ("IsForward", False),
    ua.BrowseResultMask.NodeClass: ("NodeClass", ua.NodeClass.Unspecified),
    ua.BrowseResultMask.BrowseName: ("BrowseName", ua.QualifiedName()),
    ua.BrowseResultMask.DisplayName: ("DisplayName", ua.LocalizedText()),
    ua.BrowseResultMask.TypeDefinition: ("TypeDefinition", ua.ExpandedNodeId()),
}
"""Value of a field that is not in the mask."""

_ALL_FIELDS: Final = int(ua.BrowseResultMask.All)


@dataclass(frozen=True, slots=True)
class _Rest:
    """References of a browse that are still to be sent, at most ``most`` in an answer."""

    references: Sequence[ua.ReferenceDescription]
    most: int


class Browser:
    """The View services of one session, with its continuation points."""

    def __init__(self, space: AddressSpace) -> None:
        self._space = space
        self._rests: dict[bytes, _Rest] = {}
        self._subtypes: dict[ua.NodeId, set[ua.NodeId]] = {}
        self._looked_at = 0

    async def browse(self, params: ua.BrowseParameters, results: Results) -> None:
        if get(get(params, "View"), "ViewId") != _NULL:
            raise ServiceError(StatusCodes.BadViewIdUnknown)
        most: int = get(params, "RequestedMaxReferencesPerNode")
        left = _MOST_REFERENCES
        for wanted in get(params, "NodesToBrowse"):
            await self._rest()
            try:
                result = self._tell(_Rest(self._references(wanted), most))
            except ServiceError as error:
                result = _refused(int(error.code))
            left -= len(get(result, "References"))
            if left < 0:
                raise ServiceError(StatusCodes.BadResponseTooLarge)
            await results.add(result)

    async def _rest(self) -> None:
        if self._looked_at >= _BEFORE_YIELD:
            self._looked_at = 0
            await asyncio.sleep(0)

    def browse_next(self, params: ua.BrowseNextParameters) -> list[ua.BrowseResult]:
        points: list[bytes] = get(params, "ContinuationPoints")
        if get(params, "ReleaseContinuationPoints"):
            for point in points:
                self._rests.pop(point, None)
            return []
        results: list[ua.BrowseResult] = []
        for point in points:
            rest = self._rests.pop(point, None)
            invalid = StatusCodes.BadContinuationPointInvalid
            results.append(_refused(invalid) if rest is None else self._tell(rest))
        return results

    def _tell(self, rest: _Rest) -> ua.BrowseResult:
        if not rest.most or len(rest.references) <= rest.most:
            return make(ua.BrowseResult, References=rest.references)
        if len(self._rests) >= MOST_CONTINUATION_POINTS:
            return _refused(StatusCodes.BadNoContinuationPoints)
        point = secrets.token_bytes(_POINT_BYTES)
        self._rests[point] = _Rest(rest.references[rest.most :], rest.most)
        return make(ua.BrowseResult, ContinuationPoint=point, References=rest.references[: rest.most])

    def _references(self, wanted: ua.BrowseDescription) -> list[ua.ReferenceDescription]:
        node = self._space.get(get(wanted, "NodeId"))
        if node is None:
            raise ServiceError(StatusCodes.BadNodeIdUnknown)
        direction: ua.BrowseDirection = get(wanted, "BrowseDirection")
        if direction == ua.BrowseDirection.Invalid:
            raise ServiceError(StatusCodes.BadBrowseDirectionInvalid)
        types = self._types(get(wanted, "ReferenceTypeId"), get(wanted, "IncludeSubtypes"))
        classes: int = get(wanted, "NodeClassMask")
        forward = direction == ua.BrowseDirection.Forward
        mask: int = get(wanted, "ResultMask")
        references = node.references
        self._looked_at += len(references) + 1
        return [
            _masked(found, mask)
            for found in references
            if (direction == ua.BrowseDirection.Both or get(found, "IsForward") == forward)
            and (types is None or get(found, "ReferenceTypeId") in types)
            and (not classes or classes & get(found, "NodeClass"))
        ]

    def _types(self, type_id: ua.NodeId, with_subtypes: bool) -> set[ua.NodeId] | None:
        """The reference types that are meant, None for all."""
        if type_id == _NULL:
            return None
        known = self._subtypes.get(type_id)
        if with_subtypes and known is not None:
            return known
        node = self._space.get(type_id)
        held = node.attributes.get(AttributeIds.NodeClass) if node else None
        kind = held.value.Value.Value if held and held.value and held.value.Value else None
        if kind != ua.NodeClass.ReferenceType:
            raise ServiceError(StatusCodes.BadReferenceTypeIdInvalid)
        if not with_subtypes:
            return {type_id}
        return self._subtypes.setdefault(type_id, subtypes(self._space, type_id))

    async def translate(
        self, params: ua.TranslateBrowsePathsToNodeIdsParameters
    ) -> list[ua.BrowsePathResult]:
        return [await self._translate(path) for path in get(params, "BrowsePaths")]

    async def _translate(self, path: ua.BrowsePath) -> ua.BrowsePathResult:
        elements: list[ua.RelativePathElement] = get(get(path, "RelativePath"), "Elements") or []
        start: ua.NodeId = get(path, "StartingNode")
        code = StatusCodes.Good
        if start not in self._space:
            code = StatusCodes.BadNodeIdUnknown
        elif not elements:
            code = StatusCodes.BadNothingToDo
        elif len(elements) > _LONGEST_PATH:
            code = StatusCodes.BadTooManyMatches
        elif not all(get(element, "TargetName").Name for element in elements):
            code = StatusCodes.BadBrowseNameInvalid
        if code:
            return make(ua.BrowsePathResult, StatusCode=status(code))
        there = {start: None}
        for element in elements:
            there = self._step(there, element)
            await self._rest()
        if not there:
            return make(ua.BrowsePathResult, StatusCode=status(StatusCodes.BadNoMatch))
        targets = [
            make(ua.BrowsePathTarget, TargetId=target, RemainingPathIndex=_WHOLE_PATH) for target in there
        ]
        return make(ua.BrowsePathResult, Targets=targets)

    def _step(self, there: dict[ua.NodeId, None], element: ua.RelativePathElement) -> dict[ua.NodeId, None]:
        """Every node one element further, once and in their order."""
        try:
            types = self._types(get(element, "ReferenceTypeId"), get(element, "IncludeSubtypes"))
        except ServiceError:
            return {}
        name, inverse = get(element, "TargetName"), get(element, "IsInverse")
        further: dict[ua.NodeId, None] = {}
        for where in there:
            node = self._space.get(where)
            references = node.references if node else []
            self._looked_at += len(references) + 1
            for found in references:
                if get(found, "BrowseName") != name or get(found, "IsForward") == inverse:
                    continue
                if types is None or get(found, "ReferenceTypeId") in types:
                    further[get(found, "NodeId")] = None
        return further


def _refused(code: int) -> ua.BrowseResult:
    return make(ua.BrowseResult, StatusCode=status(code))


def _masked(found: ua.ReferenceDescription, mask: int) -> ua.ReferenceDescription:
    """The reference with nothing but the fields in the mask."""
    if mask & _ALL_FIELDS == _ALL_FIELDS:
        return found
    fields = {name: get(found, name) if mask & bit else nothing for bit, (name, nothing) in _FIELDS.items()}
    return make(ua.ReferenceDescription, NodeId=get(found, "NodeId"), **fields)
