"""Addresses of the server's endpoints, as a client is to be told them: those that it has used itself."""

from __future__ import annotations

import ipaddress
from collections.abc import Iterable
from urllib.parse import SplitResult, urlsplit


class OwnAddresses:
    """``hosts`` are names and addresses of this machine, ``urls`` those by which others lead to it, such as a
    router's, ``opc.tcp://host:port``."""

    def __init__(self, hosts: Iterable[str] = (), urls: Iterable[str] = ()) -> None:
        self._hosts = frozenset(map(_plain, hosts))
        self._elsewhere = frozenset(_place(urlsplit(url)) for url in urls)

    def answer(self, configured: str, asked: str | None, local: str = "") -> str:
        """URL of the endpoint ``configured`` for a client that has asked by ``asked`` (Part 4 §5.5.4).

        Only what leads here is repeated: a client must not be sent elsewhere by what somebody else has put
        into its request. ``local`` is this machine's address of the connection.
        """
        try:
            url = urlsplit(asked or "")
            host, _ = place = _place(url)
        except ValueError:
            return configured
        is_ours = host in self._hosts or (local and host == _plain(local)) or place in self._elsewhere
        if url.scheme != "opc.tcp" or not is_ours:
            return configured
        # The port, too: of a tunnel or a container it is another one.
        ours = urlsplit(configured)
        return f"{ours.scheme}://{url.netloc.rpartition('@')[2]}{ours.path}"


_DEFAULT_PORT = 4840
"""Part 6 §7.2."""


def _place(url: SplitResult) -> tuple[str, int]:
    """Host and port. Raises ValueError for a port that is none."""
    return _plain(url.hostname or ""), url.port or _DEFAULT_PORT


def _plain(host: str) -> str:
    """The same for every way to write it."""
    try:
        return str(ipaddress.ip_address(host.strip("[]").partition("%")[0]))
    except ValueError:
        return host.lower().rstrip(".")
