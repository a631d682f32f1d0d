"""Mutants of the program, and whether the unit tests notice them."""
