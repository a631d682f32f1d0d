"""Who gets in to the OPC UA server, as whom, and what they cannot do there."""

from __future__ import annotations

import asyncio
import socket
from collections.abc import AsyncIterator
from contextlib import suppress
from pathlib import Path

import pytest
import pytest_asyncio
from asyncua import Client, ua
from asyncua.server.address_space import AddressSpace, AttributeValue, NodeData

from bridge.config import OpcUaTable, UserTable
from tests.support.opcua_peers import (
    PASSWORD,
    POLICIES,
    Peer,
    Served,
    channel_of,
    logged_in,
    make_peer,
    make_users,
    signed_in,
)
from tests.support.opcua_site import break_off, connected, namespace, serving
from tests.support.quiet import quiet_log

pytestmark = pytest.mark.asyncio(loop_scope="module")
Codes, Refused = ua.StatusCodes, ua.uaerrors.BadUserAccessDenied


@pytest.fixture(scope="module")
def scada() -> Peer:
    return make_peer("scada")


@pytest.fixture(scope="module")
def stranger() -> Peer:
    return make_peer("stranger")


@pytest.fixture(scope="module")
def users() -> list[UserTable]:
    return make_users()


@pytest_asyncio.fixture(scope="module", loop_scope="module")
async def strict(
    users: list[UserTable], scada: Peer, stranger: Peer, tmp_path_factory: pytest.TempPathFactory
) -> AsyncIterator[Served]:
    """As a site file that says nothing else: no open endpoint, nobody without a name."""
    settings, folder = OpcUaTable(listen="127.0.0.1:0", user=users), tmp_path_factory.mktemp("strict")
    for peer in (scada, stranger):
        peer.trusted_in(folder)
    async with serving(settings, folder) as found:
        yield found


@pytest_asyncio.fixture(scope="module", loop_scope="module")
async def open_(users: list[UserTable], tmp_path_factory: pytest.TempPathFactory) -> AsyncIterator[Served]:
    """With an open endpoint on which everyone may look."""
    settings = OpcUaTable(listen="127.0.0.1:0", no_security=True, anonymous="observer", user=users)
    async with serving(settings, tmp_path_factory.mktemp("open")) as found:
        yield found


async def control_word(client: Client) -> int:
    """Write a command point; the status code."""
    point = client.get_node(ua.NodeId("conveyor/fu1/command/control_word", await namespace(client)))
    value = ua.DataValue(ua.Variant(0x047E, ua.VariantType.UInt16))
    wanted = ua.WriteValue(NodeId=point.nodeid, AttributeId=ua.AttributeIds.Value, Value=value)
    (result,) = await client.uaclient.write(ua.WriteParameters(NodesToWrite=[wanted]))
    return result.value


def counted(served: Served, what: str) -> int:
    """Connections that were refused or broken, as the point says."""
    value = served[1].plant.image.read(f"bridge/opcua_{what}_connections").value
    assert isinstance(value, int)
    return value


class TestEncrypted:
    @pytest.mark.parametrize("policy", POLICIES)
    async def test_an_operator_with_a_password_commands(
        self, strict: Served, scada: Peer, policy: type
    ) -> None:
        async with logged_in(strict, scada, "anna", PASSWORD, policy) as client:
            assert await control_word(client) == Codes.Good
            assert str(strict[1].requests[-1].identity) == "opcua:anna"
            assert strict[1].requests[-1].identity.address == "127.0.0.1"

    @pytest.mark.landing(5)
    @pytest.mark.parametrize(
        ("user", "password"),
        [("anna", "wrong"), ("anna", ""), ("nobody", PASSWORD), ("admin", PASSWORD), ("Admin", "")],
    )
    async def test_a_wrong_password_or_name_does_not_get_in(
        self, strict: Served, scada: Peer, user: str, password: str
    ) -> None:
        before = counted(strict, "refused")
        with pytest.raises(Refused):
            async with logged_in(strict, scada, user, password):
                pass
        assert counted(strict, "refused") == before + 1

    async def test_nobody_gets_in_without_a_name(self, strict: Served, scada: Peer) -> None:
        client = Client(strict[0].endpoint_url, timeout=10)
        await scada.secure(client)
        await client.connect_socket()
        try:
            await client.send_hello()
            await client.open_secure_channel()
            await client.create_session()
            # The client would not even try: no such token is offered.
            token = ua.ActivateSessionParameters()
            token.UserIdentityToken = ua.AnonymousIdentityToken()
            token.UserIdentityToken.PolicyId = "anonymous"
            challenge = client.security_policy.peer_certificate + client._server_nonce  # pyright: ignore[reportPrivateUsage]
            token.ClientSignature.Algorithm = POLICIES[0].AsymmetricSignatureURI
            token.ClientSignature.Signature = client.security_policy.asymmetric_cryptography.signature(
                challenge
            )
            with pytest.raises(ua.uaerrors.BadIdentityTokenRejected):
                await client.uaclient.activate_session(token)
        finally:
            break_off(client)

    async def test_no_session_is_opened_without_security_that_is_not_offered(self, strict: Served) -> None:
        """asyncua lets it, whatever its endpoints say."""
        client = Client(strict[0].endpoint_url, timeout=10)
        endpoints = await client.connect_and_get_server_endpoints()
        assert {endpoint.SecurityMode for endpoint in endpoints} == {ua.MessageSecurityMode.SignAndEncrypt}
        await client.connect_socket()
        try:
            await client.send_hello()
            await client.open_secure_channel()
            with pytest.raises(ua.uaerrors.BadSecurityPolicyRejected):
                await client.create_session()
        finally:
            break_off(client)

    async def test_the_certificate_of_the_session_is_that_of_the_channel(
        self, strict: Served, scada: Peer, stranger: Peer
    ) -> None:
        client = Client(strict[0].endpoint_url, timeout=10)
        await stranger.secure(client)
        await client.connect_socket()
        try:
            await client.send_hello()
            await client.open_secure_channel()
            claimed = ua.CreateSessionParameters()
            claimed.ClientDescription.ApplicationUri = stranger.uri
            claimed.ClientNonce, claimed.ClientCertificate = bytes(32), scada.certificate
            with pytest.raises(ua.uaerrors.BadSecurityChecksFailed):
                await client.uaclient.create_session(claimed)
        finally:
            break_off(client)


class TestTrust:
    async def test_only_trusted_certificates_open_a_channel(
        self, users: list[UserTable], scada: Peer, stranger: Peer, tmp_path: Path
    ) -> None:
        trusted = tmp_path / "trusted"
        trusted.mkdir()
        (trusted / "scada.der").write_bytes(scada.certificate)
        settings = OpcUaTable(listen="127.0.0.1:0", user=users, trusted_dir=str(trusted))
        async with serving(settings, tmp_path) as served:
            async with logged_in(served, scada, "anna", PASSWORD) as client:
                assert await control_word(client) == Codes.Good
            assert counted(served, "refused") == 0
            with pytest.raises((ua.UaError, ConnectionError)):
                async with logged_in(served, stranger, "anna", PASSWORD):
                    pass
            assert counted(served, "refused") == 1
            # A copied file is enough, without a restart.
            (trusted / "stranger.der").write_bytes(stranger.certificate)
            async with logged_in(served, stranger, "anna", PASSWORD) as client:
                assert await control_word(client) == Codes.Good

    @pytest.mark.landing
    async def test_certificates_that_an_address_makes_up_are_one_line(
        self, users: list[UserTable], tmp_path: Path
    ) -> None:
        """Their names are the client's own: a new one each time must not be a new line each time."""
        async with serving(OpcUaTable(listen="127.0.0.1:0", user=users), tmp_path) as served:
            with quiet_log() as log:
                for number in range(3):
                    with pytest.raises((ua.UaError, ConnectionError)):
                        async with logged_in(served, make_peer(f"made-up-{number}"), "anna", PASSWORD):
                            pass
        told = [line for line in log.lines if "refused certificates" in line]
        assert len(told) == 1, told
        assert "refused certificates from 127.0.0.1: " in told[0]
        assert "made-up-0" in told[0]
        assert "BadCertificateUntrusted: it is not trusted. drivebridge certificates trust SITE " in told[0]

    @pytest.mark.landing
    async def test_the_server_s_identity_stays_over_a_restart_under_another_host_name(
        self, users: list[UserTable], scada: Peer, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
    ) -> None:
        """A container has another name each time: no client has to trust it anew."""
        scada.trusted_in(tmp_path)
        settings = OpcUaTable(listen="127.0.0.1:0", user=users)
        seen: list[tuple[bytes, str, str]] = []
        for name in ("hall-3", "9f31c2aa0b17"):
            monkeypatch.setattr(socket, "gethostname", lambda name=name: name)
            async with (
                serving(settings, tmp_path) as served,
                logged_in(served, scada, "anna", PASSWORD) as client,
            ):
                (endpoint, *_) = await client.get_endpoints()
                uri = (await client.get_namespace_array())[1]
                seen.append((endpoint.ServerCertificate, endpoint.Server.ApplicationUri, uri))
        assert seen[0] == seen[1]
        assert seen[0][1:] == ("urn:hall-3:drivebridge",) * 2


class TestRoles:
    async def test_an_observer_reads_and_commands_nothing(self, open_: Served) -> None:
        async with connected(open_[0]) as client:
            space = await namespace(client)
            point = client.get_node(ua.NodeId("conveyor/fu1/command/control_word", space))
            await point.read_value()
            assert await control_word(client) == Codes.BadUserAccessDenied
            drive = client.get_node(ua.NodeId("conveyor/fu1", space))
            for method in ("Stop", "QuickStop", "DisableVoltage", "KeepAlive", "ResetFault"):
                with pytest.raises(Refused):
                    await drive.call_method(f"{space}:{method}")
            with pytest.raises(Refused):
                await client.get_node(ua.NodeId("conveyor", space)).call_method(f"{space}:Reset")
            with pytest.raises(Refused):
                await client.get_node(ua.NodeId("bus/can0", space)).call_method(f"{space}:StopNode")

    async def test_an_observer_with_a_name_commands_nothing_either(self, strict: Served, scada: Peer) -> None:
        async with logged_in(strict, scada, "otto", PASSWORD) as client:
            assert await control_word(client) == Codes.BadUserAccessDenied

    async def test_the_attributes_tell_each_user_what_it_may(self, open_: Served) -> None:
        async def told(client: Client) -> tuple[int, bool]:
            space = await namespace(client)
            point = client.get_node(ua.NodeId("conveyor/fu1/command/control_word", space))
            method = client.get_node(ua.NodeId("conveyor/fu1/Start", space))
            access = await point.read_attribute(ua.AttributeIds.UserAccessLevel)
            executable = await method.read_attribute(ua.AttributeIds.UserExecutable)
            return access.Value.Value, executable.Value.Value

        async with connected(open_[0]) as client:
            assert await told(client) == (1, False)
        # On the open endpoint a password crosses encrypted.
        async with logged_in(open_, None, "anna", PASSWORD) as client:
            assert await told(client) == (3, True)
            assert await control_word(client) == Codes.Good

    async def test_a_client_reads_which_role_may_what(self, open_: Served) -> None:
        async def told(client: Client, attribute: int) -> dict[str, bool]:
            """Roles in the attribute of a command point, and whether they may write."""
            point = ua.NodeId("conveyor/fu1/command/control_word", await namespace(client))
            value = (await client.get_node(point).read_attribute(attribute)).Value.Value
            names = {ident: name.removeprefix("WellKnownRole_") for name, ident in vars(ua.ObjectIds).items()}
            writes = ua.PermissionType.Write
            return {names[one.RoleId.Identifier]: writes in one.Permissions for one in value}

        may = {"Observer": False, "Operator": True, "Engineer": True, "ConfigureAdmin": True}
        async with connected(open_[0]) as client:
            roles = await client.get_node(ua.ObjectIds.Server_ServerCapabilities_RoleSet).get_children()
            names = {(await one.read_browse_name()).Name for one in roles}
            assert {"Anonymous", "AuthenticatedUser", "SecurityAdmin", *may} <= names
            found = await told(client, ua.AttributeIds.RolePermissions)
            assert found == may | {"SecurityAdmin": True}
            assert await told(client, ua.AttributeIds.UserRolePermissions) == {"Observer": False}
        async with logged_in(open_, None, "anna", PASSWORD) as client:
            assert await told(client, ua.AttributeIds.UserRolePermissions) == {"Operator": True}

    async def test_a_password_in_clear_text_is_not_taken(self, open_: Served) -> None:
        client = Client(open_[0].endpoint_url, timeout=10)
        await client.connect_socket()
        try:
            await client.send_hello()
            await client.open_secure_channel()
            await client.create_session()
            token = ua.ActivateSessionParameters()
            token.UserIdentityToken = ua.UserNameIdentityToken()
            token.UserIdentityToken.UserName = "anna"
            token.UserIdentityToken.Password = PASSWORD.encode()
            with pytest.raises(ua.uaerrors.BadIdentityTokenRejected):
                await client.uaclient.activate_session(token)
        finally:
            break_off(client)

    async def test_nobody_changes_the_address_space(self, open_: Served) -> None:
        async with logged_in(open_, None, "anna", PASSWORD) as client:
            space = await namespace(client)
            with pytest.raises(ua.uaerrors.BadServiceUnsupported):
                await client.nodes.objects.add_variable(ua.NodeId("mine", space), "mine", 1)
            with pytest.raises(ua.uaerrors.BadServiceUnsupported):
                await client.delete_nodes([client.get_node(ua.NodeId("conveyor/fu1", space))])
            with pytest.raises(ua.uaerrors.BadServiceUnsupported):
                await client.uaclient.register_server(ua.RegisteredServer())

    async def test_what_is_not_executable_does_not_run_and_what_is_not_readable_is_not_read(
        self, open_: Served
    ) -> None:
        async with logged_in(open_, None, "anna", PASSWORD) as client:
            space = await namespace(client)
            nodes = open_[0]._server.iserver.aspace  # pyright: ignore
            stop = _own(nodes, ua.NodeId("conveyor/fu2/Stop", space))
            stop[ua.AttributeIds.Executable] = _constant(False, ua.VariantType.Boolean)
            with pytest.raises(ua.uaerrors.BadNotExecutable):
                await client.get_node(ua.NodeId("conveyor/fu2", space)).call_method(f"{space}:Stop")
            load = _own(nodes, ua.NodeId("bus/can0/load", space))
            load[ua.AttributeIds.AccessLevel] = _constant(0, ua.VariantType.Byte)
            with pytest.raises(ua.uaerrors.BadNotReadable):
                await client.get_node(ua.NodeId("bus/can0/load", space)).read_value()


def _own(nodes: AddressSpace, where: ua.NodeId) -> dict[ua.AttributeIds, AttributeValue]:
    """The attributes of a node that is no other's like from now on."""
    made = NodeData(where)
    made.attributes, made.references = dict(nodes[where].attributes), nodes[where].references
    nodes[where] = made
    return made.attributes


def _constant(value: object, kind: ua.VariantType) -> AttributeValue:
    return AttributeValue(ua.DataValue(ua.Variant(value, kind)))


class TestSessions:
    async def test_a_token_cannot_be_guessed(self, open_: Served) -> None:
        async with connected(open_[0]) as first, connected(open_[0]) as second:
            tokens = [client.uaclient.protocol.authentication_token for client in (first, second)]
            assert tokens[0] != tokens[1]
            assert all(
                token.NodeIdType is ua.NodeIdType.ByteString and len(token.Identifier) == 32
                for token in tokens
            )

    async def test_a_session_is_not_taken_over_from_a_channel_with_another_certificate(
        self, strict: Served, scada: Peer, stranger: Peer
    ) -> None:
        async with logged_in(strict, scada, "anna", PASSWORD) as owner:
            token = owner.uaclient.protocol.authentication_token
            thief = Client(strict[0].endpoint_url, timeout=10)
            await stranger.secure(thief)
            await thief.connect_socket()
            try:
                await thief.send_hello()
                await thief.open_secure_channel()
                thief.uaclient.protocol.authentication_token = token
                with pytest.raises(ua.uaerrors.BadSecurityChecksFailed):
                    await thief.uaclient.activate_session(ua.ActivateSessionParameters())
            finally:
                break_off(thief)
            assert await control_word(owner) == Codes.Good

    async def test_another_user_with_the_same_certificate_does_not_take_the_session(
        self, strict: Served, scada: Peer
    ) -> None:
        """Part 4 §5.6.3: from another channel the user's token must be the same."""
        async with logged_in(strict, scada, "anna", PASSWORD) as owner:
            other = await channel_of(strict, scada, owner)
            try:
                with pytest.raises(ua.uaerrors.BadIdentityChangeNotSupported):
                    await other.uaclient.activate_session(signed_in(other, "otto"))
                assert await control_word(owner) == Codes.Good
                await other.uaclient.activate_session(signed_in(other, "anna"))
                assert await control_word(other) == Codes.Good
            finally:
                break_off(other)

    async def test_a_request_with_another_sessions_token_is_refused(self, open_: Served) -> None:
        async with connected(open_[0]) as first, connected(open_[0]) as second:
            own = second.uaclient.protocol.authentication_token
            second.uaclient.protocol.authentication_token = first.uaclient.protocol.authentication_token
            with pytest.raises(ua.uaerrors.BadSessionIdInvalid):
                await second.nodes.server_state.read_value()
            second.uaclient.protocol.authentication_token = own

    @pytest.mark.parametrize(
        "content",
        [
            b"GET / HTTP/1.1\r\n\r\n",
            b"HELF\x20\x00\x00\x00" + bytes(24),
            b"OPNF\x30\x00\x00\x00" + b"\xff" * 40,
            b"MSGF\x18\x00\x00\x00" + b"\xff" * 16,
        ],
    )
    async def test_bytes_that_are_not_opc_ua_hurt_nobody(self, open_: Served, content: bytes) -> None:
        reader, writer = await asyncio.open_connection("127.0.0.1", open_[0].port)
        writer.write(content)
        async with asyncio.timeout(3):
            if content.startswith((b"OPN", b"MSG", b"HEL")):
                await reader.read(1000)
        writer.close()
        async with connected(open_[0]) as client:
            await client.nodes.server_state.read_value()

    async def test_a_chunk_without_end_is_cut_off(self, open_: Served) -> None:
        before = counted(open_, "broken")
        reader, writer = await asyncio.open_connection("127.0.0.1", open_[0].port)
        writer.write(b"MSGF\xff\xff\xff\xff" + bytes(200_000))
        async with asyncio.timeout(3):
            with suppress(ConnectionError):
                assert await reader.read(1000) == b""
        assert counted(open_, "broken") == before + 1
        writer.close()
