"""ServerConfiguration on the wire: who may, what the trust list becomes, a certificate that is renewed."""

from __future__ import annotations

from collections.abc import AsyncIterator
from pathlib import Path

import pytest
import pytest_asyncio
from asyncua import Client, ua
from cryptography import x509
from cryptography.hazmat.primitives.serialization import Encoding

from bridge.config import OpcUaTable, UserTable
from bridge.northbound.opcua.certificates.trust_list_files import TrustListContents, decoded, encoded
from bridge.trust import TrustStore
from bridge.trust.files import thumbprint
from tests.support.certificates import AUTHORITY, CLIENT, crl_of, make, signed
from tests.support.opcua_peers import PASSWORD, Peer, Served, logged_in, make_peer
from tests.support.opcua_site import serving
from tests.support.passwords import cheap_hash

pytestmark = pytest.mark.asyncio(loop_scope="module")
Codes, Type, Ids = ua.StatusCodes, ua.VariantType, ua.ObjectIds
GROUP = "ServerConfiguration_CertificateGroups_DefaultApplicationGroup"
LIST = f"{GROUP}_TrustList"
ROOT = make(AUTHORITY)
STRANGER = make(CLIENT.but(subject="stranger"))


@pytest_asyncio.fixture(scope="module", loop_scope="module")
async def home(tmp_path_factory: pytest.TempPathFactory) -> Path:
    return tmp_path_factory.mktemp("push")


@pytest.fixture(scope="module")
def scada() -> Peer:
    return make_peer("scada")


@pytest_asyncio.fixture(scope="module", loop_scope="module")
async def served(home: Path, scada: Peer) -> AsyncIterator[Served]:
    scada.trusted_in(home)
    async with serving(site(), home) as found:
        yield found


def site() -> OpcUaTable:
    line = cheap_hash(PASSWORD)
    users = [
        UserTable(name=role, role=role, password_hash=line)
        for role in ("observer", "operator", "engineer", "admin")
    ]
    return OpcUaTable(listen="127.0.0.1:0", no_security=True, user=users)  # pyright: ignore


async def call(client: Client, name: str, *arguments: ua.Variant) -> ua.CallMethodResult:
    owner = name.rpartition("_")[0]
    wanted = ua.CallMethodRequest(
        ObjectId=ua.NodeId(getattr(Ids, owner)),
        MethodId=ua.NodeId(getattr(Ids, name)),
        InputArguments=list(arguments),
    )
    (result,) = await client.uaclient.call([wanted])
    return result


async def good(client: Client, name: str, *arguments: ua.Variant) -> object:
    """The only output of a call that is carried out; None where it has none."""
    result = await call(client, name, *arguments)
    result.StatusCode.check()
    return result.OutputArguments[0].Value if result.OutputArguments else None


def bytes_(content: bytes | None) -> ua.Variant:
    return ua.Variant(content, Type.ByteString)


def handle_(number: object) -> ua.Variant:
    return ua.Variant(number, Type.UInt32)


class TestWhoMay:
    @pytest.mark.parametrize(
        ("user", "encrypted", "code"),
        [
            ("observer", True, Codes.BadUserAccessDenied),
            ("operator", True, Codes.BadUserAccessDenied),
            ("engineer", True, Codes.BadUserAccessDenied),
            ("admin", False, Codes.BadSecurityModeInsufficient),
            ("admin", True, Codes.Good),
        ],
    )
    async def test_an_admin_on_an_encrypted_channel(
        self, served: Served, scada: Peer, user: str, encrypted: bool, code: int
    ) -> None:
        async with logged_in(served, scada if encrypted else None, user, PASSWORD) as client:
            result = await call(client, "ServerConfiguration_GetRejectedList")
            assert result.StatusCode.value == code
            method = client.get_node(Ids.ServerConfiguration_GetRejectedList)
            told = await method.read_attribute(ua.AttributeIds.UserExecutable)
            assert told.Value.Value == (code == Codes.Good)

    async def test_it_says_who_and_how(self, served: Served, scada: Peer) -> None:
        async with logged_in(served, scada, "admin", PASSWORD) as client:
            node = client.get_node(Ids.ServerConfiguration_UpdateCertificate)
            table = (await node.read_attribute(ua.AttributeIds.RolePermissions)).Value.Value
            may = {one.RoleId.Identifier for one in table if ua.PermissionType.Call in one.Permissions}
            assert may == {Ids.WellKnownRole_ConfigureAdmin, Ids.WellKnownRole_SecurityAdmin}
            restricted = await node.read_attribute(ua.AttributeIds.AccessRestrictions)
            assert restricted.Value.Value == 3
            formats = client.get_node(Ids.ServerConfiguration_SupportedPrivateKeyFormats)
            assert await formats.read_value() == ["PEM"]

    async def test_arguments_that_do_not_fit_are_named(self, served: Served, scada: Peer) -> None:
        async with logged_in(served, scada, "admin", PASSWORD) as client:
            assert (await call(client, f"{LIST}_Open")).StatusCode.value == Codes.BadArgumentsMissing
            two = [ua.Variant(1, Type.Byte)] * 2
            assert (await call(client, f"{LIST}_Open", *two)).StatusCode.value == Codes.BadTooManyArguments
            wrong = await call(client, f"{LIST}_Open", ua.Variant("1", Type.String))
            assert wrong.StatusCode.value == Codes.BadInvalidArgument
            assert wrong.InputArgumentResults[0].value == Codes.BadTypeMismatch


class TestTrustList:
    async def test_one_that_was_refused_is_added_and_removed(
        self, served: Served, scada: Peer, home: Path
    ) -> None:
        stranger = Peer(STRANGER.der, STRANGER.pem_key, "urn:test:client")
        with pytest.raises(ua.UaStatusCodeError):
            async with logged_in(served, stranger, "operator", PASSWORD):
                pass
        async with logged_in(served, scada, "admin", PASSWORD) as client:
            assert await good(client, "ServerConfiguration_GetRejectedList") == [STRANGER.der]
            yes = ua.Variant(True, Type.Boolean)
            await good(client, f"{LIST}_AddCertificate", bytes_(STRANGER.der), yes)
            async with logged_in(served, stranger, "operator", PASSWORD) as other:
                await other.nodes.server_state.read_value()
            print_ = ua.Variant(thumbprint(STRANGER.certificate).upper(), Type.String)
            await good(client, f"{LIST}_RemoveCertificate", print_, yes)
            again = await call(client, f"{LIST}_RemoveCertificate", print_, yes)
            assert again.StatusCode.value == Codes.BadInvalidArgument
            noise = await call(client, f"{LIST}_AddCertificate", bytes_(b"noise"), yes)
            assert noise.StatusCode.value == Codes.BadCertificateInvalid
        assert not TrustStore(home / "certificates").lists().trusts(STRANGER.certificate)

    async def test_it_is_read_and_replaced_as_a_file(self, served: Served, scada: Peer, home: Path) -> None:
        own = x509.load_der_x509_certificate(scada.certificate)
        lists = TrustListContents((own,), (), (ROOT.certificate,), (crl_of(ROOT),))
        async with logged_in(served, scada, "admin", PASSWORD) as client:
            handle = handle_(await good(client, f"{LIST}_Open", ua.Variant(6, Type.Byte)))
            content = encoded(lists, 15)
            for at in range(0, len(content), 1000):
                await good(client, f"{LIST}_Write", handle, bytes_(content[at : at + 1000]))
            assert await good(client, f"{LIST}_CloseAndUpdate", handle) is False
            masks = handle_(ua.TrustListMasks.IssuerCertificates | ua.TrustListMasks.TrustedCertificates)
            handle = handle_(await good(client, f"{LIST}_OpenWithMasks", masks))
            read = await good(client, f"{LIST}_Read", handle, ua.Variant(1 << 20, Type.Int32))
            assert isinstance(read, bytes)
            found = decoded(read)
            assert (found.trusted, found.issuers) == ((own,), (ROOT.certificate,))
            assert (found.trusted_crls, found.issuer_crls) == (None, None)
            await good(client, f"{LIST}_Close", handle)
            # What is no list replaces nothing.
            handle = handle_(await good(client, f"{LIST}_Open", ua.Variant(6, Type.Byte)))
            await good(client, f"{LIST}_Write", handle, bytes_(b"noise"))
            result = await call(client, f"{LIST}_CloseAndUpdate", handle)
            assert result.StatusCode.value == Codes.BadCertificateInvalid
        kept = TrustStore(home / "certificates").lists()
        assert kept.trusts(own)
        assert (kept.issuers, len(kept.crls)) == ((ROOT.certificate,), 1)

    async def test_whoever_breaks_off_is_in_nobodys_way(self, served: Served, scada: Peer) -> None:
        async with logged_in(served, scada, "admin", PASSWORD) as client:
            await good(client, f"{LIST}_Open", ua.Variant(6, Type.Byte))
        async with logged_in(served, scada, "admin", PASSWORD) as client:
            handle = handle_(await good(client, f"{LIST}_Open", ua.Variant(1, Type.Byte)))
            await good(client, f"{LIST}_Close", handle)


class TestRenewal:
    async def test_a_certificate_of_an_authority_is_used_and_no_session_ends(
        self, served: Served, scada: Peer
    ) -> None:
        nothing = ua.Variant(ua.NodeId(), Type.NodeId)
        async with (
            logged_in(served, scada, "operator", PASSWORD) as bystander,
            logged_in(served, scada, "admin", PASSWORD) as client,
        ):
            before = await shown(served)
            early = await call(client, "ServerConfiguration_ApplyChanges")
            assert early.StatusCode.value == Codes.BadNothingToDo
            request = await good(
                client,
                "ServerConfiguration_CreateSigningRequest",
                nothing,
                nothing,
                ua.Variant(None, Type.String),
                ua.Variant(True, Type.Boolean),
                bytes_(bytes(32)),
            )
            assert isinstance(request, bytes)
            made = signed(request, ROOT)
            update = (
                nothing,
                nothing,
                bytes_(made.public_bytes(Encoding.DER)),
                ua.Variant([ROOT.der], Type.ByteString),
                ua.Variant(None, Type.String),
                bytes_(None),
            )
            assert await good(client, "ServerConfiguration_UpdateCertificate", *update) is True
            assert await shown(served) == before, "not yet"
            await good(client, "ServerConfiguration_ApplyChanges")
            assert await shown(served) == made.public_bytes(Encoding.DER)
            for one in (bystander, client):
                await one.open_secure_channel(renew=True)
                await one.nodes.server_state.read_value()
            async with logged_in(served, scada, "operator", PASSWORD) as newcomer:
                await newcomer.nodes.server_state.read_value()


async def shown(served: Served) -> bytes:
    endpoints = await Client(served[0].endpoint_url, timeout=10).connect_and_get_server_endpoints()
    return endpoints[0].ServerCertificate
