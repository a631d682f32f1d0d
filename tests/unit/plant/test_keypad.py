"""What somebody sets at a drive changes what it does, or what its words say, as its manual has it."""

from __future__ import annotations

from typing import Any

import pytest

from bridge.sim.catalogue import simulate_node
from tests.plant.field import FieldNode
from tests.plant.keypad import CHANGES, HOIST_CHANGES, Setting, nord_drive, set_at_keypad
from tests.plant.physics import Physics, physics_of, posicon_of
from tests.plant.plan import HOIST, KEYPAD
from tests.plant.wire import Wire
from tests.plant.world import World
from tests.proof.drives import ALL, Drive
from tests.proof.families import CIA402, NORD, Family

FAMILIES = list(CHANGES)


def node_of(mapping: str, node_id: int, parameters: dict[str, float]) -> FieldNode:
    world = World()
    nobody: Any = None
    node = FieldNode(
        world, Wire(world, "can0", 1_000_000, nobody), simulate_node(mapping, node_id, parameters)
    )
    node.power_on()
    world.run_until(world.now + 2.0)
    return node


def made(family: Family) -> tuple[FieldNode, Drive]:
    drive = next(one for one in ALL if one.family is family)
    node = node_of(family.mapping, drive.node_id, {})
    if family is CIA402:
        # As the boot-up has it.
        node.device.dictionary.find(0x6060, 0).download(b"\x02")
    return node, drive


def after(node: FieldNode, physics: Physics, slot: str, setting: Setting) -> dict[str, float]:
    """Settings that differ, and their values, when it was set."""
    before = physics.settings()
    set_at_keypad(node, nord_drive(node.device, slot), setting, setting.value)
    now = physics.settings()
    set_at_keypad(node, nord_drive(node.device, slot), setting, setting.usual)
    assert physics.settings() == before, "it is set back"
    return {name: value for name, value in now.items() if value != before[name]}


def test_each_change_that_a_plan_draws_is_one() -> None:
    assert set(KEYPAD) == {how for changes in CHANGES.values() for how in changes}
    assert set(HOIST) == set(HOIST_CHANGES)


@pytest.mark.parametrize(
    ("family", "how"),
    [(family, how) for family in FAMILIES for how in CHANGES[family] if how != "other set"],
    ids=lambda one: one.name if isinstance(one, Family) else str(one),
)
def test_a_change_is_one_of_a_setting_that_decides_a_value(family: Family, how: str) -> None:
    node, drive = made(family)
    physics = physics_of(node.device, drive)
    changed = after(node, physics, drive.slot, CHANGES[family][how])
    assert len(changed) == 1
    assert set(changed) <= {physics.key(name) for leaf in physics.leaves for name in leaf.by}


@pytest.mark.parametrize("how", sorted(HOIST_CHANGES))
def test_so_it_is_where_one_positions(how: str) -> None:
    node = node_of("nord/sk-tu3-cao-pdo3", 45, {"P600": 2.0})
    physics = posicon_of(node.device)
    changed = after(node, physics, "", HOIST_CHANGES[how])
    assert len(changed) == 1
    assert set(changed) <= {physics.key(name) for leaf in physics.leaves for name in leaf.by}


def test_what_a_value_is_comes_from_the_motor_and_not_from_its_words() -> None:
    node, drive = made(NORD)
    inverter = nord_drive(node.device, drive.slot)
    assert inverter is not None
    inverter.output_hz = 12.5
    physics = physics_of(node.device, drive)
    set_at_keypad(node, inverter, CHANGES[NORD]["scale"], 1000)
    inverter.output_hz = 12.5
    assert physics.values()[0] == 12.5
    set_at_keypad(node, inverter, CHANGES[NORD]["meaning"], 3)
    assert physics.values()[0] is None, "no word carries it"


def test_in_another_parameter_set_other_settings_count() -> None:
    node, drive = made(NORD)
    inverter = nord_drive(node.device, drive.slot)
    assert inverter is not None
    physics = physics_of(node.device, drive)
    assert physics.key("P105") == "P105 of parameter set 1"
    changed = after(node, physics, drive.slot, CHANGES[NORD]["other set"])
    assert changed == {"P105 of parameter set 2": 100.0}
    inverter.control_word = 0x447E
    assert physics.key("P105") == "P105 of parameter set 2"
