"""Error status of the process "boot NMT slave" (CiA 302-2, error status A … O) with what helps."""

from __future__ import annotations

from typing import Final

TEXTS: Final = {
    "A": "the node is not in the network list",
    "B": "no answer when object 1000h was read",
    "C": "another device type (1000h)",
    "D": "another vendor (1018h:01)",
    "E": "heartbeat lost",
    "F": "no answer to node guarding",
    "G": "program download is not configured",
    "H": "another program is required, and may not be downloaded",
    "I": "the program download failed",
    "J": "the configuration could not be downloaded",
    "K": "no heartbeat when error control was started",
    "L": "the node was operational already",
    "M": "another product code (1018h:02) or device name (1008h)",
    "N": "another revision (1018h:03) or software version (100Ah)",
    "O": "another serial number (1018h:04)",
}
"""By letter. G, H and I belong to program download, which the bridge does not do."""

HINTS: Final = {
    "A": "add it to the site file or take it off the bus",
    "B": "is it powered and connected, are address and bit rate right? A node that stays stopped answers "
    "nothing either",
    "C": "another device has this address, or the mapping is not its own",
    "D": "another device has this address, or the mapping is not its own",
    "E": "is it powered and connected, and does the bus show errors?",
    "J": "compare the site file with the device's manual",
    "K": "does the device have this kind of error control?",
    "F": "does the device have node guarding, and is its heartbeat (1017h) off?",
    "M": "was the device exchanged? If it may be used, change identity in the site file",
    "N": "was the firmware changed? If it may be used, change identity in the site file",
    "O": "was the device exchanged? If it may be used, change identity in the site file",
}

SILENT: Final = "did the node restart or lose its connection just now, or is the bus disturbed?"
"""What helps if a node that was there does not answer any more, whatever the step."""

ABSENT: Final = frozenset("BEFK")
"""With these the node is not there; with the others it is there and cannot be used."""


class BootError(Exception):
    """The boot-up ended. ``letter`` is the error status, ``detail`` names object, expected and read.

    ``absent`` is true where the node did not answer, whatever the step was. ``hint`` stands in place of what
    usually helps.
    """

    def __init__(self, letter: str, detail: str, *, absent: bool | None = None, hint: str = "") -> None:
        self.letter = letter
        self.detail = detail
        self.absent = letter in ABSENT if absent is None else absent
        usual = SILENT if self.absent and letter not in ABSENT else HINTS.get(letter, "")
        hint = hint or usual
        super().__init__(f"{letter}: {detail}: {hint}" if hint else f"{letter}: {detail}")
