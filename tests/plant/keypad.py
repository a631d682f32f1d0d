"""What somebody sets at a drive itself, by its keypad or with its maker's tool: no bus sees it. And what
becomes of the answers to those who ask."""

from __future__ import annotations

from typing import TYPE_CHECKING, Final, NamedTuple

from bridge.command import Identity, Outcome, ReadParameter, Request, Source
from bridge.sim.core.simulated_device import SimulatedDevice
from bridge.sim.nord.nord_drive import NordDrive
from bridge.sim.nord.nord_single import NordSingle
from bridge.sim.nord.nord_tu4 import NordTu4
from tests.plant.field import FieldNode
from tests.plant.physics import physics_of
from tests.plant.plan import Step
from tests.proof.drives import DRIVES
from tests.proof.families import CIA402, LENZE, NORD, STOEBER, Family

if TYPE_CHECKING:
    from tests.plant.plant import Plant


class Setting(NamedTuple):
    """A parameter by its number and element, or an object by its index and sub-index; its value as it is
    transferred, and the one that it has at commissioning."""

    number: int
    element: int
    value: int
    usual: int
    size: int = 2
    in_set: int = 1


Changes = dict[str, Setting]
CHANGES: Final[dict[Family, Changes]] = {
    # BU 2500 §6.5.4: P105 100 Hz, P112 5 A, P543[1] current, P546[1] no frequency, P546[2] a second one.
    NORD: {
        "scale": Setting(105, 1, 1000, 500),
        "current": Setting(112, 1, 50, 100),
        "meaning": Setting(543, 1, 3, 1),
        "setpoint": Setting(546, 1, 2, 1),
        "sum": Setting(546, 2, 1, 0),
        "other set": Setting(105, 1, 1000, 500, in_set=2),
    },
    # EDS84DMOTCAN §9.2: index = 5FFFh − code. C00011, and C00007 "terminals".
    LENZE: {
        "scale": Setting(0x5FFF - 11, 0, 3000, 1500),
        "meaning": Setting(0x5FFF - 7, 0, 10, 40),
    },
    STOEBER: {"scale": Setting(0x2401, 0, 6000, 3000)},  # C01
    # 604Ch: two 1/min a step; 6060h: profile velocity.
    CIA402: {
        "scale": Setting(0x604C, 1, 2, 1, size=4),
        "meaning": Setting(0x6060, 0, 3, 2, size=1),
    },
}
_READ: Final = {
    NORD: ("P105", "P105 of parameter set 1"),
    LENZE: ("C00011", "C00011"),
    STOEBER: ("C01", "C01"),
    CIA402: ("604C:01", "604C:01"),
}
"""A parameter of each family that somebody reads, and how the settings call it."""
_READER: Final = Identity(Source.ZENOH, "a colleague", connection="session 46")
_EACH_S, _DELAY_S, _SHORT_S = 1.5, 0.002, 0.5
HOIST_CHANGES: Final[Changes] = {
    "P600": Setting(600, 1, 0, 2),
    "P546": Setting(546, 1, 4, 23),
    "gear": Setting(607, 3, 5, 1),
    "encoder": Setting(604, 1, 1, 0),
}


def set_at_keypad(node: FieldNode, drive: NordDrive | None, setting: Setting, value: int) -> None:
    """``drive`` is the NORD drive, of those of its node."""

    def act() -> None:
        if drive is not None:
            drive.parameters.at_keypad(
                setting.number, value, element=setting.element, parameter_set=setting.in_set
            )
            return
        entry = node.device.dictionary.find(setting.number, setting.element)
        entry.download(value.to_bytes(setting.size, "little"))

    node.change(act)


def nord_drive(device: SimulatedDevice, slot: str) -> NordDrive | None:
    """That drive of a NORD node; None where it is another maker's."""
    if isinstance(device, NordTu4):
        return device.drives[int(slot[-1]) - 1]
    return device.drive if isinstance(device, NordSingle) else None


def change(plant: Plant, step: Step) -> None:
    """Somebody sets a parameter at a drive, and sets it back after a while."""
    drive = DRIVES[step.which % len(DRIVES)]
    changes = CHANGES[drive.family]
    setting = changes.get(step.how, changes["scale"])
    node = plant.node_of(drive)
    inverter = nord_drive(node.device, drive.slot)
    set_at_keypad(node, inverter, setting, setting.value)
    plant.world.after(step.seconds, lambda: set_at_keypad(node, inverter, setting, setting.usual))


def run_in_other_set(plant: Plant, step: Step) -> None:
    """A controller runs its NORD drive in parameter set 2 for a while, in which somebody changes a setting
    (``how``) meanwhile."""
    drives = [drive for drive in DRIVES if drive.family is NORD]
    if not drives:
        return
    drive = drives[step.which % len(drives)]
    node, controller = plant.node_of(drive), plant.controllers[drive.place]
    inverter, changed = nord_drive(node.device, drive.slot), CHANGES[NORD].get(step.how)
    controller.in_set = 2

    def end() -> None:
        controller.in_set = 1

    plant.world.after(step.seconds, end)
    if changed is not None:
        setting = changed._replace(in_set=2)
        plant.world.after(step.seconds / 4, lambda: set_at_keypad(node, inverter, setting, setting.value))
        plant.world.after(step.seconds, lambda: set_at_keypad(node, inverter, setting, setting.usual))


def answer_otherwise(plant: Plant, step: Step) -> None:
    """The SDO answers of a node take their time, or are wrong, or there are none, and somebody reads a
    parameter of it again and again."""
    drive, world = DRIVES[step.which % len(DRIVES)], plant.world
    answers, ends = plant.node_of(drive).answers, world.now + step.seconds
    answers.how, answers.until = step.how, max(answers.until, ends)
    physics = physics_of(plant.node_of(drive).device, drive)
    name, key = _READ[drive.family]

    def read() -> None:
        if world.now < ends:
            had = physics.settings()[key]
            # One that is read just now may have been read for somebody else a moment ago.
            world.after(_SHORT_S, lambda: ask(had))
            world.after(_EACH_S, read)

    def ask(had: float) -> None:
        asked_at, is_same = world.now, physics.settings()[key] == had

        def answered(outcome: Outcome) -> None:
            # In a longer time it may have been another one, and be what it was again.
            if outcome.ok and is_same and world.now < asked_at + _SHORT_S:
                has = physics.settings()[key]
                plant.answers.parameter_read(drive, name, outcome.value, had, has, world.now)

        request = Request(_READER, drive.path, ReadParameter(name))
        plant.bridge.ask(request, _DELAY_S, lambda: None, answered)

    def end() -> None:
        if world.now >= answers.until:
            answers.how = ""

    world.after(_DELAY_S, read)
    world.after(step.seconds, end)
