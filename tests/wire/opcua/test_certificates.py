"""Certificates on the wire: each wrong kind is refused with its code, and what is renewed counts at once."""

from __future__ import annotations

import asyncio
from collections.abc import AsyncIterator, Mapping
from pathlib import Path

import pytest
import pytest_asyncio
from asyncua import Client, ua
from asyncua.crypto.uacrypto import CertProperties
from asyncua.ua.status_codes import get_name_and_doc
from cryptography import x509
from cryptography.hazmat.primitives.serialization import Encoding

from bridge.command import Role
from bridge.config import OpcUaTable, UserTable
from bridge.northbound.opcua.certificates.own_certificate import OwnCertificate
from bridge.northbound.opcua.certificates.own_files import own_folder, put_pair
from bridge.northbound.opcua.certificates.server_identity import renew
from bridge.trust import CertificateFault, TrustStore
from bridge.trust.files import thumbprint
from tests.support.certificates import CLIENT, CLIENT_URI, DAY, NOW, Case, Made, cases, make, rsa_key
from tests.support.opcua_peers import PASSWORD, Peer, Served, logged_in, make_peer
from tests.support.opcua_site import break_off, namespace, serving
from tests.support.passwords import cheap_hash
from tests.support.quiet import quiet_log

pytestmark = pytest.mark.asyncio(loop_scope="module")
Codes = ua.StatusCodes
_NOT_SPOKEN = {"no RSA key"}
"""What no client can open a channel of these policies with."""
_HIDDEN = "BadSecurityChecksFailed"


def told(fault: CertificateFault | None) -> str:
    """Code that a client is told (Part 4 §6.1.3): a stranger is not told what is wrong."""
    of_strangers = ("Invalid", "ChainIncomplete", "PolicyCheckFailed", "Untrusted")
    if fault is None:
        return "Good"
    return _HIDDEN if fault.removeprefix("BadCertificate") in of_strangers else str(fault)


def settings(**more: object) -> OpcUaTable:
    user = UserTable(name="anna", role="operator", password_hash=cheap_hash(PASSWORD))
    return OpcUaTable(listen="127.0.0.1:0", user=[user], **more)  # pyright: ignore


def lay_out(case: Case, state_dir: Path) -> None:
    """The folders as the case has them, and nothing else in them."""
    store = TrustStore(state_dir / "certificates")
    store.prepare()
    for folder in (store.trusted, store.issuers, store.rejected):
        for file in folder.iterdir():
            file.unlink()
    for folder, made in ((store.trusted, case.trusted), (store.issuers, case.issuers)):
        for number, one in enumerate(made):
            (folder / f"{number}.der").write_bytes(one.der)
    for number, crl in enumerate(case.crls):
        (store.trusted / f"{number}.crl").write_bytes(crl.public_bytes(Encoding.DER))


@pytest_asyncio.fixture(scope="module", loop_scope="module")
async def home(tmp_path_factory: pytest.TempPathFactory) -> Path:
    return tmp_path_factory.mktemp("state")


@pytest_asyncio.fixture(scope="module", loop_scope="module")
async def served(home: Path) -> AsyncIterator[Served]:
    async with serving(settings(), home) as found:
        yield found


async def outcome(served: Served, case: Case) -> str:
    """Status code with which asyncua's client is refused, or Good."""
    first, *issuers = case.sent
    peer = Peer(first.der, first.pem_key, CLIENT_URI)
    client = Client(served[0].endpoint_url, timeout=10)
    client.set_user("anna")
    client.set_password(PASSWORD)
    try:
        await peer.secure(client, certificate_chain=[CertProperties(one.der, "der") for one in issuers])
        async with client:
            return "Good"
    except ua.UaStatusCodeError as error:
        return get_name_and_doc(error.code)[0]


async def test_each_wrong_kind_is_refused_with_its_code(served: Served, home: Path) -> None:
    spoken = {name: case for name, case in cases().items() if name not in _NOT_SPOKEN}
    found: dict[str, str] = {}
    for name, case in spoken.items():
        lay_out(case, home)
        found[name] = await outcome(served, case)
    assert found == {name: told(case.fault) for name, case in spoken.items()}


class TestTrust:
    async def test_who_was_refused_is_kept_and_trusted_by_its_thumbprint(self, tmp_path: Path) -> None:
        case = cases()["unknown"]
        async with serving(settings(), tmp_path) as served:
            assert await outcome(served, case) == _HIDDEN
            store = TrustStore(tmp_path / "certificates")
            store.trust(store.find_rejected(thumbprint(case.sent[0].certificate)).certificate)
            assert await outcome(served, case) == "Good"

    async def test_where_anybody_may_come_the_user_decides(self, tmp_path: Path) -> None:
        async with serving(settings(trust="anybody"), tmp_path) as served:
            assert await outcome(served, cases()["unknown"]) == "Good"
            assert await outcome(served, cases()["run out"]) == "BadCertificateTimeInvalid"
            assert await outcome(served, cases()["short key"]) == _HIDDEN

    async def test_who_has_lost_its_trust_renews_no_channel(self, tmp_path: Path) -> None:
        peer = make_peer("scada")
        file = peer.trusted_in(tmp_path)
        async with serving(settings(), tmp_path) as served:
            client = await _connected(served, peer)
            await client.open_secure_channel(renew=True)
            await client.nodes.server_state.read_value()
            file.unlink()
            with pytest.raises(ua.UaStatusCodeError) as refused:
                await client.open_secure_channel(renew=True)
            assert refused.value.code == Codes.BadSecurityChecksFailed
            break_off(client)


class TestOwnCertificate:
    @pytest.mark.parametrize("new_key", [False, True])
    async def test_a_renewed_one_is_for_new_channels_and_no_session_ends(
        self, tmp_path: Path, new_key: bool
    ) -> None:
        peer, site = make_peer("scada"), settings()
        peer.trusted_in(tmp_path)
        async with serving(site, tmp_path) as served:
            before = await _shown(served)
            client = await _connected(served, peer)
            own = await asyncio.to_thread(renew, site, own_folder(tmp_path), new_key=new_key)
            await _until_shown(served, own.certificate.public_bytes(Encoding.DER))
            assert await _shown(served) != before
            await client.open_secure_channel(renew=True)
            await client.nodes.server_state.read_value()
            async with logged_in(served, peer, "anna", PASSWORD) as other:
                await other.nodes.server_state.read_value()
            await client.disconnect()

    async def test_another_applications_is_not_taken_up(self, tmp_path: Path) -> None:
        peer, site = make_peer("scada"), settings()
        peer.trusted_in(tmp_path)
        async with serving(site, tmp_path) as served:
            before = await _shown(served)
            foreign = make(CLIENT.but(uri="urn:somebody:else"))
            with quiet_log() as log:
                put_pair(own_folder(tmp_path), OwnCertificate(foreign.certificate, rsa_key(1)))
                for _ in range(50):
                    if any("urn:somebody:else" in line for line in log.lines):
                        break
                    await asyncio.sleep(0.1)
            assert any("it is that of urn:somebody:else" in line for line in log.lines), log.lines
            assert await _shown(served) == before


async def _shown(served: Served) -> bytes:
    endpoints = await Client(served[0].endpoint_url, timeout=10).connect_and_get_server_endpoints()
    (certificate,) = {endpoint.ServerCertificate for endpoint in endpoints}
    return certificate


async def _until_shown(served: Served, certificate: bytes) -> None:
    for _ in range(50):
        if await _shown(served) == certificate:
            return
        await asyncio.sleep(0.1)
    raise AssertionError("the certificate is not taken up")


async def _connected(served: Served, peer: Peer) -> Client:
    client = Client(served[0].endpoint_url, timeout=10)
    await peer.secure(client)
    client.set_user("anna")
    client.set_password(PASSWORD)
    await client.connect()
    return client


@pytest_asyncio.fixture(scope="module", loop_scope="module")
async def plant(
    tmp_path_factory: pytest.TempPathFactory,
) -> AsyncIterator[tuple[Served, Peer, Mapping[str, Made]]]:
    folder, peer = tmp_path_factory.mktemp("users"), make_peer("scada")
    peer.trusted_in(folder)
    person = CLIENT.but(uri="", usages=("digital_signature",), extended=None)
    people = {
        "eva": make(person.but(subject="eva", key=rsa_key(6))),
        "ian": make(person.but(subject="ian", key=rsa_key(7), ends=NOW - DAY / 2)),
    }
    users: list[UserTable] = []
    for name, made in people.items():
        (folder / f"{name}.der").write_bytes(made.der)
        users.append(UserTable(name=name, role="engineer", certificate=str(folder / f"{name}.der")))
    site = OpcUaTable(listen="127.0.0.1:0", user=users, no_security=True)
    async with serving(site, folder) as served:
        yield served, peer, people | {"otto": make(person.but(subject="otto"))}


class TestUsers:
    """Users with certificates instead of passwords."""

    async def enter(self, served: Served, peer: Peer | None, user: Made, key: bytes = b"") -> str:
        client = Client(served[0].endpoint_url, timeout=10)
        if peer:
            await peer.secure(client)
        await client.load_client_certificate(user.der, "der")
        await client.load_private_key(key or user.pem_key, extension="pem")
        try:
            async with client:
                point = client.get_node(
                    ua.NodeId("conveyor/fu1/command/control_word", await namespace(client))
                )
                await point.write_value(ua.DataValue(ua.Variant(0x047E, ua.VariantType.UInt16)))
                return str(served[1].requests[-1].identity)
        except ua.UaStatusCodeError as error:
            return get_name_and_doc(error.code)[0]

    async def test_who_has_the_key_is_the_user(self, plant: tuple[Served, Peer, Mapping[str, Made]]) -> None:
        served, peer, people = plant
        assert await self.enter(served, peer, people["eva"]) == "opcua:eva"
        assert served[1].requests[-1].identity.role is Role.ENGINEER

    async def test_it_needs_no_channel_with_security(
        self, plant: tuple[Served, Peer, Mapping[str, Made]]
    ) -> None:
        served, _, people = plant
        assert await self.enter(served, None, people["eva"]) == "opcua:eva"

    async def test_each_who_is_not_is_refused(self, plant: tuple[Served, Peer, Mapping[str, Made]]) -> None:
        served, peer, people = plant
        assert await self.enter(served, peer, people["otto"]) == "BadIdentityTokenRejected"
        assert await self.enter(served, peer, people["ian"]) == "BadIdentityTokenRejected"
        forged = people["otto"].pem_key
        assert await self.enter(served, peer, people["eva"], forged) == "BadUserSignatureInvalid"


@pytest_asyncio.fixture(scope="module", loop_scope="module")
async def elsewhere(tmp_path_factory: pytest.TempPathFactory) -> AsyncIterator[Served]:
    site = settings(endpoints=["opc.tcp://plant.example:14840"])
    async with serving(site, tmp_path_factory.mktemp("elsewhere")) as served:
        yield served


class TestAddress:
    @pytest.mark.parametrize(
        ("asked", "is_ours"),
        [
            ("opc.tcp://localhost:{port}/drivebridge", True),
            ("opc.tcp://LOCALHOST:14840", True),
            ("opc.tcp://plant.example:14840/", True),
            ("opc.tcp://plant.example:4840/", False),
            ("opc.tcp://elsewhere.example:4840/drivebridge", False),
            ("http://localhost/", False),
            ("opc.tcp://localhost:port", False),
            ("", False),
        ],
    )
    async def test_a_client_is_told_the_address_it_has_asked_by_where_it_leads_here(
        self, elsewhere: Served, asked: str, is_ours: bool
    ) -> None:
        server = elsewhere[0]
        asked = asked.format(port=server.port)
        expected = (
            f"{asked.partition('/')[0]}//{asked.split('/')[2]}/drivebridge"
            if is_ours
            else server.endpoint_url
        )
        client = Client(server.endpoint_url, timeout=10)
        await client.connect_sessionless()
        try:
            endpoints = await client.uaclient.get_endpoints(ua.GetEndpointsParameters(EndpointUrl=asked))
            servers = await client.uaclient.find_servers(ua.FindServersParameters(EndpointUrl=asked))
        finally:
            await client.disconnect_sessionless()
        assert {one.EndpointUrl for one in endpoints} == {expected}
        assert servers[0].DiscoveryUrls == [expected]

    async def test_its_hosts_are_in_the_certificate(self, elsewhere: Served) -> None:
        certificate = x509.load_der_x509_certificate(await _shown(elsewhere))
        names = certificate.extensions.get_extension_for_class(x509.SubjectAlternativeName).value
        assert "plant.example" in names.get_values_for_type(x509.DNSName)
