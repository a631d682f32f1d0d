"""Passwords as Argon2id hashes: what is right, what is no hash, and users of the site file."""

from __future__ import annotations

import pytest
from argon2 import PasswordHasher

from bridge.base.errors import FileFaults
from bridge.config import UserTable
from bridge.northbound import passwords
from bridge.northbound.passwords import check_users, hash_password, is_password_hash, verify_password


@pytest.fixture(autouse=True)
def quick(monkeypatch: pytest.MonkeyPatch) -> None:
    """Argon2id as ever, with less work."""
    monkeypatch.setattr(passwords, "_HASHER", PasswordHasher(time_cost=1, memory_cost=8, parallelism=1))
    passwords._nobody.cache_clear()


def test_a_password_is_right_with_its_own_hash_alone() -> None:
    line = hash_password("Förderband 7")
    assert line.startswith("$argon2id$")
    assert verify_password(line, "Förderband 7")
    assert not verify_password(line, "förderband 7")
    assert line != hash_password("Förderband 7"), "each has its own salt"


def test_a_user_that_does_not_exist_has_no_password_not_even_nobodys() -> None:
    assert not verify_password(None, "nobody")
    assert not verify_password(None, "")


@pytest.mark.parametrize("line", ["", "plain", "$argon2id$v=19$broken", "$2b$12$abc"])
def test_what_is_no_hash_lets_nobody_in(line: str) -> None:
    assert not is_password_hash(line)
    assert not verify_password(line, line)


def user(name: str, line: str) -> UserTable:
    return UserTable.model_construct(name=name, password_hash=line, role="operator")


def test_users_of_the_site_file_are_there_once_and_have_hashes() -> None:
    line = hash_password("x")
    assert is_password_hash(line)
    check_users([user("ann", line), user("bob", line)])
    with pytest.raises(FileFaults) as caught:
        check_users([user("ann", line), user("ann", line), user("anonymous", line), user("eve", "secret")])
    assert [(fault.key, fault.message) for fault in caught.value.faults] == [
        ("opcua.user[1].name", "the name 'ann' is taken"),
        ("opcua.user[2].name", "the name 'anonymous' is taken"),
        ("opcua.user[3].password_hash", "is not an Argon2 hash"),
    ]
    assert "secret" not in str(caught.value)
