"""Modbus TCP: each drive is a unit, the bridge itself is unit 255 (and 0).

``registers`` is the layout, ``unit`` and ``drive_unit`` read and plan writes, ``pdu`` and ``conversation``
are the protocol without a socket, ``connection`` and ``server`` the thin part on the event loop.
"""
