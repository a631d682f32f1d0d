"""The plant under zenoh keys, for everybody."""

from bridge.northbound.zenoh.session import ZenohServer

__all__ = ["ZenohServer"]
