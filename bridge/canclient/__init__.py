"""The python-can interface ``drivebridge``: scripts for python-canopen reach a bus through a running bridge."""

from bridge.canclient.bus import DrivebridgeBus as DrivebridgeBus
