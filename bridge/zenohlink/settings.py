"""Settings of our zenoh sessions."""

# pyright: reportUnknownMemberType=false
# zenoh's stubs leave out the return types of what returns nothing.

from __future__ import annotations

import json
from collections.abc import Mapping, Sequence
from typing import Final

import zenoh

from bridge.errors import Unavailable
from bridge.zenohlink.message import sentence

_LEASE_MS: Final = 1000
"""A peer that falls silent is noticed within this time, and one that does not come to a session in it is
closed; zenoh's default is 10 s for both."""
_MOST_PENDING: Final = 500
"""Connections without a session. zenoh closes what comes on top: with the 100 of its default a hundred that
say nothing lock everybody out. Each is a file of the bus process, which often has no more than 1024."""
_STALLED_US: Final = 500_000
"""How long a query or a reply waits for a peer that does not read before the connection is closed."""
_STALLED_AMONG_OTHERS_US: Final = 100_000
"""The same where others must not notice: inside zenoh they do, now and then."""

_WAIT: Final = "transport/link/tx/queue/congestion_control/block/wait_before_close"
_MOST_BATCHES: Final = 16
"""Of 64 KiB, made when they are needed. With the two of zenoh's default an answer would be dropped when the
machine is busy for a moment."""


def zenoh_config(
    *,
    mode: str = "peer",
    listen: Sequence[str] = (),
    connect: Sequence[str] = (),
    users: tuple[str, str, str] | None = None,
    access: Mapping[str, object] | None = None,
    prompt: Sequence[str] = (),
    waiting: Sequence[str] = (),
) -> zenoh.Config:
    """Settings of a session that finds nobody by itself and notices a silent peer within a second.

    ``users`` is our own user, its password, and the path of a file with a line ``user:password`` for
    each who may connect. ``access`` is zenoh's ``access_control``.

    With ``prompt``, answers are dropped where the asker does not read. On the keys of ``prompt`` they go
    ahead of published values. On those of ``waiting`` that are not among ``prompt``, they wait for the asker
    instead.

    Raises Unavailable where an endpoint is not one.
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
        "transport/unicast/accept_timeout": _LEASE_MS,
        "transport/unicast/accept_pending": _MOST_PENDING,
        _WAIT: _STALLED_US,
        "transport/shared_memory/enabled": False,
    }
    if access:
        settings["access_control"] = access
    if prompt:
        settings["qos/network"] = _replies(prompt, waiting)
        settings[_WAIT] = _STALLED_AMONG_OTHERS_US
        settings["transport/link/tx/queue/size/interactive_high"] = _MOST_BATCHES
        settings["transport/link/tx/queue/size/background"] = _MOST_BATCHES
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


def _replies(prompt: Sequence[str], waiting: Sequence[str]) -> list[dict[str, object]]:
    """Replies, and the end of them, have what their query has: so it is changed as it comes in, by each of
    these after the other. Each kind has a queue, and with it a lock, of its own: what may be dropped would
    else wait for what waits. zenoh ends a query that is for nobody on a thread that reads for all
    connections."""
    rules: tuple[tuple[Sequence[str], str, str], ...] = (
        (("**", "*/**/@/**"), "drop", "background"),
        (waiting, "block", "data_low"),
        (prompt, "drop", "interactive_high"),
    )
    return [
        {
            "messages": ["query"],
            "flows": ["ingress"],
            "key_exprs": list(keys),
            "overwrite": {"congestion_control": control, "priority": priority},
        }
        for keys, control, priority in rules
    ]
