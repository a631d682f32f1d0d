"""Requests of clients: writes, methods and reads that go to the drives."""
