"""Simulated drives that exchange real frames: an independent implementation against which the master is
tested.

They share only the frame type and the bus interface with the master.
"""
