"""Checks that the entries of a mapping file agree with each other."""

from __future__ import annotations

from typing import Final

from bridge.image import DataType
from bridge.mapping.checks_aliases import check_aliases
from bridge.mapping.checks_device import check_kind, check_signals
from bridge.mapping.checks_faults import check_faults
from bridge.mapping.checks_own import check_own_supervision
from bridge.mapping.checks_process import check_cob_id, check_parameter, check_process, check_slots, twice
from bridge.mapping.checks_values import check_meanings, check_values
from bridge.mapping.merge import MergedFile
from bridge.mapping.model import ControlWord, Family, pattern_bits
from bridge.mapping.parameters import Parameter
from bridge.text import Text
from bridge.tomlfile import Key, Unfit

NODE_POINTS: Final = (
    "nmt_state",
    "state",
    "supervision_state",
    "boot_status",
    "software_version",
    "current_fault",
    "last_fault",
    "rejected_frames",
    "emcy_history",
    "emcy_suppressed",
)
"""Points that every node has beside the polled ones."""


def check(family: Family, file: MergedFile) -> None:
    """Note in ``file`` all entries that do not go together."""
    facts = family.family
    if facts.node_id_low > facts.node_id_high:
        said = Text.of("mapping.above_node_id_high", high=facts.node_id_high)
        file.fault(("family", "node_id_low"), said)
    check_kind(family, file)
    if family.slot:
        check_process(family, file)
        check_slots(family, file)
        check_meanings(family, file)
        check_values(family, file)
        _check_control_word(family.control_word, file)
        _check_handshake(family, file)
        _check_states(family, file)
        check_own_supervision(family, file)
    check_signals(family, file)
    _check_sdo(family, file)
    _check_parameters(family, file)
    check_aliases(family, file)
    _check_eeprom(family, file)
    _check_polls(family, file)
    _check_bits(family, file)
    check_faults(family, file)


def _check_sdo(family: Family, file: MergedFile) -> None:
    slots = [slot.name for slot in family.slot]
    numbers = ((f"{sdo.number}", ("sdo", s, "number")) for s, sdo in enumerate(family.sdo))
    twice(numbers, Text.of("mapping.noun_sdo_server"), file)
    for s, sdo in enumerate(family.sdo):
        if sdo.slot is not None and sdo.slot not in slots:
            said = Text.of("mapping.no_slot", slot=sdo.slot)
            file.fault(("sdo", s, "slot"), said, Text.of("mapping.known", names=tuple(slots)))
        for name, cob_id in (("request", sdo.request), ("reply", sdo.reply)):
            check_cob_id(cob_id, family, ("sdo", s, name), file)


def _check_parameters(family: Family, file: MergedFile) -> None:
    names = [(parameter.name, ("parameter", p, "name")) for p, parameter in enumerate(family.parameter)]
    twice(names, Text.of("mapping.noun_parameter"), file)
    points = [(one.leaf, ("parameter", p, "name")) for p, one in enumerate(family.parameter) if one.point]
    if len({one.name for one in family.parameter}) == len(family.parameter):
        twice(points, Text.of("mapping.noun_parameter_point"), file)
    for p, one in enumerate(family.parameter):
        key: Key = ("parameter", p)
        if one.object is None and family.parameter_names is None:
            said = Text.of("mapping.no_object", parameter=one.name)
            file.fault(key, said, Text.of("mapping.no_object_advice"))
        else:
            try:
                family.object_of(one)
            except Unfit as error:
                file.fault((*key, "name"), error.said)
        if one.low is not None and one.high is not None and one.low > one.high:
            file.fault((*key, "low"), Text.of("mapping.above_high", high=one.high))
        if one.every_ms and not one.point:
            file.fault((*key, "every_ms"), Text.of("mapping.no_effect_without", setting="point = true"))
        if one.factor == 0:
            file.fault((*key, "factor"), Text.of("mapping.zero"))
        if one.data_type in ("string", "bytes") and (one.factor != 1 or one.states):
            file.fault((*key, "data_type"), Text.of("mapping.text_unscaled"))
        if one.german_states:
            _check_languages(one, key, file)


def _check_languages(one: Parameter, key: Key, file: MergedFile) -> None:
    """Check that a value with a text in German has one in English, and the other way round."""
    states = {"states": one.states.keys(), "german_states": one.german_states.keys()}
    for field, other in (("states", "german_states"), ("german_states", "states")):
        for number in sorted(states[field] - states[other]):
            said = Text.of("mapping.one_language", field=f"{number}", language=field)
            file.fault((*key, other), said)


def _check_eeprom(family: Family, file: MergedFile) -> None:
    ram_only = family.eeprom.ram_only if family.eeprom else None
    if ram_only is not None:
        check_parameter(ram_only.parameter, family, ("eeprom", "ram_only", "parameter"), file)
    saving = family.eeprom.save_command if family.eeprom else None
    if saving is None:
        return
    key: Key = ("eeprom", "save_command", "parameter")
    if check_parameter(saving.parameter, family, key, file):
        one = family.parameter_named(saving.parameter)
        if not (one.command and one.writable):
            said = Text.of("mapping.no_command", parameter=one.name)
            file.fault(key, said, Text.of("mapping.no_command_advice"))
    if family.eeprom and family.eeprom.save:
        file.fault(("eeprom", "save"), Text.of("mapping.no_effect_beside", other="save_command"))


def _check_polls(family: Family, file: MergedFile) -> None:
    names = ((poll.name, ("poll", p, "name")) for p, poll in enumerate(family.poll))
    twice(names, Text.of("mapping.noun_poll"), file)
    for p, poll in enumerate(family.poll):
        if poll.name in NODE_POINTS:
            said = Text.of("mapping.name_of_node", name=poll.name)
            file.fault(("poll", p, "name"), said, Text.of("site.reserved_advice"))
        _check_integer(poll.data_type, ("poll", p, "data_type"), file)


def _check_bits(family: Family, file: MergedFile) -> None:
    """Check that the bits of a word have different names: each is shown beside the others."""
    named: list[tuple[list[str], Key]] = [
        (family.control_word.bits, ("control_word", "bits")),
        (family.status_word.bits, ("status_word", "bits")),
        *((value.bits, ("value", v, "bits")) for v, value in enumerate(family.value)),
        *((poll.bits, ("poll", p, "bits")) for p, poll in enumerate(family.poll)),
    ]
    for bits, key in named:
        names = ((name, (*key, place)) for place, name in enumerate(bits) if name)
        twice(names, Text.of("mapping.noun_bit"), file)


def _check_integer(data_type: DataType, key: Key, file: MergedFile) -> None:
    if not data_type.is_integer:
        file.fault(key, Text.of("mapping.no_integer_type"), Text.of("mapping.no_integer_type_advice"))


def _check_control_word(control: ControlWord, file: MergedFile) -> None:
    enabling = control.enabling
    acknowledge = 1 << control.acknowledge_bit
    commands = {"stop": control.stop, "quick_stop": control.quick_stop}
    commands["disable_voltage"] = control.disable_voltage
    for name, command in {"enabling": enabling, **commands}.items():
        if command.value & ~command.mask:
            file.fault(("control_word", name), Text.of("mapping.beyond_mask"))
    for name, word in (("stopped", control.stopped), ("ready", control.ready), ("run", control.run)):
        key: Key = ("control_word", name)
        enables = word & enabling.mask == enabling.value
        if enables is not (name == "run"):
            said = Text.of("mapping.would_enable" if enables else "mapping.does_not_enable", word=word)
            file.fault(key, said)
        if control.valid_bit is not None and not word >> control.valid_bit & 1:
            file.fault(key, Text.of("mapping.word_invalid", word=word, bit=control.valid_bit))
        if word & acknowledge:
            file.fault(key, Text.of("mapping.word_acknowledges", word=word, bit=control.acknowledge_bit))
    for name, command in commands.items():
        if (control.run & ~command.mask | command.value) & enabling.mask == enabling.value:
            file.fault(("control_word", name), Text.of("mapping.leaves_enabled"))
    for name, bits in (("forward", control.forward), ("reverse", control.reverse), ("begin", control.begin)):
        if bits & (enabling.mask | acknowledge):
            file.fault(("control_word", name), Text.of("mapping.bits_of_enabling"))


def _check_handshake(family: Family, file: MergedFile) -> None:
    handshake = family.control_word.handshake
    if handshake is None:
        return
    commands = sorted(value.name for value in family.value if value.group == "command")
    key: Key = ("control_word", "handshake")
    if handshake.value not in commands:
        said = Text.of("mapping.no_command_value", name=handshake.value)
        file.fault((*key, "value"), said, Text.of("mapping.known", names=tuple(commands)))
    control = family.control_word
    if 1 << handshake.bit & (control.enabling.mask | 1 << control.acknowledge_bit):
        file.fault((*key, "bit"), Text.of("mapping.bit_of_enabling"))


def _check_states(family: Family, file: MergedFile) -> None:
    """Check that the word that is served while tripped decodes as *fault*, and that every state can occur."""
    states = family.status_word.state
    if not any(state.name == "operation_enabled" for state in states):
        said = Text.of("mapping.state_needed", state="operation_enabled")
        file.fault(("status_word", "state"), said, Text.of("mapping.enabled_state_advice"))
    faults = [s for s, state in enumerate(states) if state.name == "fault"]
    _check_shadows(family, faults[:1], file)
    if not faults:
        file.fault(("status_word", "state"), Text.of("mapping.state_needed", state="fault"))
        return
    mask, value = pattern_bits(states[faults[0]].pattern)
    for s, state in enumerate(states[: faults[0]]):
        other_mask, other_value = pattern_bits(state.pattern)
        if not (mask & other_mask & (value ^ other_value)):
            file.fault(
                ("status_word", "state", s, "pattern"),
                Text.of("mapping.state_takes_faults", state=state.name),
                Text.of("mapping.state_takes_faults_advice"),
            )


def _check_shadows(family: Family, told: list[int], file: MergedFile) -> None:
    """Check that no pattern has only words that match an earlier one. ``told`` are checked already."""
    states = family.status_word.state
    bits = [pattern_bits(state.pattern) for state in states]
    for s, (mask, value) in enumerate(bits):
        if s in told:
            continue
        for earlier, (other_mask, other_value) in enumerate(bits[:s]):
            if other_mask & ~mask == 0 and value & other_mask == other_value:
                file.fault(
                    ("status_word", "state", s, "pattern"),
                    Text.of("mapping.state_shadowed", state=states[s].name, earlier=states[earlier].name),
                    Text.of("mapping.state_shadowed_advice"),
                )
                break
