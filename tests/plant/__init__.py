"""Whole plants on one seeded clock: ``make plant``."""
