"""Settings of our zenoh sessions."""

# pyright: reportUnknownMemberType=false
# zenoh's stubs leave out the return types of what returns nothing.

from __future__ import annotations

import json
from collections.abc import Mapping, Sequence
from typing import Final

import zenoh

from bridge.base.errors import Unavailable
from bridge.zenohlink.message import sentence

LEASE_MS: Final = 1000
"""A peer that falls silent is noticed within this time, where nothing else is said, and a connection that
does not become a session in it is closed; zenoh's default is 10 s for both."""
_MOST_PENDING: Final = 500
"""Connections that are not a session yet; zenoh closes further ones. With its default of 100, a hundred
silent connections lock everybody out. Each uses a file descriptor of the bus process, which often has no more
than 1024."""
_STALLED_US: Final = 500_000
"""Time for which a query or reply waits for a peer that does not read; then the connection is closed."""
_STALLED_AMONG_OTHERS_US: Final = 100_000
"""The same where others must not be delayed: inside zenoh they sometimes are."""

_WAIT: Final = "transport/link/tx/queue/congestion_control/block/wait_before_close"
_MOST_BATCHES: Final = 16
"""Buffers for what waits to be sent, allocated when needed. With zenoh's default of two, an answer or
a value would be dropped whenever the machine is busy for a moment."""

_ALWAYS: Final[Mapping[str, object]] = {
    # A peer keeps trying by itself; this makes a client do so, too.
    "connect/timeout_ms": -1,
    "connect/exit_on_failure": False,
    "connect/retry": {"period_init_ms": 100, "period_max_ms": 1000, "period_increase_factor": 2},
    "scouting/multicast/enabled": False,
    "scouting/gossip/enabled": False,
    "timestamping/enabled": True,
    "transport/unicast/accept_timeout": LEASE_MS,
    "transport/unicast/accept_pending": _MOST_PENDING,
    _WAIT: _STALLED_US,
    "transport/shared_memory/enabled": False,
    "transport/link/tx/queue/size/data": _MOST_BATCHES,
}


def zenoh_config(
    *,
    mode: str = "peer",
    listen: Sequence[str] = (),
    connect: Sequence[str] = (),
    users: tuple[str, str, str] | None = None,
    access: Mapping[str, object] | None = None,
    prompt: Sequence[str] = (),
    waiting: Sequence[str] = (),
    longest: int | None = None,
    lease_ms: int = LEASE_MS,
) -> zenoh.Config:
    """Settings of a session without discovery that ends the connection to a peer which is silent for
    ``lease_ms``.

    ``users`` is our own user, its password, and the path of a file with a line ``user:password`` for each
    user. ``access`` is zenoh's ``access_control``.

    With ``prompt``, answers are dropped if the client does not read. On the keys of ``prompt`` they go ahead
    of published values. On keys of ``waiting`` that are not in ``prompt``, they wait for the client instead.

    Nothing of more than ``longest`` bytes is taken from others, keys included: zenoh walks a tree of the
    words of each key by calling itself, and ends the process with one of many thousand. It is also the size
    of the buffers in which answers and values wait.

    Raises Unavailable if an endpoint is not valid.
    """
    settings: dict[str, object] = {
        **_ALWAYS,
        "mode": mode,
        "listen/endpoints": list(listen),
        "connect/endpoints": list(connect),
        "transport/link/tx/lease": lease_ms,
    }
    if access:
        settings["access_control"] = access
    if prompt:
        settings["qos/network"] = _replies(prompt, waiting)
        settings[_WAIT] = _STALLED_AMONG_OTHERS_US
        settings["transport/link/tx/queue/size/interactive_high"] = _MOST_BATCHES
        settings["transport/link/tx/queue/size/background"] = _MOST_BATCHES
    if longest:
        # Both ends take the smaller of their sizes of a batch, and end a connection that brings a larger one;
        # what needs several batches is put together up to the second of these.
        settings["transport/link/tx/batch_size"] = longest
        settings["transport/link/rx/max_message_size"] = longest
    if users:
        user, password, file = users
        settings["transport/auth/usrpwd/user"] = user
        settings["transport/auth/usrpwd/password"] = password
        settings["transport/auth/usrpwd/dictionary_file"] = file
    return _config_of(settings)


def _config_of(settings: Mapping[str, object]) -> zenoh.Config:
    """Raises Unavailable for a setting that zenoh does not take."""
    config = zenoh.Config()
    for key, value in settings.items():
        try:
            config.insert_json5(key, json.dumps(value))
        except zenoh.ZError as error:
            raise Unavailable(f"zenoh does not take {key} = {value!r}: {sentence(error)}") from None
    return config


def _replies(prompt: Sequence[str], waiting: Sequence[str]) -> list[dict[str, object]]:
    """Replies and their end inherit priority and congestion control from their query, so the query is changed
    as it comes in, by each of these in turn. Each kind has a queue, and thus a lock, of its own: otherwise
    droppable replies would wait behind those that wait. zenoh ends a query that nobody answers on a thread
    that reads for all connections."""
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
