"""Fuzzing that is guided by coverage: every codec and parser of strangers' bytes by itself."""
