"""What the entries of a mapping file say together."""

from __future__ import annotations

from collections.abc import Iterable
from typing import Final

from bridge.image import DataType
from bridge.mapping.model import ControlWord, Family, Pdo, pattern_bits
from bridge.tomlfile import Key, TomlFile

_NODE_POINTS: Final = (
    "nmt_state",
    "supervision_state",
    "boot_status",
    "software_version",
    "current_fault",
    "last_fault",
    "rejected_frames",
)
"""What every node has beside what is polled."""
_STANDARD_ID_MOST: Final = 0x7FF


def check(family: Family, file: TomlFile) -> None:
    """Note in ``file`` what does not go together."""
    facts = family.family
    if facts.node_id_low > facts.node_id_high:
        file.fault(("family", "node_id_low"), f"is above node_id_high, {facts.node_id_high}")
    _check_process(family, file)
    _check_slots(family, file)
    _check_sdo(family, file)
    _check_values(family, file)
    _check_parameters(family, file)
    _check_polls(family, file)
    _check_control_word(family.control_word, file)
    _check_states(family, file)


def _twice(names: Iterable[tuple[str, Key]], what: str, file: TomlFile) -> None:
    seen: dict[str, Key] = {}
    for name, key in names:
        if name in seen:
            file.fault(key, f"{what} {name!r} is there twice", f"first in line {file.line(seen[name])}")
        else:
            seen[name] = key


def _check_process(family: Family, file: TomlFile) -> None:
    for name, words, first in (
        ("rpdo", family.process.rpdo, "control_word"),
        ("tpdo", family.process.tpdo, "status_word"),
    ):
        if words[0] != first:
            file.fault(("process", name), f"must begin with {first}")
        _twice(((word, ("process", name, place)) for place, word in enumerate(words)), "word", file)


def _check_slots(family: Family, file: TomlFile) -> None:
    _twice(((slot.name, ("slot", s, "name")) for s, slot in enumerate(family.slot)), "slot", file)
    for s, slot in enumerate(family.slot):
        _check_pdo(family, slot.rpdo, family.process.rpdo, ("slot", s, "rpdo"), file)
        _check_pdo(family, slot.tpdo, family.process.tpdo, ("slot", s, "tpdo"), file)
        if slot.emcy_drive is not None and family.emcy.drive_byte is None:
            file.fault(("slot", s, "emcy_drive"), "has no meaning without emcy.drive_byte")


def _check_sdo(family: Family, file: TomlFile) -> None:
    slots = [slot.name for slot in family.slot]
    _twice(((f"{sdo.number}", ("sdo", s, "number")) for s, sdo in enumerate(family.sdo)), "SDO server", file)
    for s, sdo in enumerate(family.sdo):
        if sdo.slot is not None and sdo.slot not in slots:
            hint = f"known: {', '.join(slots)}"
            file.fault(("sdo", s, "slot"), f"there is no slot {sdo.slot!r}", hint)
        for name, cob_id in (("request", sdo.request), ("reply", sdo.reply)):
            _check_cob_id(cob_id, family, ("sdo", s, name), file)


def _check_pdo(family: Family, pdo: Pdo, words: list[str], key: Key, file: TomlFile) -> None:
    if len(pdo.objects) != len(words):
        message = f"has {len(pdo.objects)} words and process.{key[-1]} names {len(words)}"
        file.fault((*key, "objects"), message)
    _check_cob_id(pdo.cob_id, family, (*key, "cob_id"), file)


def _check_cob_id(cob_id: int, family: Family, key: Key, file: TomlFile) -> None:
    most = _STANDARD_ID_MOST - family.family.node_id_high
    if cob_id > most:
        file.fault(key, f"{cob_id:X}h leaves no room for the node id", f"at most {most:X}h")


def _check_values(family: Family, file: TomlFile) -> None:
    parameters = sorted(parameter.name for parameter in family.parameter)
    process = family.process
    names: list[tuple[str, Key]] = [
        *((f"command/{word}", ("process", "rpdo")) for word in process.rpdo),
        *((f"actual/{word}", ("process", "tpdo")) for word in process.tpdo[1:]),
    ]
    for v, value in enumerate(family.value):
        words = (process.rpdo if value.group == "command" else process.tpdo)[1:]
        if value.word not in words:
            message = f"there is no value word {value.word!r}"
            file.fault(("value", v, "word"), message, f"known: {', '.join(words)}")
        if value.scale.full not in parameters:
            message = f"there is no parameter {value.scale.full!r}"
            file.fault(("value", v, "scale", "full"), message, f"known: {', '.join(parameters)}")
        names.append((value.leaf, ("value", v, "name")))
    if len(set(process.rpdo)) == len(process.rpdo) and len(set(process.tpdo)) == len(process.tpdo):
        _twice(names, "point", file)


def _check_parameters(family: Family, file: TomlFile) -> None:
    names = [(parameter.name, ("parameter", p, "name")) for p, parameter in enumerate(family.parameter)]
    _twice(names, "parameter", file)
    for p, parameter in enumerate(family.parameter):
        _check_integer(parameter.data_type, ("parameter", p, "data_type"), file)


def _check_polls(family: Family, file: TomlFile) -> None:
    _twice(((poll.name, ("poll", p, "name")) for p, poll in enumerate(family.poll)), "poll", file)
    for p, poll in enumerate(family.poll):
        if poll.name in _NODE_POINTS:
            file.fault(("poll", p, "name"), f"every node has {poll.name!r} of its own", "choose another name")
        _check_integer(poll.data_type, ("poll", p, "data_type"), file)


def _check_integer(data_type: DataType, key: Key, file: TomlFile) -> None:
    if not data_type.is_integer:
        file.fault(key, "must be an integer type", "uint8, uint16, uint32, int16 or int32")


def _check_control_word(control: ControlWord, file: TomlFile) -> None:
    enabling = control.enabling
    acknowledge = 1 << control.acknowledge_bit
    commands = {"stop": control.stop, "quick_stop": control.quick_stop}
    commands["disable_voltage"] = control.disable_voltage
    for name, command in {"enabling": enabling, **commands}.items():
        if command.value & ~command.mask:
            file.fault(("control_word", name), "value has bits outside its mask")
    for name, word in (("stopped", control.stopped), ("ready", control.ready), ("run", control.run)):
        key: Key = ("control_word", name)
        enables = word & enabling.mask == enabling.value
        if enables is not (name == "run"):
            does = "would enable" if enables else "does not enable"
            file.fault(key, f"{word:04X}h {does} the drive")
        if control.valid_bit is not None and not word >> control.valid_bit & 1:
            file.fault(key, f"{word:04X}h is not valid: bit {control.valid_bit} is 0")
        if word & acknowledge:
            file.fault(key, f"{word:04X}h acknowledges: bit {control.acknowledge_bit} is 1")
    for name, command in commands.items():
        if (control.run & ~command.mask | command.value) & enabling.mask == enabling.value:
            file.fault(("control_word", name), "leaves the drive enabled")
    for name, bits in (("forward", control.forward), ("reverse", control.reverse)):
        if bits & (enabling.mask | acknowledge):
            file.fault(("control_word", name), "has bits of enabling or of the acknowledge")


def _check_states(family: Family, file: TomlFile) -> None:
    """The word that is served while tripped must decode as *fault*."""
    states = family.status_word.state
    faults = [s for s, state in enumerate(states) if state.name == "fault"]
    if not faults:
        file.fault(("status_word", "state"), 'needs a state named "fault"')
        return
    mask, value = pattern_bits(states[faults[0]].pattern)
    for s, state in enumerate(states[: faults[0]]):
        other_mask, other_value = pattern_bits(state.pattern)
        if not (mask & other_mask & (value ^ other_value)):
            file.fault(
                ("status_word", "state", s, "pattern"),
                f"{state.name} takes words that are a fault too",
                "the first state that matches counts",
            )
