"""Reasons why an interface cannot be used, each with a remedy."""

from __future__ import annotations

import errno

from bridge.text import Text, render


class WrongBitrate(OSError):
    """The interface runs at another bit rate than the site file says."""

    def __init__(self, channel: str, actual: int, stated: int) -> None:
        self.said = Text.of("can.wrong_bitrate", channel=channel, actual=actual, stated=stated)
        super().__init__(errno.EINVAL, render(self.said))


class TooSlow(OSError):
    """The interface is slower than was assumed, as nobody has said its bit rate."""

    def __init__(self, channel: str, actual: int, assumed: int) -> None:
        self.said = Text.of("can.too_slow", channel=channel, actual=actual, assumed=assumed)
        super().__init__(errno.EINVAL, render(self.said))


def explain(error: OSError, channel: str) -> Text:
    """Sentence on ``error`` of ``channel`` with its remedy."""
    if isinstance(error, WrongBitrate | TooSlow):
        return error.said
    match error.errno:
        case errno.ENODEV | errno.ENXIO:
            return Text.of("can.no_interface", channel=channel)
        case errno.ENETDOWN:
            return Text.of("can.interface_down", channel=channel)
        case errno.EAFNOSUPPORT | errno.EPROTONOSUPPORT:
            return Text.of("can.no_socketcan")
        case errno.EPERM | errno.EACCES:
            return Text.of("can.no_permission", channel=channel)
        case _:
            return Text.of("can.not_opened", channel=channel, why=error.strerror or str(error))
