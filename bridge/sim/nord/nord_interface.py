"""Object dictionary of a bus interface SK xU4-CAO, and what each SDO channel reaches (BU 2500 §6.7, §7.1)."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import dataclass
from functools import partial
from typing import Final, Literal

from bridge.sim.core.communication_objects import DeviceIdentity, add_communication
from bridge.sim.core.communication_settings import CommunicationSettings
from bridge.sim.core.dictionary import Dictionary, Entry, IntegerType, Number, ObjectAccess, item, variable
from bridge.sim.core.emcy_producer import EmcyProducer
from bridge.sim.core.pdo_objects import PdoConfigurator
from bridge.sim.core.sdo_abort import AbortCode, SdoAbort
from bridge.sim.core.sdo_server import SimulatedSdoServer
from bridge.sim.core.store import Store
from bridge.sim.nord.nord_can_parameters import CanParameters
from bridge.sim.nord.nord_drive import NordDrive
from bridge.sim.nord.nord_image import ProcessImage, add_parameter, display, fixed
from bridge.sim.nord.nord_profile import VelocityMode
from bridge.sim.nord.nord_settings import DRIVES, RULES, InterfaceSettings
from bridge.sim.nord.nord_supervision import FaultDisplay

Kind = Literal["SK CU4-CAO", "SK TU4-CAO"]
KINDS: Final[tuple[Kind, ...]] = ("SK CU4-CAO", "SK TU4-CAO")
"""Kinds in the order of P172."""
_SOFTWARE: Final = (12, 0, 0)
"""P171: version 1.2, revision 0, no special version."""
_BAUD_250: Final = 1


@dataclass(frozen=True, slots=True)
class InterfaceParts:
    """Parts of the node that the dictionary displays and changes."""

    node_id: int
    kind: Kind
    communication: Store[CommunicationSettings]
    interface: Store[InterfaceSettings]
    image: ProcessImage
    faults: FaultDisplay
    emcy: EmcyProducer
    profile: VelocityMode
    module_state: Callable[[], int]
    to_factory: Callable[[], None]
    set_profile: Callable[[bool], None]


def identity(device_name: str) -> DeviceIdentity:
    """The identity of a NORD node."""
    return DeviceIdentity(
        device_type=0x0001_0192,  # CiA 402, frequency converter
        vendor_id=0,  # the manual prints none of the numbers of 1018h, and an invented one would be believed
        product_code=0,
        revision=0,
        serial=0,
        device_name=device_name,
        hardware_version="SIM",
        software_version="1.2 R0",
    )


def build_dictionary(dictionary: Dictionary, parts: InterfaceParts, pdos: PdoConfigurator) -> None:
    """Fill ``dictionary``, which ``pdos`` already uses to check mappings."""
    stores = (parts.communication, parts.interface)
    add_communication(dictionary, identity(parts.kind), parts.module_state, parts.emcy, *stores)
    parts.image.add_to(dictionary)
    parts.profile.add_to(dictionary)
    pdos.add()
    _add_standard_parameters(dictionary, parts)
    CanParameters(parts.communication, pdos).add_to(dictionary)
    _add_displays(dictionary, parts)


def _add_standard_parameters(dictionary: Dictionary, parts: InterfaceParts) -> None:
    """P150…P154 and P168 (§7.1.1, §7.1.2)."""

    def set_p152(value: int) -> None:
        if value:
            parts.to_factory()  # and P152 reads 0 again

    def settings() -> InterfaceSettings:
        return parts.interface.current

    def elements(values: Callable[[], list[int]], places: range, high: int) -> list[Number]:
        return [item(IntegerType.UNSIGNED16, values, place, 0, high) for place in places]

    def set_profile(value: int) -> None:
        parts.set_profile(value != 0)

    u16 = IntegerType.UNSIGNED16
    if parts.kind == "SK TU4-CAO":  # the SK CU4-CAO has no outputs
        add_parameter(dictionary, 150, [variable(u16, settings, "relays", 0, 4)])
    add_parameter(dictionary, 151, [variable(u16, settings, "p151_ms", 0, 32767)])
    add_parameter(dictionary, 152, [Number(u16, lambda: 0, set_p152, 0, 1)])
    add_parameter(dictionary, 153, elements(lambda: settings().system_bus_cycle_ms, range(2), 250))
    add_parameter(dictionary, 154, elements(lambda: settings().io_access, range(2), 5))
    switch = Number(u16, lambda: settings().profile[0], set_profile, 0, 1)
    ramps = elements(lambda: settings().profile, range(1, 17), 16383)
    add_parameter(dictionary, 168, [switch, *ramps])


def _add_displays(dictionary: Dictionary, parts: InterfaceParts) -> None:
    """P170…P181 (§7.1.3, §7.1.4)."""
    image, faults = parts.image, parts.faults

    def relays() -> int:
        setting = parts.interface.current.relays
        return image.outputs & 3 if setting == 0 else setting - 1

    elements = range(1, 2 + 4 * DRIVES)
    add_parameter(dictionary, 170, [display(lambda: faults.present), display(lambda: faults.last)])
    add_parameter(dictionary, 171, [fixed(number) for number in _SOFTWARE])
    add_parameter(dictionary, 172, [fixed(KINDS.index(parts.kind))])
    add_parameter(dictionary, 173, [display(parts.module_state)])
    add_parameter(dictionary, 174, [display(lambda: image.inputs & 0x0F)])
    if parts.kind == "SK TU4-CAO":
        add_parameter(dictionary, 175, [display(relays)])
    for number, word in ((176, image.bus_in), (177, image.bus_out)):
        words = [Number(IntegerType.INTEGER16, partial(word, element)) for element in elements]
        add_parameter(dictionary, number, words)
    add_parameter(dictionary, 180, [fixed(parts.node_id)])
    add_parameter(dictionary, 181, [fixed(_BAUD_250)])


def build_servers(
    dictionary: Dictionary, drives: Sequence[NordDrive], online: Callable[[int], bool]
) -> list[SimulatedSdoServer]:
    """SDO1 for the interface and FU1, SDO2…4 for FU2…4 (§6.4)."""
    channels: list[DriveAccess] = []
    for place, drive in enumerate(drives):
        parameters = Dictionary()
        drive.add_to(parameters)
        channels.append(DriveAccess(parameters, partial(online, place)))
    reaches = [FirstChannel([dictionary, channels[0]]), *channels[1:]]
    return [SimulatedSdoServer(objects, RULES.sdo_block_segments) for objects in reaches]


class DriveAccess:
    """An SDO channel into a drive over the system bus: its parameters and nothing else."""

    def __init__(self, parameters: Dictionary, online: Callable[[], bool]) -> None:
        self._parameters = parameters
        self._online = online

    def has_object(self, index: int) -> bool:
        return self._parameters.has_object(index)

    def find(self, index: int, sub: int) -> Entry:
        entry = self._parameters.find(index, sub)
        if not self._online():
            raise SdoAbort(AbortCode.HARDWARE_FAULT)
        return entry


class FirstChannel:
    """SDO1: the interface's own objects and FU1 (§6.4)."""

    def __init__(self, members: Sequence[ObjectAccess]) -> None:
        self._members = tuple(members)

    def has_object(self, index: int) -> bool:
        return any(member.has_object(index) for member in self._members)

    def find(self, index: int, sub: int) -> Entry:
        for member in self._members:
            if member.has_object(index):
                return member.find(index, sub)
        raise SdoAbort(AbortCode.OBJECT_MISSING)
