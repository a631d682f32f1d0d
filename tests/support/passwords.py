"""Password hashes that are soon checked: the parameters are a part of the hash."""

from __future__ import annotations

from argon2 import PasswordHasher


def cheap_hash(password: str) -> str:
    return PasswordHasher(time_cost=1, memory_cost=8, parallelism=1).hash(password)
