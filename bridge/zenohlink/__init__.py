"""A zenoh session that never blocks the event loop.

A zenoh call may block for seconds (a peer that does not read, a session that closes), so one worker thread
makes all calls and gets them through a queue. zenoh delivers on threads of its own; what arrives is passed to
the loop in small portions. Every error of zenoh ends here: it is counted and logged.

It knows no key layout: both the zenoh server and the link between our processes use it.
"""

from bridge.zenohlink.incoming_query import IncomingQuery
from bridge.zenohlink.link import ZenohLink
from bridge.zenohlink.message import GetReply, Sample
from bridge.zenohlink.pace import Pace
from bridge.zenohlink.publishers import Value
from bridge.zenohlink.zenoh_config import zenoh_config

__all__ = ["GetReply", "IncomingQuery", "Pace", "Sample", "Value", "ZenohLink", "zenoh_config"]
