"""Witness of the dead-man chain: it watches the bus and judges it by rules of its own.

What watches the bridge must not share its errors. So this package uses nothing of the bridge but the model of
the site file (``bridge.config``): how a frame is read, what a control word means, which outputs a PDO carries
and when a drive has to be stopped is written here a second time, from the manuals and from
``docs/explanation/dead-man-chain.md``.
"""
