"""Judgement of certificates: each kind of fault has its own code, and what is sound is trusted."""

from __future__ import annotations

import pytest
from cryptography import x509

from bridge.trust import CertificateFault, Purpose, TrustLists, judge
from bridge.trust.judge import uris_in
from tests.support.certificates import (
    AUTHORITY,
    CLIENT,
    CLIENT_URI,
    DAY,
    NOW,
    Case,
    cases,
    crl_of,
    make,
)

APPLICATION = Purpose(CLIENT_URI)
NOT_JUDGED_BY_A_SERVER = {CertificateFault.HOST_NAME}


def test_each_kind_has_its_code() -> None:
    found = {name: judge(case.chain, case.lists, NOW, APPLICATION).fault for name, case in cases().items()}
    assert found == {name: case.fault for name, case in cases().items()}


def test_there_is_a_case_of_every_code() -> None:
    found = {case.fault for case in cases().values()}
    assert found == {None, *CertificateFault} - NOT_JUDGED_BY_A_SERVER


def test_the_line_says_what_is_wrong() -> None:
    case = cases()["run out"]
    said = str(judge(case.chain, case.lists, NOW))
    assert said.startswith("BadCertificateTimeInvalid: CN=client was valid until ")


def test_nothing_is_no_certificate() -> None:
    for purpose in (Purpose(), Purpose(needs_trust=False)):
        assert judge([], TrustLists(), NOW, purpose).fault is CertificateFault.INVALID


@pytest.mark.parametrize(
    ("host", "fault"),
    [("localhost", None), ("LOCALHOST", None), ("127.0.0.1", "host"), ("plant.example", "host")],
)
def test_the_host_has_to_be_in_it_where_one_is_asked_for(host: str, fault: str | None) -> None:
    case = cases()["trusted itself"]
    found = judge(case.chain, case.lists, NOW, Purpose(host=host)).fault
    assert found == (CertificateFault.HOST_NAME if fault else None)


def test_up_to_the_trust_list_a_stranger_is_not_told_what_is_wrong() -> None:
    def hidden(case: Case) -> bool:
        return judge(case.chain, case.lists, NOW, APPLICATION).is_strangers

    told = {case.fault for case in cases().values() if case.fault and not hidden(case)}
    assert {case.fault for case in cases().values() if hidden(case)} == {
        CertificateFault.INVALID,
        CertificateFault.CHAIN_INCOMPLETE,
        CertificateFault.POLICY,
        CertificateFault.UNTRUSTED,
    }
    assert CertificateFault.REVOKED in told


def test_where_anybody_may_come_a_certificate_has_to_be_sound_all_the_same() -> None:
    anybody = Purpose(CLIENT_URI, needs_trust=False)
    counts = {
        name: judge(case.chain, case.lists, NOW, anybody).fault is None for name, case in cases().items()
    }
    assert counts["unknown"]
    assert counts["without its authority"]
    for name in ("short key", "SHA-224", "run out", "another application", "a server's"):
        assert not counts[name], name


def test_a_user_needs_no_key_for_encryption_and_no_application() -> None:
    user = make(CLIENT.but(uri="", usages=("digital_signature",), extended=None))
    lists = TrustLists([user.certificate])
    assert judge([user.certificate], lists, NOW, Purpose(is_user=True)).fault is None
    assert judge([user.certificate], lists, NOW).fault is CertificateFault.USE


def test_of_several_lists_the_latest_counts() -> None:
    root = make(AUTHORITY)
    leaf = make(CLIENT, root)
    builder = x509.CertificateRevocationListBuilder(root.certificate.subject)
    builder = builder.last_update(NOW - 9 * DAY).next_update(NOW - 8 * DAY)
    former = builder.sign(root.key, leaf.certificate.signature_hash_algorithm)  # pyright: ignore
    for crls in ((former, crl_of(root)), (crl_of(root), former)):
        found = judge([leaf.certificate], TrustLists([root.certificate], (), crls), NOW, APPLICATION)
        assert found.fault is None


def test_issuers_that_go_in_circles_end() -> None:
    """Two that have issued each other have no root."""
    one, other = AUTHORITY.but(subject="one"), AUTHORITY.but(subject="other")
    first = make(one, make(other))
    second = make(other, first)
    leaf = make(CLIENT, first)
    sent = [leaf.certificate, first.certificate, second.certificate]
    found = judge(sent, TrustLists([leaf.certificate]), NOW)
    assert found.fault is CertificateFault.CHAIN_INCOMPLETE


def test_what_an_attacker_names_itself_is_one_short_line() -> None:
    made = make(CLIENT.but(subject="\x1b[2J" + "x" * 50))
    line = str(
        judge([make(CLIENT.but(subject="\x1b[2Jx", ends=NOW - DAY / 2)).certificate], TrustLists(), NOW)
    )
    assert "\x1b" not in line
    assert uris_in(made.certificate) == [CLIENT_URI]
