"""Connections that OPC UA has, and how long each step to a session may take."""

from __future__ import annotations

from typing import Final

from bridge.base.admission import ConnectionStage, Deadline, Limits
from bridge.uaserver.subscriptions.quotas import MOST_SESSIONS, MOST_SESSIONS_OF_ADDRESS

_SPARE: Final = 1
"""Connections beside those with a session, for a client to come back to its session on (Part 4 §5.5.2)."""
MOST_CONNECTIONS: Final = MOST_SESSIONS + _SPARE
MOST_OF_ADDRESS: Final = MOST_SESSIONS_OF_ADDRESS + _SPARE
MOST_WAITING: Final = 25
"""Connections of one address that have no session yet."""
MOST_HELD: Final = 64 * 1024 * 1024
"""Bytes of messages and answers, of all connections together."""
KEPT: Final = 1 + _SPARE
"""Connections, of all and of an address, that only who has the highest role can keep: sessions that read must
not keep out the one who stops, who needs one of them. The spare connection has no session of its own."""
DEADLINE_S: Final = {
    ConnectionStage.CONNECTED: 5.0,
    ConnectionStage.GREETED: 10.0,
    ConnectionStage.CHANNEL: 30.0,
}
"""Seconds after connecting, or after the end of its last session."""
_MISSING: Final = {
    ConnectionStage.CONNECTED: "hello",
    ConnectionStage.GREETED: "channel",
    ConnectionStage.CHANNEL: "session",
}


def limits(top_rank: int = 1) -> Limits:
    """Limits of one server, none of whose users has a higher rank than ``top_rank``."""
    return Limits(
        MOST_CONNECTIONS,
        MOST_OF_ADDRESS,
        MOST_WAITING,
        deadlines={stage: Deadline(DEADLINE_S[stage], missing) for stage, missing in _MISSING.items()},
        held_bytes=MOST_HELD,
        kept=KEPT,
        top_rank=top_rank,
    )
