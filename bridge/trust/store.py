"""Folders of certificates, which people and tools change while the service runs.

``trusted`` and ``issuers`` hold certificates and revocation lists under any name, ``rejected`` what was
refused, under its thumbprint: nothing that a stranger has chosen becomes the name of a file.
"""

from __future__ import annotations

import contextlib
import logging
import os
from collections.abc import Iterator, Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import Final

from cryptography import x509
from cryptography.hazmat.primitives.hashes import SHA1
from cryptography.hazmat.primitives.serialization import Encoding

from bridge.base.errors import OperationFailed, Unavailable
from bridge.base.quietlog import log_source
from bridge.base.ratelimit import RateLimit
from bridge.text import Text
from bridge.trust.chain import TrustLists
from bridge.trust.files import (
    MALFORMED,
    Content,
    certificates_in,
    der,
    parse,
    read_limited,
    thumbprint,
    write_whole,
)

_log = logging.getLogger(__name__)

OWN: Final = "own"
TRUSTED: Final = "trusted"
ISSUERS: Final = "issuers"
REJECTED: Final = "rejected"
MOST_FILES: Final = 500
"""Files of one folder that are read."""
MOST_REJECTED: Final = 100
_AT_ONCE: Final = 100
_EVERY_S: Final = 1.0
_OF_SOURCE_AT_ONCE: Final = 5
_OF_SOURCE_EVERY_S: Final = 60.0
"""Pace at which strangers get files written, all of them and those of one address: who makes up certificates
must not keep out the one that somebody looks for."""
_MOST_SOURCES: Final = 200
_LEAST_PREFIX: Final = 6
_PUBLIC: Final = 0o644
_SUFFIX: Final = ".der"
_Mark = tuple[int, int]
"""Time of change in ns, and size, of a file."""


@dataclass(frozen=True, slots=True)
class RejectedCertificate:
    """Certificate that was refused, and those that came along, as the peer ``sent`` them."""

    file: Path
    sent: tuple[x509.Certificate, ...]

    @property
    def certificate(self) -> x509.Certificate:
        return self.sent[0]


class _Folder:
    """Contents of one folder, each file read once for as long as it does not change."""

    def __init__(self, path: Path, *, is_quiet: bool = False) -> None:
        self.path = path
        self._level = logging.DEBUG if is_quiet else logging.WARNING
        self._held: dict[str, tuple[_Mark, Content | None]] = {}
        self.contents: list[tuple[Path, Content]] = []

    def look(self) -> bool:
        """Read what has changed. True where that is anything."""
        marks = dict(_marks(self.path))
        if {name: mark for name, (mark, _) in self._held.items()} == marks:
            return False
        self._held = {name: self._content(name, mark) for name, mark in marks.items()}
        found = sorted((name, content) for name, (_, content) in self._held.items() if content is not None)
        self.contents = [(self.path / name, content) for name, content in found]
        return True

    def _content(self, name: str, mark: _Mark) -> tuple[_Mark, Content | None]:
        held = self._held.get(name)
        if held is not None and held[0] == mark:
            return held
        try:
            return mark, parse(read_limited(self.path / name))
        except (OSError, *MALFORMED) as error:
            what = "%s is neither a certificate nor a revocation list and is left out: %s"
            _log.log(self._level, what, self.path / name, error)
            return mark, None


def _marks(folder: Path) -> Iterator[tuple[str, _Mark]]:
    """Files of the folder; of a folder that is not there, or not to be read, nothing."""
    try:
        with os.scandir(folder) as entries:
            # What is being written has another suffix until it is whole.
            files = [one for one in entries if not one.name.startswith(".") and not one.name.endswith(".new")]
    except OSError:
        return
    for entry in sorted(files, key=lambda one: one.name)[:MOST_FILES]:
        with contextlib.suppress(OSError):
            if entry.is_file():
                found = entry.stat()
                yield entry.name, (found.st_mtime_ns, found.st_size)
    if len(files) > MOST_FILES:
        _log.warning("%s has more than %d files: the others are left out", folder, MOST_FILES)


class TrustStore:
    """The folders below ``folder``; those in ``also_trusted`` are trusted, too, and are never written."""

    def __init__(self, folder: Path, also_trusted: Sequence[Path] = ()) -> None:
        self.folder = folder
        self.own, self.trusted = folder / OWN, folder / TRUSTED
        self.issuers, self.rejected = folder / ISSUERS, folder / REJECTED
        self._trusted = [_Folder(path) for path in (self.trusted, *also_trusted)]
        self._issuers = _Folder(self.issuers)
        self._lists = TrustLists()
        self._pace = RateLimit(_AT_ONCE, _EVERY_S)
        self._paces: dict[str, RateLimit] = {}

    def prepare(self) -> None:
        """Make the folders that are missing. Raises ``Unavailable``."""
        for path in (self.own, self.trusted, self.issuers, self.rejected):
            try:
                path.mkdir(mode=0o700, parents=True, exist_ok=True)
            except OSError as error:
                hint = "the folder is in state_dir of the site file and must be writable for the service"
                raise Unavailable(f"{path}: {error.strerror} ({hint})") from error

    def lists(self) -> TrustLists:
        """Content of the folders at this moment."""
        # All of them look: the first change must not hide the next.
        changes = [one.look() for one in (*self._trusted, self._issuers)]
        if any(changes):
            trusted = [content for one in self._trusted for _, content in one.contents]
            issuers = [content for _, content in self._issuers.contents]
            self._lists = TrustLists(
                [one for one in trusted if isinstance(one, x509.Certificate)],
                [one for one in issuers if isinstance(one, x509.Certificate)],
                [one for one in (*trusted, *issuers) if not isinstance(one, x509.Certificate)],
            )
        return self._lists

    def files(self, folder: Path) -> list[tuple[Path, Content]]:
        """Certificates and revocation lists in one of the folders, with their files."""
        found = _Folder(folder, is_quiet=True)
        found.look()
        return found.contents

    # what was refused

    def keep_rejected(self, sent: Sequence[x509.Certificate], source: str, now: float) -> None:
        """Put what a peer from the address ``source`` sent into ``rejected``, where the oldest makes room.
        ``now`` is monotonic."""
        path = self.rejected / f"{thumbprint(sent[0])}{_SUFFIX}"
        if path.exists() or not self._may_write(source, now):
            return
        try:
            write_whole(path, b"".join(map(der, sent)), _PUBLIC)
            for _, old in sorted(self._rejected_files(), reverse=True)[MOST_REJECTED:]:
                old.unlink(missing_ok=True)
        except OSError as error:
            _log.warning("%s cannot be written: %s", path, error.strerror, extra=log_source("rejected"))

    def _may_write(self, source: str, now: float) -> bool:
        pace = self._paces.pop(source, None) or RateLimit(_OF_SOURCE_AT_ONCE, _OF_SOURCE_EVERY_S)
        self._paces[source] = pace
        if len(self._paces) > _MOST_SOURCES:
            del self._paces[next(iter(self._paces))]
        return pace.allows(now) and self._pace.allows(now)

    def rejected_ones(self) -> list[RejectedCertificate]:
        """Certificates that were refused, the latest first."""
        found: list[RejectedCertificate] = []
        for _, path in sorted(self._rejected_files(), reverse=True)[:MOST_REJECTED]:
            with contextlib.suppress(OSError, *MALFORMED):
                sent = certificates_in(read_limited(path))
                if sent:
                    found.append(RejectedCertificate(path, tuple(sent)))
        return found

    def _rejected_files(self) -> Iterator[tuple[int, Path]]:
        with contextlib.suppress(OSError), os.scandir(self.rejected) as entries:
            for entry in entries:
                if entry.name.endswith(_SUFFIX):
                    with contextlib.suppress(OSError):
                        yield entry.stat().st_mtime_ns, Path(entry.path)

    # what people decide

    def trust(self, certificate: x509.Certificate) -> Path:
        """Put it into ``trusted``. Raises ``OperationFailed``."""
        path = self._put(self.trusted, certificate)
        _remove(self.rejected / path.name)
        return path

    def reject(self, file: Path) -> Path:
        """Move a certificate out of ``trusted``, whatever files it is in, into ``rejected``. Raises
        ``OperationFailed``."""
        try:
            content = parse(read_limited(file))
        except (OSError, *MALFORMED) as error:
            raise OperationFailed(Text.of("trust.unusable_file", file=str(file), why=str(error))) from error
        path = self._put(self.rejected, content) if isinstance(content, x509.Certificate) else file
        for same in {file, *(one for one, held in self.files(self.trusted) if held == content)}:
            _remove(same)
        return path

    def add(self, folder: Path, content: Content) -> Path:
        """Put a certificate or a revocation list into ``trusted`` or ``issuers``. Raises
        ``OperationFailed``."""
        if isinstance(content, x509.Certificate):
            return self._put(folder, content)
        encoded = content.public_bytes(Encoding.DER)
        return _write(folder / f"{content.fingerprint(SHA1()).hex()}.crl", encoded)

    def replace(self, folder: Path, kind: type[Content], contents: Sequence[Content]) -> None:
        """Have exactly these of one kind in ``folder``: first the new ones come, then the others go. Raises
        ``OperationFailed``."""
        kept = {self.add(folder, one) for one in contents}
        for file, content in self.files(folder):
            if isinstance(content, kind) and file not in kept:
                file.unlink(missing_ok=True)

    def _put(self, folder: Path, certificate: x509.Certificate) -> Path:
        return _write(folder / f"{thumbprint(certificate)}{_SUFFIX}", der(certificate))

    def find_rejected(self, prefix: str) -> RejectedCertificate:
        """Certificate in ``rejected`` whose thumbprint begins so. Raises ``OperationFailed`` for none and for
        several."""
        found = [one for one in self.rejected_ones() if _matches(one.certificate, prefix)]
        if len(found) == 1:
            return found[0]
        raise _not_one(prefix, len(found), self.rejected)

    def find_trusted(self, prefix: str) -> Path:
        """A file in ``trusted`` of the certificate whose thumbprint begins so. Raises as
        ``find_rejected``."""
        files = self.files(self.trusted)
        found = {
            one: path for path, one in files if isinstance(one, x509.Certificate) and _matches(one, prefix)
        }
        if len(found) == 1:
            return next(iter(found.values()))
        raise _not_one(prefix, len(found), self.trusted)


def _write(path: Path, content: bytes) -> Path:
    """Raises ``OperationFailed``."""
    try:
        path.parent.mkdir(mode=0o700, parents=True, exist_ok=True)
        write_whole(path, content, _PUBLIC)
    except OSError as error:
        raise OperationFailed(Text.of("trust.unwritable", file=str(path), why=str(error))) from error
    return path


def _remove(path: Path) -> None:
    """Remove the file, which need not be there. Raises ``OperationFailed``."""
    try:
        path.unlink(missing_ok=True)
    except OSError as error:
        raise OperationFailed(Text.of("trust.unwritable", file=str(path), why=str(error))) from error


def _matches(certificate: x509.Certificate, prefix: str) -> bool:
    plain = prefix.replace(":", "").replace(" ", "").lower()
    return len(plain) >= _LEAST_PREFIX and thumbprint(certificate).startswith(plain)


def _not_one(prefix: str, count: int, folder: Path) -> OperationFailed:
    if count:
        return OperationFailed(Text.of("trust.several", thumbprint=prefix, folder=str(folder), count=count))
    said = Text.of("trust.no_such", thumbprint=prefix, folder=str(folder), least=_LEAST_PREFIX)
    return OperationFailed(said)
