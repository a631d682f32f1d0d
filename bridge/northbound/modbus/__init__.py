"""Modbus TCP: each drive is a unit, the bridge itself is unit 255 (and 0).

``registers`` is the layout; ``unit``, ``drive_unit`` and ``device_unit`` read and plan writes; ``pdu`` and
the ``Conversation`` of ``connection`` are the protocol without a socket, ``ModbusConnection`` and ``server``
the thin part on the event loop.
"""
