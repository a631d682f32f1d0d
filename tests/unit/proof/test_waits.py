"""The account of waiting: what lies between two moments, also over a restart."""

from __future__ import annotations

import os

from tests.proof.waits import Waits


def account(*seen: tuple[float, float]) -> Waits:
    waits = Waits(os.getpid())
    waits._seen.extend(seen)
    return waits


def test_what_was_waited_between_two_moments() -> None:
    waits = account((1.0, 0.1), (1.01, 0.1), (1.02, 0.11), (1.03, 0.12), (1.04, 0.2))
    assert round(waits.between(1.005, 1.03), 6) == 0.02
    assert waits.between(0.0, 0.9) == 0.0
    assert waits.between(1.021, 1.029) == 0.0


def test_a_new_process_has_not_waited_less_than_nothing() -> None:
    assert round(account((1.0, 5.0), (1.01, 0.0), (1.02, 0.03)).between(0.9, 1.1), 6) == 0.03


def test_the_kernel_tells_it_of_a_process() -> None:
    waits = Waits(os.getpid())
    waits.look(1.0)
    waits.look(2.0)
    assert len(waits._seen) == 2
    gone = Waits(2**22 + 1)
    gone.look(1.0)
    assert not gone._seen
