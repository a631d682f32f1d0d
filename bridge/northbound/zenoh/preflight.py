"""Needs of the zenoh server in the site file and on the machine, looked at before a bus is opened."""

from __future__ import annotations

import re
from typing import Final

from bridge.config import ZenohTable
from bridge.northbound.listening import listen
from bridge.northbound.zenoh.users import read_users

_TCP: Final = re.compile(r"(?:tcp|tls)/(?P<place>[^?#]+:[0-9]+)(?:[?#].*)?")
_LISTEN: Final = "zenoh.listen"


def check_zenoh(settings: ZenohTable) -> None:
    """Raises ``Unavailable`` for users that cannot be read."""
    read_users(settings)


async def check_ports(settings: ZenohTable) -> None:
    """Raises ``Unavailable`` where an endpoint that it is to listen on is taken, or cannot be had. zenoh
    opens its sockets itself, in a process of its own, so none is kept here."""
    if settings.mode != "peer":
        return
    for endpoint in settings.listen:
        if found := _TCP.fullmatch(endpoint):
            listen(found["place"], _LISTEN).close()
