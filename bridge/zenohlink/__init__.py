"""A zenoh session that never blocks the event loop.

A zenoh call may wait for seconds (a peer that does not read, a session that closes), so every call is
made by one worker thread and handed to it by a queue. What zenoh brings comes on threads of its own and
is handed to the loop in small portions. Whatever zenoh raises ends here: it is counted and logged.

Bound to no layout of keys: the zenoh protocol for everybody and the link between our processes both use
it.
"""

from bridge.zenohlink.link import Asked, ZenohLink
from bridge.zenohlink.message import Answer, Message
from bridge.zenohlink.settings import zenoh_config

__all__ = ["Answer", "Asked", "Message", "ZenohLink", "zenoh_config"]
