"""The python-can interface ``drivebridge``: python-canopen reaches a bus through a running bridge."""

from bridge.canclient.bus import DrivebridgeBus as DrivebridgeBus
