"""A node that positions beside the drives, and its owner, who are there for a while: a NORD SK TU3-CAO with
the settings of BU 2500 §5.4, some of which somebody changes at its keypad on the way."""

from __future__ import annotations

from typing import TYPE_CHECKING, Final

from bridge.command import Action, Identity, Request, Source, Write, command_of
from tests.plant.field import FieldNode
from tests.plant.keypad import HOIST_CHANGES, nord_drive, set_at_keypad
from tests.plant.plan import Step
from tests.proof.drives import DRIVES
from tests.proof.settings import PLANT

if TYPE_CHECKING:
    from tests.plant.plant import Plant

NODE: Final = "hoist"
NODE_ID: Final = 45
PATH: Final = f"{NODE}/drive"
TPDO: Final = 0x380 + NODE_ID
EVENT_MS: Final = 1000
AGE_S: Final = 1.8
_DELAY_S: Final = 0.002
_READY, _ACKNOWLEDGE, _RUN = 0x047E, 0x04FE, 0x047F
_BEGINS: Final = (_READY, _ACKNOWLEDGE, _READY, _RUN, _RUN, _RUN)
_25_HZ: Final = 0x2000
_PLACES: Final = (30_000, -20_000)
"""In increments, a thousandth of a revolution each."""
_EACH_S: Final = 8.0
_BOOT_S: Final = 3.0
_WAY_S: Final = _BOOT_S + 3.0
"""From its power-on to the change at the keypad."""
_ENDS_S: Final = 1.0
_WHO: Final = Identity(Source.ZENOH, "hoist's controller", connection="session 45")


def site() -> str:
    """Its table of the site file."""
    return f"""[[bus.node]]
name = "{NODE}"
id = {NODE_ID}
mapping = "nord/sk-tu3-cao-pdo3"
supervision = "heartbeat"
supervision_ms = {2 * PLANT.heartbeat_ms}
[[bus.node.drive]]
slot = "drive"
unit_id = {len(DRIVES) + 2}
control = "zenoh"
fieldbus_timeout_ms = {PLANT.fieldbus_timeout_ms}
tpdo = {{ event_ms = {EVENT_MS}, inhibit_ms = 100 }}"""


def commission(node: FieldNode) -> None:
    """P600 as POSICON has it (BU 2500 §5.4)."""
    drive = nord_drive(node.device, "")
    assert drive is not None
    drive.parameters.commission(600, 2)


def position(plant: Plant, step: Step) -> None:
    """Its mains are switched on, its owner lets it go to and fro, and somebody changes a setting (``how``) on
    the way, which is as it was before the mains are switched off: it costs nothing while nobody looks."""
    if plant.has_hoist:
        return
    plant.has_hoist = True
    world, node = plant.world, plant.nodes_by_id[NODE_ID]
    began, drive = world.now, nord_drive(node.device, "")
    cycles, is_owned = 0, True
    setting = HOIST_CHANGES.get(step.how)
    node.power_on()

    def cycle() -> None:
        nonlocal cycles
        age_s = world.now - began
        if not is_owned:
            return
        world.after(PLANT.owner_period_s, cycle)
        word = _BEGINS[cycles % len(_BEGINS)] if not moves() else _RUN
        cycles = 0 if moves() else cycles + 1
        place = _PLACES[int(age_s // _EACH_S) % len(_PLACES)]
        # As words: they mean what the drive says, and are taken whatever that is.
        values = {
            "control_word": word,
            "setpoint_1": place & 0xFFFF,
            "setpoint_2": place >> 16 & 0xFFFF,
            "setpoint_3": _25_HZ,
        }
        plant.bridge.ask(Request(_WHO, PATH, Write(values)), _DELAY_S, lambda: None, lambda outcome: None)

    def moves() -> bool:
        word = plant.bridge.good_number(f"{PATH}/status/drive_status_word")
        return word is not None and int(word) & 0x7F == 0x37

    def at_keypad() -> None:
        if setting is not None:
            set_at_keypad(node, drive, setting, setting.value)

    def leave() -> None:
        nonlocal is_owned
        is_owned = False
        if setting is not None:
            set_at_keypad(node, drive, setting, setting.usual)
        request = Request(_WHO, PATH, command_of(Action.RELEASE_CONTROL))
        plant.bridge.ask(request, _DELAY_S, lambda: None, lambda outcome: None)
        world.after(_ENDS_S, end)

    def end() -> None:
        node.change(node.device.power_off)
        plant.has_hoist = False

    world.after(_BOOT_S, cycle)
    world.after(_WAY_S, at_keypad)
    world.after(_WAY_S + step.seconds, leave)
