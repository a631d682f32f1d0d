"""CANopen (CiA 301, 302, 305) without I/O: bytes and a time in, frames and events out.

A library of its own: it imports nothing of the bridge.
"""
