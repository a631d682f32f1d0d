"""Settings of our zenoh sessions."""

# pyright: reportUnknownMemberType=false
# zenoh's stubs leave out the return types of what returns nothing.

from __future__ import annotations

import json
from collections.abc import Sequence
from typing import Final

import zenoh

from bridge.errors import Unavailable
from bridge.zenohlink.message import sentence

_LEASE_MS: Final = 1000
"""A peer that falls silent is noticed within this time; zenoh's default is 10 s."""
_STALLED_US: Final = 500_000
"""How long a query or a reply waits for a peer that does not read before the connection is closed."""


def zenoh_config(
    *,
    mode: str = "peer",
    listen: Sequence[str] = (),
    connect: Sequence[str] = (),
    users: tuple[str, str, str] | None = None,
) -> zenoh.Config:
    """Settings of a session that finds nobody by itself and notices a silent peer within a second.

    ``users`` is our own user, its password, and the path of a file with a line ``user:password`` for
    each who may connect. Raises Unavailable where an endpoint is not one.
    """
    settings: dict[str, object] = {
        "mode": mode,
        "listen/endpoints": list(listen),
        "connect/endpoints": list(connect),
        # A peer goes on trying by itself; this makes a client do so too.
        "connect/timeout_ms": -1,
        "connect/exit_on_failure": False,
        "connect/retry": {"period_init_ms": 100, "period_max_ms": 1000, "period_increase_factor": 2},
        "scouting/multicast/enabled": False,
        "scouting/gossip/enabled": False,
        "timestamping/enabled": True,
        "transport/link/tx/lease": _LEASE_MS,
        "transport/link/tx/queue/congestion_control/block/wait_before_close": _STALLED_US,
        "transport/shared_memory/enabled": False,
    }
    if users:
        user, password, file = users
        settings["transport/auth/usrpwd/user"] = user
        settings["transport/auth/usrpwd/password"] = password
        settings["transport/auth/usrpwd/dictionary_file"] = file
    config = zenoh.Config()
    for key, value in settings.items():
        try:
            config.insert_json5(key, json.dumps(value))
        except zenoh.ZError as error:
            raise Unavailable(f"zenoh does not take {key} = {value!r}: {sentence(error)}") from None
    return config
