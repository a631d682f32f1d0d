"""OPC UA: a pure layout of the points (``nodes``), served by ``bridge.uaserver``, which knows no points.

Nothing is imported here: `drivebridge hash-password` must not wait for asyncua.
"""
