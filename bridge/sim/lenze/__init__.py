"""The Lenze 8400 motec."""
