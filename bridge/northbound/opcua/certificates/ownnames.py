"""Names and addresses by which clients reach the server, all of which its certificate has to have.

Without asyncua: the bus process asks for them, too.
"""

from __future__ import annotations

import contextlib
import ipaddress
import re
import socket
from collections.abc import Iterator, Sequence
from pathlib import Path
from typing import Final
from urllib.parse import urlsplit

from cryptography import x509

from bridge.config import OpcUaTable

_IPV4: Final = Path("/proc/net/fib_trie")
_IPV6: Final = Path("/proc/net/if_inet6")
_LOCAL: Final = re.compile(r"\|-- (\S+)\n\s+/32 host LOCAL")
"""An address of this machine in ``fib_trie``."""
_LOOPBACK: Final = ("localhost", "127.0.0.1")


def names_of(listen: str, configured: Sequence[str]) -> list[str]:
    """Host names and IP addresses, each once: those of the site file, of this machine, and what is listened
    on. ``listen`` is an address and a port; 0.0.0.0 and :: are all addresses of the machine."""
    own = (socket.gethostname(), *addresses_of(listen), *_LOOPBACK)
    return list(dict.fromkeys((*configured, *(name for name in own if name and name.isascii()))))


def reached_by(settings: OpcUaTable) -> list[str]:
    """Names and addresses of the site file by which clients reach the server, beside the machine's own."""
    hosts = (urlsplit(url).hostname or "" for url in settings.endpoints)
    return list(dict.fromkeys((*settings.names, *hosts)))


def addresses_of(listen: str) -> list[str]:
    """Addresses of this machine that ``listen``, an address and a port, stands for."""
    host = listen.rpartition(":")[0].strip("[]")
    return [*own_addresses()] if ipaddress.ip_address(host).is_unspecified else [host]


def own_addresses(ipv4: Path = _IPV4, ipv6: Path = _IPV6) -> Iterator[str]:
    """Addresses of this machine's interfaces, without those of a single link (fe80::/10)."""
    yield from dict.fromkeys(_LOCAL.findall(_read(ipv4)))
    for line in _read(ipv6).splitlines():
        address = ipaddress.ip_address(bytes.fromhex(line.split()[0]))
        if not address.is_link_local:
            yield str(address)


def _read(path: Path) -> str:
    """Content of the file; empty where the kernel has none, as one that was built without IPv6."""
    with contextlib.suppress(OSError):
        return path.read_text(encoding="ascii")
    return ""


def general_name(name: str) -> x509.GeneralName:
    """A host name or an address as it stands in a certificate."""
    try:
        return x509.IPAddress(ipaddress.ip_address(name))
    except ValueError:
        return x509.DNSName(name)


def missing_in(certificate: x509.Certificate, names: Sequence[str]) -> list[str]:
    """The ``names`` that the certificate lacks."""
    try:
        found = certificate.extensions.get_extension_for_class(x509.SubjectAlternativeName).value
    except x509.ExtensionNotFound:
        return list(names)
    return [name for name in names if general_name(name) not in list(found)]
