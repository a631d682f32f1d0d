"""Object dictionary of a bus interface SK xU4-CAO (BU 2500 §6.7, §7.1)."""

from __future__ import annotations

from bridge.sim.nord.nord_interface import KINDS, identity


def test_no_number_is_invented():
    made = identity("SK TU4-CAO")
    assert (made.vendor_id, made.product_code, made.revision, made.serial) == (0, 0, 0, 0)
    assert made.device_type == 0x0001_0192


def test_it_says_what_it_is(make_bench):
    for place, kind in enumerate(KINDS):
        bench = make_bench(kind=kind)
        assert bytes.fromhex(bench.sdo("40 08 10 00 00 00 00 00"))[0] & 0xE0 == 0x40
        assert bench.read(0x2000 + 172, 1) == place
        assert [bench.read(0x2000 + 171, sub) for sub in (1, 2, 3)] == [12, 0, 0]


def test_each_channel_reaches_its_drive(make_bench):
    bench = make_bench()
    for element in (3, 4, 5):
        assert bench.write(0x2000 + 160, element, 3, 2) == "60"
    for place, drive in enumerate(bench.node.drives):
        drive.parameters.commission(105, 50.0 + place)
    channels = ((0x605, 0x585), (0x345, 0x2C5), (0x445, 0x3C5), (0x545, 0x4C5))
    answers = [bytes.fromhex(bench.sdo("40 69 20 01 00 00 00 00", *channel)) for channel in channels]
    assert [int.from_bytes(answer[4:6], "little") for answer in answers] == [500, 510, 520, 530]
