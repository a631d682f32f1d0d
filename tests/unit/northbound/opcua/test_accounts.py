"""Users of the site file, their passwords and roles."""

from __future__ import annotations

import pytest
from asyncua import ua
from asyncua.common.utils import ServiceError

from bridge.base.errors import FileFaults
from bridge.command import Role
from bridge.config import OpcUaTable, UserTable
from bridge.northbound.opcua.accounts import Accounts, security_policies
from bridge.northbound.passwords import hash_password, verify_password

Policy = ua.SecurityPolicyType


class TestPasswords:
    def test_a_hash_is_not_the_password_and_never_the_same(self) -> None:
        first, second = hash_password("swordfish"), hash_password("swordfish")
        assert first.startswith("$argon2id$")
        assert first != second
        assert "swordfish" not in first

    @pytest.mark.landing
    def test_only_the_right_password_is_right(self) -> None:
        line = hash_password("swordfish")
        assert verify_password(line, "swordfish")
        assert not verify_password(line, "Swordfish")
        assert not verify_password(line, "")
        assert not verify_password("nonsense", "swordfish")
        assert not verify_password(None, "nobody")

    @pytest.mark.landing
    async def test_a_user_has_the_role_of_the_site_file(self) -> None:
        line = hash_password("swordfish")
        users = Accounts(OpcUaTable(user=[UserTable(name="eva", role="engineer", password_hash=line)]))
        assert (await users.login("eva", "swordfish", "10.0.0.1")).role is Role.ENGINEER
        for name, password in (("eva", "x"), ("admin", "swordfish"), ("eva", "x" * 100_000)):
            with pytest.raises(ServiceError):
                await users.login(name, password, "10.0.0.1")
        users.close()

    @pytest.mark.parametrize(("setting", "role"), [("observer", Role.OBSERVER), ("operator", Role.OPERATOR)])
    def test_anonymous_is_what_the_site_file_says(self, setting: str, role: Role) -> None:
        users = Accounts(OpcUaTable.model_validate({"anonymous": setting}))
        assert users.anonymous("10.0.0.1").role is role
        assert ua.AnonymousIdentityToken in users.tokens
        with pytest.raises(ServiceError):
            Accounts(OpcUaTable()).anonymous("10.0.0.1")

    def test_all_faulty_users_are_named_at_once(self) -> None:
        line = hash_password("x")
        tables = [
            UserTable(name="anna", role="operator", password_hash=line),
            UserTable(name="anna", role="observer", password_hash="swordfish"),
            UserTable(name="anonymous", role="observer", password_hash=line),
        ]
        with pytest.raises(FileFaults) as raised:
            Accounts(OpcUaTable(user=tables))
        assert [fault.key for fault in raised.value.faults] == [
            "opcua.user[1].name",
            "opcua.user[1].password_hash",
            "opcua.user[2].name",
        ]


def test_an_open_endpoint_is_there_only_where_the_site_file_says_so() -> None:
    assert Policy.NoSecurity not in security_policies(OpcUaTable())
    assert Policy.NoSecurity in security_policies(OpcUaTable(no_security=True))
    assert all("SignAndEncrypt" in policy.name for policy in security_policies(OpcUaTable()))
