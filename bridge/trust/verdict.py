"""Verdict on a certificate: trusted, or the one fault that keeps it out."""

from __future__ import annotations

from dataclasses import dataclass
from enum import StrEnum
from typing import Final

from bridge.text import Said, render


class CertificateFault(StrEnum):
    """Faults of a certificate, by the names of their status codes (OPC 10000-4 §6.1.3)."""

    INVALID = "BadCertificateInvalid"
    CHAIN_INCOMPLETE = "BadCertificateChainIncomplete"
    POLICY = "BadCertificatePolicyCheckFailed"
    UNTRUSTED = "BadCertificateUntrusted"
    TIME = "BadCertificateTimeInvalid"
    ISSUER_TIME = "BadCertificateIssuerTimeInvalid"
    HOST_NAME = "BadCertificateHostNameInvalid"
    URI = "BadCertificateUriInvalid"
    USE = "BadCertificateUseNotAllowed"
    ISSUER_USE = "BadCertificateIssuerUseNotAllowed"
    REVOCATION_UNKNOWN = "BadCertificateRevocationUnknown"
    ISSUER_REVOCATION_UNKNOWN = "BadCertificateIssuerRevocationUnknown"
    REVOKED = "BadCertificateRevoked"
    ISSUER_REVOKED = "BadCertificateIssuerRevoked"


_STRANGERS: Final = frozenset(
    (
        CertificateFault.INVALID,
        CertificateFault.CHAIN_INCOMPLETE,
        CertificateFault.POLICY,
        CertificateFault.UNTRUSTED,
    )
)


@dataclass(frozen=True, slots=True)
class Verdict:
    """Outcome of a judgement; ``said`` is the fault for people."""

    fault: CertificateFault | None = None
    said: Said = ""

    @property
    def is_strangers(self) -> bool:
        """True up to the look at the trust list: its owner is not told which fault it is (OPC 10000-4
        §6.1.3)."""
        return self.fault in _STRANGERS

    def __str__(self) -> str:
        return f"{self.fault}: {render(self.said)}" if self.fault else "trusted"


TRUSTED: Final = Verdict()


class Faulty(Exception):
    """A step of the judgement that has found a fault."""

    def __init__(self, fault: CertificateFault, said: Said) -> None:
        super().__init__(fault)
        self.verdict = Verdict(fault, said)
