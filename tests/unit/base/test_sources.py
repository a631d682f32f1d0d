"""Sources of connections: to whom a limit for one address applies."""

from __future__ import annotations

import pytest
from hypothesis import given
from hypothesis import strategies as st

from bridge.base.sources import source_of


@pytest.mark.parametrize(
    ("host", "source"),
    [
        ("192.168.1.10", "192.168.1.10"),
        ("::ffff:192.168.1.10", "192.168.1.10"),
        ("::1", "::1"),
        ("2001:db8:1:2:3:4:5:6", "2001:db8:1:2::/64"),
        ("2001:db8:1:2::1", "2001:db8:1:2::/64"),
        ("fe80::1%eth0", "fe80::/64"),
        ("plc.local", "plc.local"),
        ("", ""),
    ],
)
def test_who_a_host_is(host: str, source: str) -> None:
    """RFC 4291 §2.5.1: 64 bits of an IPv6 address name the interface, which a machine may choose itself."""
    assert source_of(host) == source


@given(st.ip_addresses(v=6), st.integers(0, 2**64 - 1))
def test_a_machine_is_the_same_whatever_the_lower_half_of_its_address(address: object, low: int) -> None:
    number = int(address) >> 64 << 64  # type: ignore[call-overload]
    if number >> 64:
        one, other = (str(type(address)(number + part)) for part in (0, low))  # type: ignore[call-arg]
        assert source_of(one) == source_of(other)


@given(st.text(max_size=30))
def test_no_host_raises(host: str) -> None:
    assert isinstance(source_of(host), str)
