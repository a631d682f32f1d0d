"""The plant under zenoh keys, for everybody: ``docs/reference/zenoh.md``."""

from bridge.northbound.zenoh.session import ZenohServer

__all__ = ["ZenohServer"]
