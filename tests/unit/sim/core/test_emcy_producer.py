"""Emergency messages and the list of errors."""

from __future__ import annotations

from bridge.sim.core.communication_settings import CobId, CommunicationSettings, SlaveRules
from bridge.sim.core.emcy_producer import EmcyProducer
from bridge.sim.core.store import Store


def producer(**settings: int) -> EmcyProducer:
    made = Store(lambda: CommunicationSettings(emcy=CobId(0x85), sdo=[], **settings))
    return EmcyProducer(made, SlaveRules(error_entries=2))


def test_an_error_is_sent_and_remembered_the_newest_first() -> None:
    emcy = producer()
    emcy.report(0x2310, 3, b"\x1e")
    emcy.report(0x8130, 0x11)
    assert emcy.due(1.0) == [bytes.fromhex("1023031E00000000"), bytes.fromhex("3081110000000000")]
    assert emcy.history == [0x8130, 0x1E_2310]
    emcy.report(0x5000, 1)
    assert emcy.history == [0x5000, 0x8130], "no more than it has entries"
    assert emcy.error_register == 1


def test_that_it_is_gone_is_sent_and_no_error() -> None:
    emcy = producer()
    emcy.report(0, 0)
    assert emcy.due(1.0) == [bytes(8)]
    assert emcy.history == []


def test_the_inhibit_time_lies_between_two() -> None:
    emcy = producer(emcy_inhibit=1000)  # in 100 µs
    for code in (0x1000, 0x2000):
        emcy.report(code, 1)
    assert len(emcy.due(1.0)) == 1
    assert emcy.next_deadline() == 1.1
    assert emcy.due(1.09) == []
    assert len(emcy.due(1.1)) == 1
    assert emcy.next_deadline() is None


def test_switched_off_it_remembers_without_sending() -> None:
    emcy = producer()
    emcy._store.current.emcy.enabled = False
    emcy.report(0x1000, 1)
    assert (emcy.due(1.0), emcy.history) == ([], [0x1000])
