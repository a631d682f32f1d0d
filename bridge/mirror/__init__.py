"""The image and the events of the bus process in other processes, and their requests back to it.

Runs over a zenoh session of its own on a Unix socket in the runtime folder. The folder's mode is the
protection: whoever may open the socket is trusted with the identities of its clients.
"""

from bridge.mirror.client import MirrorClient, PointsChanged
from bridge.mirror.endpoint import socket_endpoint
from bridge.mirror.publisher import MirrorPublisher

__all__ = ["MirrorClient", "MirrorPublisher", "PointsChanged", "socket_endpoint"]
