"""Factory settings of nodes with one SK 5xxE (BU 2500 §6.5.7)."""

from __future__ import annotations

import pytest

from bridge.sim.nord.nord_single_settings import RJ45_5XX, RJ45_54X, TU3, Variant, factory_settings


@pytest.mark.parametrize("variant", [TU3, RJ45_5XX, RJ45_54X], ids=lambda one: one.device_name)
def test_the_pdos_are_those_of_the_variant(variant: Variant) -> None:
    made = factory_settings(5, variant)
    assert [pdo.cob_id - 5 for pdo in made.rpdo] == [view.cob_id for view in variant.rpdo]
    assert [pdo.mapping for pdo in made.tpdo] == [list(view.entries) for view in variant.tpdo]
    assert all(pdo.mapped_bits <= 64 for pdo in (*made.rpdo, *made.tpdo))
    assert len(made.sdo) == 1


def test_of_an_interface_one_answer_is_on() -> None:
    assert [pdo.enabled for pdo in factory_settings(5, TU3).tpdo] == [True, False, False, False]
    assert all(pdo.enabled for pdo in factory_settings(5, RJ45_54X).tpdo)
