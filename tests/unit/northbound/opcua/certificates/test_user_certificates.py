"""Users with certificates of their own."""

from __future__ import annotations

from pathlib import Path

import pytest

from bridge.base.errors import FileFaults
from bridge.config import OpcUaTable, UserTable
from bridge.northbound.opcua.accounts import Accounts
from bridge.northbound.opcua.certificates.user_certificates import judge_user, user_certificates
from bridge.trust import CertificateFault, TrustLists
from bridge.uaserver.library import ua
from tests.support.certificates import AUTHORITY, CLIENT, DAY, NOW, Made, crl_of, make

PERSON = CLIENT.but(uri="", usages=("digital_signature",), extended=None)
ROOT = make(AUTHORITY)
EVA, IAN = make(PERSON.but(subject="eva")), make(PERSON.but(subject="ian"), ROOT)


def settings(folder: Path, **people: Made | str) -> OpcUaTable:
    users: list[UserTable] = []
    for name, made in people.items():
        file = folder / f"{name}.der"
        if isinstance(made, Made):
            file.write_bytes(made.der)
        elif made:
            file.write_text(made)
        users.append(UserTable(name=name, role="operator", certificate=str(file)))
    return OpcUaTable(user=users)  # pyright: ignore


def test_users_are_known_by_their_certificates(tmp_path: Path) -> None:
    site = settings(tmp_path, eva=EVA, ian=IAN)
    found = user_certificates(site)
    assert {content: user.name for content, user in found.items()} == {EVA.der: "eva", IAN.der: "ian"}
    assert Accounts(site).tokens == [ua.X509IdentityToken]


def test_all_files_that_cannot_be_used_are_named(tmp_path: Path) -> None:
    site = settings(tmp_path, eva=EVA, twin=EVA, none="nonsense", gone="")
    with pytest.raises(FileFaults) as raised:
        user_certificates(site)
    said = {Path(fault.file).name: fault.message for fault in raised.value.faults}
    assert said.keys() == {"twin.der", "none.der", "gone.der"}
    assert said["twin.der"] == "is the certificate of the user 'eva', too"


@pytest.mark.parametrize("more", [{}, {"password_hash": "$argon2id$…", "certificate": "eva.der"}])
def test_each_user_has_one_credential(more: dict[str, str]) -> None:
    user = UserTable.model_validate({"name": "eva", "role": "admin", **more})
    with pytest.raises(FileFaults) as raised:
        Accounts(OpcUaTable.model_validate({"user": [user]}))
    (fault,) = raised.value.faults
    assert fault.key == "opcua.user[0]"
    assert "either a password_hash or a certificate" in fault.message


def test_a_users_certificate_has_its_days_and_its_issuer_may_revoke_it() -> None:
    assert judge_user(EVA.certificate, TrustLists(), NOW).fault is None
    assert judge_user(EVA.certificate, TrustLists(), NOW + 90 * DAY).fault is CertificateFault.TIME
    assert judge_user(IAN.certificate, TrustLists(), NOW).fault is CertificateFault.CHAIN_INCOMPLETE
    for crl, fault in ((crl_of(ROOT), None), (crl_of(ROOT, IAN), CertificateFault.REVOKED)):
        assert judge_user(IAN.certificate, TrustLists((), [ROOT.certificate], [crl]), NOW).fault == fault
