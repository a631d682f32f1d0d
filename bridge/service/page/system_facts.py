"""Facts of the service itself for the page, read from files and from the system on request."""

from __future__ import annotations

import json
import platform
import re
import socket
from collections.abc import Iterator
from datetime import UTC, datetime
from importlib.metadata import PackageNotFoundError, version
from pathlib import Path
from typing import Any, Final, cast

from cryptography import x509
from cryptography.exceptions import UnsupportedAlgorithm

from bridge import __version__
from bridge.base.errors import BridgeError, Fault, FileFaults
from bridge.config import ListeningTable, OpcUaTable, Site
from bridge.lint import Severity, lint
from bridge.northbound.opcua.certificates.own_files import CERTIFICATES, own_pair
from bridge.northbound.page.system import CertificateFacts, UnreadablePart
from bridge.project import Project, load_project
from bridge.text import Text, as_json
from bridge.trust import TrustStore
from bridge.trust.files import fingerprint, thumbprint
from bridge.trust.inventory import inventory
from bridge.trust.store import OWN

_LIBRARIES: Final = ("asyncua", "pymodbus", "eclipse-zenoh", "python-can", "canopen", "starlette", "uvicorn")
_SECRETS: Final = (
    re.compile(r"()\$argon2[^\s\"']*"),
    re.compile(r"(?i)(\w*(?:base64|secret|password|token)\w*=)[^;#\"'\s]+"),
)
"""Hashes wherever they stand, and what a locator of zenoh may carry."""
_HASHES: Final = re.compile(
    r"""(password_hash["']?\s*=\s*)"""
    r"""(\"{3}.*?\"{3}|'{3}.*?'{3}|"(?:[^"\\\n]|\\.)*"|'[^'\n]*'|[^\n]*)""",
    re.DOTALL,
)
"""Value of a key for a hash, whatever that is."""
_TABLES: Final = ("/proc/self/net/tcp", "/proc/self/net/tcp6")
_ESTABLISHED: Final = "01"
_MALFORMED: Final = (ValueError, TypeError, OverflowError, x509.InvalidVersion, UnsupportedAlgorithm)
"""Errors of a file that is no certificate, or one that is broken in any of its parts."""
_TAIL_BYTES: Final = 1 << 20


class SystemOf:
    """The service that runs ``project``."""

    def __init__(self, project: Project) -> None:
        self._path = project.path
        self._site = project.site
        self._began_with = _read(project.path)
        self._versions: dict[str, str] = {}

    def versions(self) -> dict[str, str]:
        """Versions of the program and its libraries; kept, because they are looked for in many files."""
        if not self._versions:
            self._versions = {
                "drivebridge": __version__,
                "Python": platform.python_version(),
                "system": f"{platform.system()} {platform.release()}",
                **{name: found for name in _LIBRARIES if (found := _version(name))},
            }
        return self._versions

    def connections(self) -> dict[str, list[str]]:
        ports = dict(_ports(self._site))
        found: dict[str, list[str]] = {name: [] for name in ports.values()}
        for local, remote in _established():
            if local in ports:
                found[ports[local]].append(remote)
        return {name: sorted(addresses) for name, addresses in found.items()}

    def certificates(self) -> list[CertificateFacts | UnreadablePart]:
        return list(_certificates(self._site))

    def site_file(self) -> dict[str, str]:
        text = _read(self._path)
        told = {"path": str(self._path), "text": without_secrets(text)}
        return told if text == self._began_with else {**told, "changed": "yes"}

    def check(self) -> list[dict[str, Any]]:
        try:
            project = load_project(self._path)
            verdict = lint(project.site, project.families, project.path, project.downloads)
        except FileFaults as error:
            return [_shown("error", one) for one in error.faults]
        except BridgeError as error:
            return [{"severity": "error", "line": 0, "message": str(error), "text": as_json(error.said)}]
        findings = [
            (severity, one.fault)
            for severity in (Severity.ERROR, Severity.WARNING)
            for one in verdict.of(severity)
        ]
        return [_shown(str(one), fault) for one, fault in findings]

    def audit(self, lines: int) -> list[dict[str, Any]]:
        table = self._site.audit
        if not table.enabled:
            return []
        path = Path(table.file) if table.file else Path(self._site.site.state_dir) / "audit.jsonl"
        refused = path.with_name(f"{path.stem}-refused{path.suffix}")
        entries = [*_entries(path, lines), *_entries(refused, lines)]
        return sorted(entries, key=lambda entry: str(entry.get("t", "")), reverse=True)[:lines]


def _shown(severity: str, fault: Fault) -> dict[str, Any]:
    return {"severity": severity, "line": fault.line, "message": str(fault), "text": as_json(fault.text)}


def _entries(path: Path, most: int) -> list[dict[str, Any]]:
    """The latest of a log of JSON lines, the newest first."""
    entries: list[dict[str, Any]] = []
    for line in reversed(_tail(path)):
        try:
            entry = json.loads(line)
        except (ValueError, RecursionError):
            continue  # cut off at the beginning, or being written
        if isinstance(entry, dict):
            entries.append(cast("dict[str, Any]", entry))
        if len(entries) == most:
            break
    return entries


def without_secrets(text: str) -> str:
    """A site file as people may see it: it stays TOML of the same lines."""
    text = _HASHES.sub(lambda match: f'{match[1]}"…"' + "\n" * match[2].count("\n"), text)
    for pattern in _SECRETS:
        text = pattern.sub(r"\1…", text)
    return text


def _read(path: Path) -> str:
    try:
        return path.read_text(encoding="utf-8", errors="replace")
    except OSError as error:
        return f"# {path} cannot be read: {error.strerror or error}\n"


def _version(package: str) -> str:
    try:
        return version(package)
    except PackageNotFoundError:
        return ""


def _ports(site: Site) -> Iterator[tuple[int, str]]:
    """Ports that are served, each with its protocol."""
    for name, table in site:
        if isinstance(table, ListeningTable):
            yield int(table.listen.rpartition(":")[2]), name
    for locator in site.zenoh.listen if site.zenoh else ():
        address = re.match(r"[a-z]+/.*:(\d+)", locator)
        if address:
            yield int(address[1]), "zenoh"


def _established() -> Iterator[tuple[int, str]]:
    """The local port and the peer of each TCP connection of this machine, as proc(5) has them."""
    for table in _TABLES:
        try:
            lines = Path(table).read_text(encoding="ascii").splitlines()[1:]
        except OSError:
            continue
        for line in lines:
            _, local, remote, state, *_ = line.split()
            if state == _ESTABLISHED:
                yield int(local.rpartition(":")[2], 16), _address(remote)


def _address(text: str) -> str:
    """``0100007F:1F90`` is 127.0.0.1:8080: words of four bytes in the machine's order, here little-endian."""
    host, _, port = text.partition(":")
    words = bytes.fromhex(host)
    data = b"".join(words[n : n + 4][::-1] for n in range(0, len(words), 4))
    family = socket.AF_INET if len(data) == 4 else socket.AF_INET6
    shown = socket.inet_ntop(family, data).removeprefix("::ffff:")
    return f"[{shown}]:{int(port, 16)}" if ":" in shown else f"{shown}:{int(port, 16)}"


def _certificates(site: Site) -> Iterator[CertificateFacts | UnreadablePart]:
    opcua, page = site.opcua, site.page
    if opcua:
        own, _ = own_pair(opcua, Path(site.site.state_dir) / CERTIFICATES / OWN)
        yield from _certificate("opcua", own)
        yield from _kept(store_of(opcua, Path(site.site.state_dir)))
        if opcua.trusted_dir:
            yield from _trusted(Path(opcua.trusted_dir))
    if page and page.certificate:
        yield from _certificate("page", Path(page.certificate))


def store_of(settings: OpcUaTable, state_dir: Path) -> TrustStore:
    """The folders of the site. A ``trusted_dir`` that is none is as good as an empty one."""
    also = [Path(settings.trusted_dir)] if settings.trusted_dir else []
    return TrustStore(state_dir / CERTIFICATES, also)


def _kept(store: TrustStore) -> Iterator[CertificateFacts]:
    """Certificates of others in the folders of the site."""
    for one in inventory(store, datetime.now(UTC)):
        if one.place != OWN:
            bounds = one.since.timestamp(), one.until.timestamp()
            print_ = _in_pairs(one.fingerprint)
            yield CertificateFacts(one.place, one.subject, *bounds, print_, one.thumbprint, one.said)


def _trusted(folder: Path) -> Iterator[CertificateFacts | UnreadablePart]:
    try:
        files = sorted(folder.iterdir())
    except FileNotFoundError:
        return
    except OSError as error:
        yield UnreadablePart(folder.name, error.strerror or str(error))
        return
    for file in files:
        yield from _certificate(file.name, file)


def _certificate(of: str, file: Path) -> Iterator[CertificateFacts | UnreadablePart]:
    """Facts of the certificate in a file, or why it cannot be read; nothing where there is no file."""
    try:
        content = file.read_bytes()
        is_text = content.lstrip().startswith(b"-----")
        one = x509.load_pem_x509_certificate(content) if is_text else x509.load_der_x509_certificate(content)
        subject = one.subject.rfc4514_string()
        bounds = one.not_valid_before_utc.timestamp(), one.not_valid_after_utc.timestamp()
        prints = _in_pairs(fingerprint(one)), thumbprint(one)
    except FileNotFoundError:
        return
    except OSError as error:
        yield UnreadablePart(of, error.strerror or str(error))
    except _MALFORMED as error:
        yield UnreadablePart(of, Text.of("page.no_certificate", why=str(error)))
    else:
        yield CertificateFacts(of, subject, *bounds, *prints)


def _in_pairs(fingerprint: str) -> str:
    return bytes.fromhex(fingerprint).hex(":").upper()


def _tail(path: Path) -> list[bytes]:
    """The last lines of a file that may be long."""
    try:
        with path.open("rb") as file:
            file.seek(0, 2)
            file.seek(max(0, file.tell() - _TAIL_BYTES))
            return file.read().splitlines()
    except OSError:
        return []
