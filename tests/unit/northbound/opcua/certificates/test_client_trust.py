"""Trust in clients: the code for the client, and the line for people."""

from __future__ import annotations

from datetime import datetime
from pathlib import Path

import pytest
from cryptography.hazmat.primitives.serialization import Encoding

from bridge.base.errors import FileFaults
from bridge.config import OpcUaTable
from bridge.northbound.opcua.certificates.client_trust import ClientTrust, client_store
from bridge.trust import TrustStore
from bridge.trust.files import thumbprint
from bridge.uaserver.library import StatusCodes
from tests.support.certificates import CLIENT, CLIENT_URI, DAY, NOW, cases, make

STRANGER = make()
SOURCE = "10.0.0.1"


@pytest.fixture
def store(tmp_path: Path) -> TrustStore:
    made = TrustStore(tmp_path)
    made.prepare()
    return made


def trust(store: TrustStore, *, needs_trust: bool = True, now: datetime = NOW) -> ClientTrust:
    return ClientTrust(store, needs_trust=needs_trust, now=lambda: now)


def test_a_stranger_is_told_nothing_and_people_how_to_let_it_in(store: TrustStore) -> None:
    refusal = trust(store).refusal(STRANGER.der, SOURCE)
    assert refusal is not None
    assert refusal.code == StatusCodes.BadSecurityChecksFailed
    print_ = thumbprint(STRANGER.certificate)
    assert refusal.why == (
        f"CN=client: BadCertificateUntrusted: it is not trusted. drivebridge certificates trust SITE {print_}"
    )
    store.trust(store.find_rejected(print_).certificate)
    assert trust(store).refusal(STRANGER.der, SOURCE, CLIENT_URI) is None


def test_who_is_trusted_is_told_what_is_wrong(store: TrustStore) -> None:
    store.trust(STRANGER.certificate)
    refusal = trust(store, now=NOW + 90 * DAY).refusal(STRANGER.der, SOURCE)
    assert refusal is not None
    assert refusal.code == StatusCodes.BadCertificateTimeInvalid
    other = trust(store).refusal(STRANGER.der, SOURCE, "urn:another")
    assert other is not None
    assert other.code == StatusCodes.BadCertificateUriInvalid


def test_its_issuers_may_come_along(store: TrustStore) -> None:
    case = cases()["of an authority below another"]
    store.trust(case.trusted[0].certificate)
    for number, crl in enumerate(case.crls):
        (store.issuers / f"{number}.crl").write_bytes(crl.public_bytes(Encoding.DER))
    sent = b"".join(one.der for one in case.sent)
    assert trust(store).refusal(sent, SOURCE) is None
    alone = trust(store).refusal(case.sent[0].der, SOURCE)
    assert alone is not None
    assert alone.why.startswith("CN=client: BadCertificateChainIncomplete: ")


@pytest.mark.parametrize("noise", [b"", b"\x30\x82\x01", b"nonsense", bytes(5000)])
def test_noise_is_refused_and_not_kept(store: TrustStore, noise: bytes) -> None:
    refusal = trust(store, needs_trust=False).refusal(noise, SOURCE)
    assert refusal is not None
    assert refusal.code == StatusCodes.BadSecurityChecksFailed
    assert store.rejected_ones() == []


def test_where_anybody_may_come_only_a_faulty_one_is_refused(store: TrustStore) -> None:
    anybody = trust(store, needs_trust=False)
    assert anybody.refusal(STRANGER.der, SOURCE, CLIENT_URI) is None
    assert anybody.refusal(make(CLIENT.but(ends=NOW - DAY / 2)).der, SOURCE) is not None


def test_a_further_folder_has_to_be_there(tmp_path: Path) -> None:
    settings = OpcUaTable.model_validate({"trusted_dir": str(tmp_path / "also")})
    with pytest.raises(FileFaults, match="trusted_dir is a folder"):
        client_store(settings, tmp_path)
    (tmp_path / "also").mkdir()
    (tmp_path / "also" / "client.der").write_bytes(STRANGER.der)
    assert client_store(settings, tmp_path).lists().trusts(STRANGER.certificate)
