"""Connections: who is let in, their channels, and their messages."""
