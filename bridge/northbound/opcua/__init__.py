"""OPC UA: a pure layout of the points (``nodes``) and a thin server on asyncua (``server``).

Nothing is imported here: `drivebridge hash-password` must not wait for asyncua.
"""
