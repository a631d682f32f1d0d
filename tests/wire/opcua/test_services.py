"""Every service does what it says, or says that it does not: asyncua's client, below its convenience."""

from __future__ import annotations

import time

import pytest
from asyncua import Client, ua

from bridge.image import Quality
from bridge.northbound.opcua.server import OpcUaServer
from bridge.uaserver.services import SERVICES, Service
from tests.support.opcua_raw import ask, item, monitored, told
from tests.support.opcua_services import (
    LOAD,
    NAMESPACES,
    client,
    load,
    point,
    served,
    server,
    subscription,
    view,
)
from tests.support.opcua_site import LocalView, connected, namespace

__all__ = ["client", "served", "server", "view"]

pytestmark = pytest.mark.asyncio(loop_scope="module")
Codes, Ids, Attribute, Errors, Times = (
    ua.StatusCodes,
    ua.ObjectIds,
    ua.AttributeIds,
    ua.uaerrors,
    ua.TimestampsToReturn,
)


# the table


@pytest.mark.landing(6)
@pytest.mark.parametrize(
    "service",
    [one for name, services in SERVICES.items() if name != "SecureChannel" for one in services],
    ids=lambda service: service.name,
)
async def test_a_service_is_carried_out_or_refused_as_the_table_says(
    server: OpcUaServer, service: Service
) -> None:
    code = Codes.Good
    async with connected(server) as client:
        try:
            await ask(client, service.name)
        except ua.UaStatusCodeError as error:
            code = error.code
    if service.refused is not None:
        assert code == service.refused
    else:
        # An empty request has nothing to do; the service is there all the same.
        assert code not in (
            Codes.BadServiceUnsupported,
            Codes.BadNotImplemented,
            Codes.BadInternalError,
            Codes.BadUnexpectedError,
            Codes.BadUserAccessDenied,
        )


# attributes


class TestRead:
    async def test_part_of_a_value_is_read(self, client: Client, view: LocalView) -> None:
        load(view, 1.0)

        async def read(node: ua.NodeId, index_range: str) -> ua.DataValue:
            wanted = ua.ReadValueId(NodeId=node, AttributeId=Attribute.Value, IndexRange=index_range)
            (found,) = (await ask(client, "Read", NodesToRead=[wanted])).Results
            return found

        array = await client.get_namespace_array()
        assert (await read(NAMESPACES, "1:2")).Value.Value == array[1:3]
        assert (await read(NAMESPACES, "1:99")).Value.Value == array[1:]
        assert (await read(NAMESPACES, "0,5:8")).Value.Value == [array[0][5:9]]
        assert (await read(NAMESPACES, "99")).StatusCode.value == Codes.BadIndexRangeNoData
        assert (await read(NAMESPACES, "all")).StatusCode.value == Codes.BadIndexRangeInvalid
        assert (await read(await point(client, LOAD), "0")).StatusCode.value == Codes.BadIndexRangeNoData

    async def test_the_times_are_those_that_are_asked_for(self, client: Client, view: LocalView) -> None:
        load(view, 1.0)
        wanted = [ua.ReadValueId(NodeId=await point(client, LOAD), AttributeId=Attribute.Value)]
        for times, has in (
            (Times.Source, (True, False)),
            (Times.Both, (True, True)),
            (Times.Neither, (False, False)),
        ):
            (seen,) = (await ask(client, "Read", NodesToRead=wanted, TimestampsToReturn=times)).Results
            assert (seen.SourceTimestamp is not None, seen.ServerTimestamp is not None) == has
        with pytest.raises(Errors.BadTimestampsToReturnInvalid):
            await ask(client, "Read", NodesToRead=wanted, TimestampsToReturn=Times.Invalid)

    @pytest.mark.parametrize("age", [-1.0, float("nan")])
    async def test_an_age_that_is_none_is_refused(self, client: Client, age: float) -> None:
        wanted = [ua.ReadValueId(NodeId=NAMESPACES, AttributeId=Attribute.Value)]
        with pytest.raises(Errors.BadMaxAgeInvalid):
            await ask(client, "Read", NodesToRead=wanted, MaxAge=age)


# views


class TestBrowse:
    async def browse(self, client: Client, most: int = 0, **asked: object) -> ua.BrowseResult:
        wanted = {
            "NodeId": await point(client, "conveyor/fu1"),
            "BrowseDirection": ua.BrowseDirection.Forward,
            "ResultMask": 63,
        }
        description = ua.BrowseDescription(**(wanted | asked))
        params = {"RequestedMaxReferencesPerNode": most, "NodesToBrowse": [description]}
        (result,) = (await ask(client, "Browse", **params)).Results
        return result

    async def go_on(self, client: Client, point_: bytes, release: bool = False) -> list[ua.BrowseResult]:
        params = {"ContinuationPoints": [point_], "ReleaseContinuationPoints": release}
        return (await ask(client, "BrowseNext", **params)).Parameters.Results

    @pytest.mark.parametrize("most", [1, 3, 1000])
    async def test_what_is_left_follows(self, client: Client, most: int) -> None:
        whole = (await self.browse(client)).References
        result = await self.browse(client, most)
        assert bool(result.ContinuationPoint) == (most < len(whole))
        found = list(result.References)
        while result.ContinuationPoint:
            assert len(result.References) == most
            (result,) = await self.go_on(client, result.ContinuationPoint)
            found += result.References
        assert found == whole
        assert len(whole) > 10

    async def test_a_continuation_point_is_good_once_and_for_its_session(
        self, client: Client, server: OpcUaServer
    ) -> None:
        first = (await self.browse(client, 1)).ContinuationPoint
        async with connected(server) as other:
            (result,) = await self.go_on(other, first)
            assert result.StatusCode.value == Codes.BadContinuationPointInvalid
        await self.go_on(client, first)
        for wrong in (first, b"", b"mine"):
            (result,) = await self.go_on(client, wrong)
            assert result.StatusCode.value == Codes.BadContinuationPointInvalid
        second = (await self.browse(client, 1)).ContinuationPoint
        assert await self.go_on(client, second, release=True) == []
        (result,) = await self.go_on(client, second)
        assert result.StatusCode.value == Codes.BadContinuationPointInvalid

    async def test_continuation_points_are_not_without_end(self, client: Client) -> None:
        codes = [(await self.browse(client, 1)).StatusCode.value for _ in range(25)]
        assert codes == [Codes.Good] * 20 + [Codes.BadNoContinuationPoints] * 5
        told_ = client.get_node(Ids.Server_ServerCapabilities_MaxBrowseContinuationPoints)
        assert await told_.read_value() == 20

    async def test_fields_that_are_not_asked_for_are_empty(self, client: Client) -> None:
        result = await self.browse(client, ResultMask=ua.BrowseResultMask.BrowseName)
        for found in result.References:
            assert found.BrowseName.Name
            assert (found.NodeClass, found.IsForward, found.DisplayName.Text) == (0, False, None)
        assert (await self.browse(client)).References[0].DisplayName.Text, "the server's own are as they were"

    @pytest.mark.parametrize(
        ("asked", "code"),
        [
            ({"NodeId": ua.NodeId("nowhere", 2)}, Codes.BadNodeIdUnknown),
            ({"BrowseDirection": ua.BrowseDirection.Invalid}, Codes.BadBrowseDirectionInvalid),
            ({"ReferenceTypeId": ua.NodeId(Ids.FolderType)}, Codes.BadReferenceTypeIdInvalid),
            ({"ReferenceTypeId": ua.NodeId(4_000_000)}, Codes.BadReferenceTypeIdInvalid),
        ],
    )
    async def test_what_cannot_be_browsed_is_refused(
        self, client: Client, asked: dict[str, object], code: int
    ) -> None:
        assert (await self.browse(client, **asked)).StatusCode.value == code

    @pytest.mark.landing
    async def test_a_response_is_not_without_end(self, client: Client) -> None:
        wide = ua.BrowseDescription(ua.NodeId(Ids.BaseObjectType), ua.BrowseDirection.Both)
        with pytest.raises(Errors.BadResponseTooLarge):
            await ask(client, "Browse", NodesToBrowse=[wide] * 10_000)

    async def test_there_are_no_views(self, client: Client) -> None:
        somewhere = [ua.BrowseDescription(NodeId=ua.NodeId(Ids.ObjectsFolder))]
        with pytest.raises(Errors.BadViewIdUnknown):
            view = ua.ViewDescription(ViewId=ua.NodeId(Ids.ViewsFolder))
            await ask(client, "Browse", View=view, NodesToBrowse=somewhere)

    async def test_a_path_has_each_target_once(self, client: Client) -> None:
        space = await namespace(client)

        def path(*names: str, reference: int = Ids.HierarchicalReferences) -> ua.BrowsePath:
            elements = [
                ua.RelativePathElement(ua.NodeId(reference), False, True, ua.QualifiedName(name, space))
                for name in names
            ]
            return ua.BrowsePath(ua.NodeId(Ids.ObjectsFolder), ua.RelativePath(elements))

        wanted = [
            path("Drives", "conveyor", "fu1"),
            path("Drives", "nobody"),
            path(),
            path("Drives", ""),
            path("Drives", reference=Ids.FolderType),
        ]
        results = (await ask(client, "TranslateBrowsePathsToNodeIds", BrowsePaths=wanted)).Results
        assert [one.StatusCode.value for one in results] == [
            Codes.Good,
            Codes.BadNoMatch,
            Codes.BadNothingToDo,
            Codes.BadBrowseNameInvalid,
            Codes.BadNoMatch,
        ]
        (target,) = results[0].Targets
        assert (target.TargetId, target.RemainingPathIndex) == (ua.NodeId("conveyor/fu1", space), 0xFFFF_FFFF)


async def test_only_endpoints_of_the_profiles_are_named(client: Client) -> None:
    binary = "http://opcfoundation.org/UA-Profile/Transport/uatcp-uasc-uabinary"
    for profiles, there in (([], True), ([binary], True), (["http://example.org/https"], False)):
        answer = await ask(client, "GetEndpoints", ProfileUris=profiles)
        assert bool(answer.Endpoints) == there


async def test_a_node_is_registered_as_itself(client: Client) -> None:
    nodes = [await point(client, LOAD)]
    registered = (await ask(client, "RegisterNodes", NodesToRegister=nodes)).Parameters.RegisteredNodeIds
    assert registered == nodes
    assert (await client.get_node(registered[0]).read_browse_name()).Name == "Load"
    await ask(client, "UnregisterNodes", NodesToUnregister=nodes)


async def test_a_value_that_is_lost_is_told_whatever_its_part(client: Client, view: LocalView) -> None:
    number = await subscription(client)
    load(view, 1.0)
    await monitored(client, number, [item(await point(client, LOAD))])
    view.plant.set(LOAD, 1.0, time.monotonic(), Quality.DEAD)
    assert (await told(client, 2))[-1].StatusCode.value == Codes.BadNoCommunication
