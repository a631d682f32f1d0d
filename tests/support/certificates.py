"""An authority of tests, and a certificate of each kind that a judge has to refuse."""

from __future__ import annotations

from collections.abc import Iterator, Mapping
from dataclasses import dataclass, field, replace
from datetime import UTC, datetime, timedelta
from functools import cache

from cryptography import x509
from cryptography.hazmat.primitives.asymmetric import ec, rsa
from cryptography.hazmat.primitives.hashes import SHA224, SHA256, HashAlgorithm
from cryptography.hazmat.primitives.serialization import Encoding, NoEncryption, PrivateFormat
from cryptography.x509.oid import ExtendedKeyUsageOID, NameOID

from bridge.trust import CertificateFault, TrustLists

NOW = datetime.now(UTC).replace(microsecond=0)
"""The time at which they are judged: also by servers, which have no other."""
DAY = timedelta(days=1)
CLIENT_URI = "urn:test:client"
_USAGES = (
    "digital_signature",
    "content_commitment",
    "key_encipherment",
    "data_encipherment",
    "key_agreement",
    "key_cert_sign",
    "crl_sign",
    "encipher_only",
    "decipher_only",
)
_APPLICATION = ("digital_signature", "content_commitment", "key_encipherment", "data_encipherment")
Key = rsa.RSAPrivateKey | ec.EllipticCurvePrivateKey


@cache
def rsa_key(number: int = 0, bits: int = 2048) -> rsa.RSAPrivateKey:
    """The ``number``-th key of so many bits: each takes its time to make."""
    return rsa.generate_private_key(65537, bits)


@dataclass(frozen=True)
class Recipe:
    """A certificate to be made; by default a client's as it should be."""

    subject: str = "client"
    key: Key = field(default_factory=lambda: rsa_key(1))
    uri: str = CLIENT_URI
    usages: tuple[str, ...] | None = _APPLICATION
    extended: tuple[x509.ObjectIdentifier, ...] | None = (ExtendedKeyUsageOID.CLIENT_AUTH,)
    begins: datetime = NOW - DAY
    ends: datetime = NOW + 30 * DAY
    digest: HashAlgorithm = field(default_factory=SHA256)
    is_ca: bool = False
    path_length: int | None = None

    def but(self, **changes: object) -> Recipe:
        return replace(self, **changes)  # pyright: ignore[reportArgumentType]


CLIENT = Recipe()
AUTHORITY = Recipe(
    "root", rsa_key(2), "", ("key_cert_sign", "crl_sign"), None, NOW - 9 * DAY, NOW + 99 * DAY, is_ca=True
)


@dataclass(frozen=True)
class Made:
    """A certificate with its key, and the one that has issued it."""

    certificate: x509.Certificate
    key: Key
    issuer: Made | None = None

    @property
    def der(self) -> bytes:
        return self.certificate.public_bytes(Encoding.DER)

    @property
    def pem_key(self) -> bytes:
        return self.key.private_bytes(Encoding.PEM, PrivateFormat.PKCS8, NoEncryption())


def _name(subject: str) -> x509.Name:
    return x509.Name([x509.NameAttribute(NameOID.COMMON_NAME, subject)])


def make(recipe: Recipe = CLIENT, issuer: Made | None = None, signed_by: Key | None = None) -> Made:
    """A certificate, by default signed by itself; ``signed_by`` another key than the issuer's, as a forger
    would."""
    above = issuer.certificate.subject if issuer else _name(recipe.subject)
    builder = (
        x509.CertificateBuilder(above, _name(recipe.subject), recipe.key.public_key())
        .serial_number(x509.random_serial_number())
        .not_valid_before(recipe.begins)
        .not_valid_after(recipe.ends)
        .add_extension(x509.BasicConstraints(recipe.is_ca, recipe.path_length), critical=True)
    )
    if recipe.usages is not None:
        flags = {name: name in recipe.usages for name in _USAGES}
        builder = builder.add_extension(x509.KeyUsage(**flags), critical=True)
    if recipe.extended is not None:
        builder = builder.add_extension(x509.ExtendedKeyUsage(recipe.extended), critical=False)
    if recipe.uri:
        names = [x509.UniformResourceIdentifier(recipe.uri), x509.DNSName("localhost")]
        builder = builder.add_extension(x509.SubjectAlternativeName(names), critical=False)
    key = signed_by or (issuer.key if issuer else recipe.key)
    return Made(builder.sign(key, recipe.digest), recipe.key, issuer)


def signed(request: bytes, issuer: Made) -> x509.Certificate:
    """What an authority makes of a signing request in DER."""
    asked = x509.load_der_x509_csr(request)
    names = asked.extensions.get_extension_for_class(x509.SubjectAlternativeName)
    builder = x509.CertificateBuilder(issuer.certificate.subject, asked.subject, asked.public_key())
    builder = builder.serial_number(7).not_valid_before(NOW - DAY).not_valid_after(NOW + DAY)
    builder = builder.add_extension(names.value, critical=False)
    return builder.sign(issuer.key, SHA256())  # pyright: ignore[reportArgumentType]


def crl_of(
    issuer: Made, *revoked: Made, ends: datetime = NOW + DAY, signed_by: Key | None = None
) -> x509.CertificateRevocationList:
    builder = x509.CertificateRevocationListBuilder(
        issuer.certificate.subject, last_update=NOW - 2 * DAY, next_update=ends
    )
    for one in revoked:
        entry = x509.RevokedCertificateBuilder(one.certificate.serial_number, NOW - DAY)
        builder = builder.add_revoked_certificate(entry.build())
    return builder.sign(signed_by or issuer.key, SHA256())  # pyright: ignore[reportArgumentType]


@dataclass(frozen=True)
class Case:
    """What a client shows and what the server's folders hold, with the fault that has to be found."""

    sent: tuple[Made, ...]
    trusted: tuple[Made, ...]
    issuers: tuple[Made, ...] = ()
    crls: tuple[x509.CertificateRevocationList, ...] = ()
    fault: CertificateFault | None = None

    @property
    def lists(self) -> TrustLists:
        trusted, issuers = ([one.certificate for one in made] for made in (self.trusted, self.issuers))
        return TrustLists(trusted, issuers, self.crls)

    @property
    def chain(self) -> list[x509.Certificate]:
        return [one.certificate for one in self.sent]


@cache
def cases() -> Mapping[str, Case]:
    """A case of each kind, by what is special about it."""
    return dict(_cases())


def _alone(made: Made, fault: CertificateFault | None) -> Case:
    return Case((made,), (made,), fault=fault)


def _cases() -> Iterator[tuple[str, Case]]:
    fault = CertificateFault
    good = make()
    yield "trusted itself", _alone(good, None)
    yield "unknown", Case((good,), (), fault=fault.UNTRUSTED)
    yield "forged", _alone(make(signed_by=rsa_key(3)), fault.INVALID)
    yield "short key", _alone(make(CLIENT.but(key=rsa_key(4, 1024))), fault.POLICY)
    yield "no RSA key", _alone(make(CLIENT.but(key=ec.generate_private_key(ec.SECP256R1()))), fault.POLICY)
    yield "SHA-224", _alone(make(CLIENT.but(digest=SHA224())), fault.POLICY)
    yield "run out", _alone(make(CLIENT.but(ends=NOW - DAY / 2)), fault.TIME)
    yield "of tomorrow", _alone(make(CLIENT.but(begins=NOW + DAY)), fault.TIME)
    yield "another application", _alone(make(CLIENT.but(uri="urn:another")), fault.URI)
    yield "no application", _alone(make(CLIENT.but(uri="")), fault.URI)
    yield "not for signing", _alone(make(CLIENT.but(usages=("data_encipherment",))), fault.USE)
    yield "not for encryption", _alone(make(CLIENT.but(usages=("digital_signature",))), fault.USE)
    server = CLIENT.but(extended=(ExtendedKeyUsageOID.SERVER_AUTH,))
    yield "a server's", _alone(make(server), fault.USE)
    yield "silent on its use", _alone(make(CLIENT.but(usages=None, extended=None)), None)
    # As Ignition makes them for itself.
    both = CLIENT.but(is_ca=True, usages=(*_APPLICATION, "key_cert_sign"))
    yield "an authority's as well", _alone(make(both), None)
    yield from _issued(fault)


def _issued(fault: type[CertificateFault]) -> Iterator[tuple[str, Case]]:
    root = make(AUTHORITY)
    leaf = make(CLIENT, root)
    crl = crl_of(root)
    yield "of a trusted authority", Case((leaf,), (root,), (), (crl,))
    yield "its authority only known", Case((leaf,), (leaf,), (root,), (crl,))
    yield "its authority sent along", Case((leaf, root), (leaf,), (), (crl,))
    yield "of an authority that is only known", Case((leaf,), (), (root,), (crl,), fault.UNTRUSTED)
    yield "without its authority", Case((leaf,), (leaf,), fault=fault.CHAIN_INCOMPLETE)
    forged = make(CLIENT, root, signed_by=rsa_key(3))
    yield "forged under an authority's name", Case((forged,), (root,), (), (crl,), fault.INVALID)
    yield "without a list", Case((leaf,), (root,), fault=fault.REVOCATION_UNKNOWN)
    foreign = crl_of(root, signed_by=rsa_key(3))
    yield "with a forged list", Case((leaf,), (root,), (), (foreign,), fault.REVOCATION_UNKNOWN)
    old = crl_of(root, ends=NOW - DAY)
    yield "with an old list", Case((leaf,), (root,), (), (old,), fault.REVOCATION_UNKNOWN)
    yield "revoked", Case((leaf,), (root,), (), (crl_of(root, leaf),), fault.REVOKED)
    yield (
        "revoked though trusted itself",
        Case((leaf,), (leaf,), (root,), (crl_of(root, leaf),), fault.REVOKED),
    )
    ended = make(AUTHORITY.but(ends=NOW - DAY / 2))
    yield (
        "of a former authority",
        Case((make(CLIENT, ended),), (ended,), (), (crl_of(ended),), fault.ISSUER_TIME),
    )
    none = make(AUTHORITY.but(is_ca=False))
    yield "of no authority", Case((make(CLIENT, none),), (none,), (), (crl_of(none),), fault.ISSUER_USE)
    mute = make(AUTHORITY.but(usages=("digital_signature",)))
    yield (
        "of one that may not issue",
        Case((make(CLIENT, mute),), (mute,), (), (crl_of(mute),), fault.ISSUER_USE),
    )
    weak = make(AUTHORITY.but(key=rsa_key(4, 1024)))
    yield "of a weak authority", Case((make(CLIENT, weak),), (weak,), (), (crl_of(weak),), fault.POLICY)
    between = make(AUTHORITY.but(subject="between", key=rsa_key(5)), root)
    below = make(CLIENT, between)
    both = (crl_of(root), crl_of(between))
    yield "of an authority below another", Case((below, between), (root,), (), both)
    issuer_unknown = fault.ISSUER_REVOCATION_UNKNOWN
    yield "no list of the root", Case((below, between), (root,), (), both[1:], issuer_unknown)
    gone = (crl_of(root, between), both[1])
    yield "of a revoked authority", Case((below, between), (root,), (), gone, fault.ISSUER_REVOKED)
    flat = make(AUTHORITY.but(path_length=0))
    deep = make(AUTHORITY.but(subject="between", key=rsa_key(5)), flat)
    too_deep = make(CLIENT, deep)
    lists = (crl_of(flat), crl_of(deep))
    yield "too far below a root", Case((too_deep, deep), (flat,), (), lists, fault.ISSUER_USE)
