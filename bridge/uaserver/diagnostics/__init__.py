"""Diagnostics of the server, its sessions and its subscriptions (OPC 10000-5 §6.3)."""
