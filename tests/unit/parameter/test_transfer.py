"""Transfers of parameters: a read of the drive's own channel, unless it says otherwise."""

from __future__ import annotations

from dataclasses import FrozenInstanceError

import pytest

from bridge.mapping.model import ObjectRef
from bridge.parameter.transfer import Transfer

PLACE = ObjectRef(0x2066, 1)


def test_a_transfer_reads_over_the_drives_channel_and_asks_nobody() -> None:
    transfer = Transfer(PLACE)
    assert (transfer.data, transfer.of_node, transfer.why_not) == (None, False, None)
    with pytest.raises(FrozenInstanceError):
        setattr(transfer, "data", b"")  # noqa: B010


def test_an_empty_write_is_no_read() -> None:
    assert Transfer(PLACE, b"") != Transfer(PLACE)
