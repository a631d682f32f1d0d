"""A node that positions beside the drives, and its owner: a NORD SK TU3-CAO with the settings of BU 2500
§5.4, some of which somebody changes at its keypad on the way."""

from __future__ import annotations

from typing import TYPE_CHECKING, Final

from bridge.command import Identity, Request, Source, Write
from tests.plant.field import FieldNode
from tests.plant.keypad import HOIST_CHANGES, nord_drive, set_at_keypad
from tests.plant.plan import Step
from tests.proof.drives import DRIVES
from tests.proof.families import OWN_TIMEOUT_MS
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
_RARELY: Final = 10
_WAY_S: Final = 3.0
"""From its first telegram to the change at the keypad."""
_WHO: Final = Identity(Source.ZENOH, "hoist's controller", connection="session 45")


def site() -> str:
    """Its table of the site file."""
    return f"""[[bus.node]]
name = "{NODE}"
id = {NODE_ID}
mapping = "nord/sk-tu3-cao-pdo3"
supervision = "heartbeat"
supervision_ms = {2 * PLANT.heartbeat_ms}
own_timeout_ms = {OWN_TIMEOUT_MS}
enforce = true
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


class Hoist:
    """Its owner, who keeps it ready, and lets it go to and fro where that is asked for."""

    def __init__(self, plant: Plant) -> None:
        self._plant = plant
        self._node = plant.nodes_by_id[NODE_ID]
        self._began: float | None = None
        """Since when it goes to and fro."""
        self._cycles = 0
        plant.world.after(0.0, self._cycle)

    def _cycle(self) -> None:
        world = self._plant.world
        world.after(PLANT.owner_period_s, self._cycle)
        self._cycles += 1
        if self._began is None:
            # Whatever it has is acknowledged now and then.
            place, word = 0, _READY if self._cycles % _RARELY else _ACKNOWLEDGE
        else:
            place = _PLACES[int((world.now - self._began) // _EACH_S) % len(_PLACES)]
            word = _RUN if self._moves() else _BEGINS[self._cycles % len(_BEGINS)]
        # As words: they mean what the drive says, and are taken whatever that is.
        values = {
            "control_word": word,
            "setpoint_1": place & 0xFFFF,
            "setpoint_2": place >> 16 & 0xFFFF,
            "setpoint_3": _25_HZ if self._began else 0,
        }
        request = Request(_WHO, PATH, Write(values))
        self._plant.bridge.ask(request, _DELAY_S, lambda: None, lambda outcome: None)

    def _moves(self) -> bool:
        word = self._plant.bridge.good_number(f"{PATH}/status/drive_status_word")
        return word is not None and int(word) & 0x7F == 0x37

    def go(self, seconds: float, how: str) -> None:
        """Go to and fro; somebody changes a setting (``how``) on the way, and back before the end."""
        if self._began is not None:
            return
        world, setting = self._plant.world, HOIST_CHANGES.get(how)
        drive = nord_drive(self._node.device, "")
        self._began, self._cycles = world.now, 0

        def at_keypad() -> None:
            if setting is not None:
                set_at_keypad(self._node, drive, setting, setting.value)

        def end() -> None:
            self._began = None
            if setting is not None:
                set_at_keypad(self._node, drive, setting, setting.usual)

        world.after(_WAY_S, at_keypad)
        world.after(_WAY_S + seconds, end)


def position(plant: Plant, step: Step) -> None:
    plant.hoist.go(step.seconds, step.how)
