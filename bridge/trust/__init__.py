"""Certificates of others, for every protocol: which are trusted, and what is wrong with the rest."""

from bridge.trust.chain import MOST_IN_CHAIN, TrustLists
from bridge.trust.judge import Purpose, judge
from bridge.trust.store import RejectedCertificate, TrustStore
from bridge.trust.verdict import CertificateFault, Verdict

__all__ = [
    "MOST_IN_CHAIN",
    "CertificateFault",
    "Purpose",
    "RejectedCertificate",
    "TrustLists",
    "TrustStore",
    "Verdict",
    "judge",
]
