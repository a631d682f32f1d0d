"""A witness of the dead-man chain: sees what is said on the bus and judges it by rules of its own.

Whoever watches the bridge must not err together with it. So nothing in here is taken from the bridge but the
model of the site file (``bridge.config``): how a frame is read, what a control word means, when a drive has
to stand is written here a second time, from the manuals and from ``docs/explanation/dead-man-chain.md``.
"""
