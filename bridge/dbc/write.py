"""A described bus as the text of a DBC file, by cantools."""

from __future__ import annotations

import unicodedata
from collections import OrderedDict
from typing import Final

from cantools.database.can import Bus, Database, Node
from cantools.database.can import Message as DbcMessage
from cantools.database.can import Signal as DbcSignal
from cantools.database.can.signal_group import SignalGroup
from cantools.database.conversion import BaseConversion
from cantools.database.namedsignalvalue import NamedSignalValue

from bridge.dbc.model import BusDescription, Message, MessageSignal

_DIGITS: Final = 9
_SPELT: Final = str.maketrans(
    {"Ä": "Ae", "Ö": "Oe", "Ü": "Ue", "ä": "ae", "ö": "oe", "ü": "ue", "ß": "ss"}
    | {"°": "deg", "µ": "u", "×": "x", "…": "...", "–": "-", "−": "-", "→": "->"}
)


def dbc_text(bus: BusDescription) -> str:
    """The file; names longer than the format's 32 characters are kept in attributes."""
    database = Database(
        messages=[_message(message) for message in bus.messages],
        nodes=[Node(name, _plain(comment)) for name, comment in bus.nodes.items()],
        buses=[Bus(bus.name, _plain(bus.comment), bus.bitrate)],
    )
    return database.as_dbc_string()


def _message(message: Message) -> DbcMessage:
    return DbcMessage(
        message.cob_id,
        message.name,
        message.length,
        [_signal(signal, message.receivers) for signal in message.signals],
        comment=_plain(message.comment),
        senders=[message.sender],
        cycle_time=message.cycle_ms or None,
        signal_groups=[SignalGroup(name, 1, list(names)) for name, names in message.groups.items()],
    )


def _signal(signal: MessageSignal, receivers: tuple[str, ...]) -> DbcSignal:
    texts = ((value, _plain(text) or "-") for value, text in signal.choices.items())
    choices: OrderedDict[int, str | NamedSignalValue] = OrderedDict(texts)
    return DbcSignal(
        signal.name,
        signal.start,
        signal.length,
        "little_endian",
        # A real number has a sign: tools that overlook SIG_VALTYPE_ show it at least.
        signal.is_signed or signal.is_float,
        conversion=BaseConversion.factory(
            _number(signal.factor), _number(signal.offset), choices or None, signal.is_float
        ),
        minimum=_limit(signal.low),
        maximum=_limit(signal.high),
        unit=_plain(signal.unit) or None,
        comment=_plain(signal.comment),
        receivers=list(receivers),
    )


def _number(value: float) -> float:
    """A whole number as an integer: so it stands in the file as one."""
    return int(value) if value == int(value) else value


def _limit(value: float | None) -> float | None:
    """A limit without the digits that multiplying has left behind."""
    return None if value is None else _number(float(f"{value:.{_DIGITS}g}"))


def _plain(text: str) -> str | None:
    """``text`` as it may stand between quotation marks. In ASCII, which reads the same in every encoding
    that tools take a DBC file to be in."""
    spelt = unicodedata.normalize("NFKD", text.translate(_SPELT))
    known = "".join(letter for letter in spelt if not unicodedata.combining(letter))
    known = known.encode("ascii", "replace").decode("ascii")
    return " ".join(known.replace("\\", "/").replace('"', "'").split()) or None
