"""Chain of a certificate up to its root, out of what the peer sent and what is in the lists. Sans-IO."""

from __future__ import annotations

from collections import defaultdict
from collections.abc import Iterator, Mapping, Sequence
from typing import Final

from cryptography import x509
from cryptography.exceptions import InvalidSignature, UnsupportedAlgorithm
from cryptography.hazmat.primitives.serialization import Encoding

from bridge.text import Text
from bridge.trust.verdict import CertificateFault, Faulty

MOST_IN_CHAIN: Final = 5
"""Certificates from one up to its root, both included; also of those that a peer sends along."""
_MOST_NAMESAKES: Final = 8
"""Issuers of one name that are tried: each costs a verification."""
_LONGEST_NAME: Final = 64

_BROKEN: Final = (ValueError, TypeError, OverflowError, x509.InvalidVersion)
"""Errors of cryptography for a certificate of which a part cannot be read."""


def named(certificate: x509.Certificate) -> str:
    """Subject for a line of text: a stranger may have chosen it."""
    return short(certificate.subject.rfc4514_string())


def short(words: str) -> str:
    """The words as far as a line has room for them, without what a terminal would obey."""
    return "".join(char if char.isprintable() else "?" for char in words[:_LONGEST_NAME])


class TrustLists:
    """Certificates that are trusted, those of issuers that only complete chains, and revocation lists."""

    def __init__(
        self,
        trusted: Sequence[x509.Certificate] = (),
        issuers: Sequence[x509.Certificate] = (),
        crls: Sequence[x509.CertificateRevocationList] = (),
    ) -> None:
        self.trusted = tuple(trusted)
        self.issuers = tuple(issuers)
        self.crls = tuple(crls)
        self._trusted = frozenset(map(_der, trusted))
        self._by_subject = _by_subject((*trusted, *issuers))

    def trusts(self, certificate: x509.Certificate) -> bool:
        """True where exactly this one is in the list."""
        return _der(certificate) in self._trusted

    def issuers_of(self, certificate: x509.Certificate) -> Sequence[x509.Certificate]:
        """Certificates in the lists whose subject is the issuer of this one."""
        return self._by_subject.get(certificate.issuer.public_bytes(), ())

    def crls_of(self, issuer: x509.Certificate) -> Iterator[x509.CertificateRevocationList]:
        """Revocation lists that ``issuer`` has signed, the latest first."""
        found = [crl for crl in self.crls if crl.issuer == issuer.subject]
        for crl in sorted(found, key=lambda one: one.last_update_utc, reverse=True)[:_MOST_NAMESAKES]:
            try:
                is_signed = crl.is_signature_valid(issuer.public_key())  # pyright: ignore[reportArgumentType]
            except (*_BROKEN, UnsupportedAlgorithm):
                continue
            if is_signed:
                yield crl


def chain_of(sent: Sequence[x509.Certificate], lists: TrustLists) -> list[x509.Certificate]:
    """The first of ``sent`` and its issuers up to a root, each with a signature of the next.

    Raises ``Faulty`` for a signature that does not fit and for an issuer that is not there.
    """
    if not sent:
        raise Faulty(CertificateFault.INVALID, Text.of("trust.unreadable"))
    sent_along = _by_subject(sent[1:MOST_IN_CHAIN])
    chain = [sent[0]]
    while not _is_root(chain[-1]):
        last = chain[-1]
        candidates = [*lists.issuers_of(last), *sent_along.get(last.issuer.public_bytes(), ())]
        candidates = [one for one in candidates if one not in chain][:_MOST_NAMESAKES]
        issuer = short(last.issuer.rfc4514_string())
        if not candidates:
            raise Faulty(CertificateFault.CHAIN_INCOMPLETE, Text.of("trust.chain_incomplete", issuer=issuer))
        found = next((one for one in candidates if _signed(last, one)), None)
        if found is None:
            raise _forged(last)
        chain.append(found)
        if len(chain) > MOST_IN_CHAIN:
            said = Text.of("trust.chain_long", most=MOST_IN_CHAIN)
            raise Faulty(CertificateFault.CHAIN_INCOMPLETE, said)
    return chain


def _is_root(certificate: x509.Certificate) -> bool:
    """True for one that is signed by itself. Raises ``Faulty`` for one that only says so."""
    if certificate.issuer != certificate.subject:
        return False
    if not _signed(certificate, certificate):
        raise _forged(certificate)
    return True


def _signed(certificate: x509.Certificate, issuer: x509.Certificate) -> bool:
    """Whether ``issuer`` has signed it. Raises ``Faulty`` for an algorithm that is not supported."""
    try:
        certificate.verify_directly_issued_by(issuer)
    except (InvalidSignature, *_BROKEN):
        return False
    except UnsupportedAlgorithm:
        said = Text.of("trust.algorithm", name=named(certificate))
        raise Faulty(CertificateFault.POLICY, said) from None
    return True


def _forged(certificate: x509.Certificate) -> Faulty:
    issuer = short(certificate.issuer.rfc4514_string())
    return Faulty(CertificateFault.INVALID, Text.of("trust.signature", issuer=issuer))


def _der(certificate: x509.Certificate) -> bytes:
    return certificate.public_bytes(Encoding.DER)


def _by_subject(certificates: Sequence[x509.Certificate]) -> Mapping[bytes, list[x509.Certificate]]:
    found: defaultdict[bytes, list[x509.Certificate]] = defaultdict(list)
    for one in certificates:
        found[one.subject.public_bytes()].append(one)
    return found
