"""Ways back from a block transfer to segments: what servers do wrong with blocks, as a table.

A transfer that breaks in one of these ways goes on by segments. Where these bring it to its end, the way is
what is said of the server, and it is not asked for blocks again. A server that breaks in another way is one
more row; a device that plays it is a file in ``bridge/sim/habits``. A disturbed bus may cost a server its
blocks, too: segments are slower, and nothing worse.
"""

from __future__ import annotations

from dataclasses import dataclass
from enum import Enum
from typing import Final

from bridge.canopen import abort
from bridge.canopen.sdo_transfer import SdoError


class BlockStage(Enum):
    """Stage of a block transfer (CiA 301 §7.2.4.3.9–15)."""

    BEGIN = "A4h or C6h has been sent"
    BLOCKS = "segments are on their way"
    END_UPLOAD = "all segments have come; CRC and length are compared"
    END_DOWNLOAD = "C1h has been sent: the server may have taken the value"


@dataclass(frozen=True, slots=True)
class WayBack:
    """One way in which a block transfer breaks at ``stage``.

    ``by_server``: the server has aborted it; otherwise silence or a wrong answer has ended it here.
    ``codes``: abort codes of CiA 301 table 22, any where there are none.
    """

    stage: BlockStage
    by_server: bool
    codes: frozenset[int]
    name: str
    says: str

    def fits(self, stage: BlockStage, error: SdoError) -> bool:
        is_of_kind = self.stage is stage and self.by_server is error.by_server
        return is_of_kind and (not self.codes or error.code in self.codes)


_ANY: Final = frozenset[int]()
_SILENCE: Final = frozenset((abort.TIMED_OUT,))
_OUT_OF_STEP: Final = frozenset((abort.SEQUENCE, abort.BLOCK_SIZE, abort.LENGTH_TOO_HIGH))
_LENGTHS: Final = frozenset((abort.LENGTH_TOO_HIGH, abort.LENGTH_TOO_LOW))
_OF_THE_PROTOCOL: Final = (
    frozenset(
        (abort.TOGGLE, abort.TIMED_OUT, abort.UNKNOWN_COMMAND, abort.BLOCK_SIZE, abort.SEQUENCE, abort.CRC)
    )
    | abort.LENGTHS
)
"""Abort codes by which a server refuses the end of a download without having looked at the value."""

WAYS_BACK: Final = (
    WayBack(BlockStage.BEGIN, True, _ANY, "refused", "the node refuses it"),
    WayBack(
        BlockStage.BEGIN, False, _SILENCE, "no_answer", "the node does not answer when it is asked for it"
    ),
    WayBack(BlockStage.BEGIN, False, frozenset((abort.GENERAL,)), "segments", "the node answers by segments"),
    WayBack(BlockStage.BLOCKS, True, _ANY, "aborted", "the node aborts it within the blocks"),
    WayBack(BlockStage.BLOCKS, False, _SILENCE, "silent", "the node falls silent within the blocks"),
    WayBack(BlockStage.BLOCKS, False, _OUT_OF_STEP, "out_of_step", "the node loses step within the blocks"),
    WayBack(BlockStage.END_UPLOAD, True, _ANY, "aborted_at_end", "the node aborts it at its end"),
    WayBack(BlockStage.END_UPLOAD, False, _SILENCE, "silent_at_end", "the node falls silent at its end"),
    WayBack(BlockStage.END_UPLOAD, False, frozenset((abort.CRC,)), "crc", "the node's CRC is wrong"),
    WayBack(BlockStage.END_UPLOAD, False, _LENGTHS, "length", "the node's length is wrong"),
    WayBack(BlockStage.END_DOWNLOAD, True, _OF_THE_PROTOCOL, "end_refused", "the node refuses its end"),
)


def way_back(stage: BlockStage, error: SdoError) -> WayBack | None:
    """The first row that fits; None where segments would be no way on."""
    return next((way for way in WAYS_BACK if way.fits(stage, error)), None)
