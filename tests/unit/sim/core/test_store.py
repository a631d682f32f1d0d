"""Settings and their non-volatile memory."""

from __future__ import annotations

from bridge.sim.core.store import Store


def store() -> Store[list[int]]:
    return Store(lambda: [1, 2])


def test_what_is_not_saved_is_gone_with_the_power() -> None:
    made = store()
    made.current.append(3)
    made.power_on()
    assert made.current == [1, 2]


def test_what_is_saved_comes_back_as_it_was_then() -> None:
    made = store()
    made.current.append(3)
    made.save()
    made.current.append(4)
    made.power_on()
    assert made.current == [1, 2, 3]
    made.current.append(5)
    made.power_on()
    assert made.current == [1, 2, 3], "the memory is no part of what is used"


def test_load_takes_effect_with_the_power_and_factory_settings_at_once() -> None:
    made = store()
    made.current.append(3)
    made.save()
    made.forget()
    assert made.current == [1, 2, 3]
    made.power_on()
    assert made.current == [1, 2]
    made.current.append(7)
    made.save()
    made.to_factory()
    assert made.current == [1, 2]
    made.power_on()
    assert made.current == [1, 2, 7]
