"""Certificates: the server's own, those of its clients, and how both are changed while it runs."""
