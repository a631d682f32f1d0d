"""The plant under zenoh keys, for everybody."""

from bridge.northbound.zenoh.server import ZenohServer

__all__ = ["ZenohServer"]
