"""Simulated drives that speak real frames: the independent witness against which the master is tested.

Nothing here is shared with the master but the frame and the bus interface.
"""
