"""Reasons why an interface cannot be used, each with a remedy."""

from __future__ import annotations

import errno


class WrongBitrate(OSError):
    """The interface runs at another bit rate than the site file says."""

    def __init__(self, channel: str, actual: int, stated: int) -> None:
        super().__init__(
            errno.EINVAL,
            f"{channel} runs at {actual} bit/s, the site file says {stated}: change one of them "
            f"(ip link set {channel} down; ip link set {channel} up type can bitrate {stated})",
        )


class TooSlow(OSError):
    """The interface is slower than was assumed, as nobody has said its bit rate."""

    def __init__(self, channel: str, actual: int, assumed: int) -> None:
        super().__init__(
            errno.EINVAL,
            f"{channel} runs at {actual} bit/s, and requests at the pace of the assumed {assumed} would "
            f"flood it: give --bitrate {actual}",
        )


def explain(error: OSError, channel: str) -> str:
    """Sentence on ``error`` of ``channel`` with its remedy."""
    if isinstance(error, WrongBitrate | TooSlow):
        return error.strerror or str(error)
    match error.errno:
        case errno.ENODEV | errno.ENXIO:
            return f"there is no interface {channel}; see `ip link`, and deploy/ for networkd files"
        case errno.ENETDOWN:
            return f"interface {channel} is down: ip link set {channel} up type can bitrate …"
        case errno.EAFNOSUPPORT | errno.EPROTONOSUPPORT:
            return "this kernel has no SocketCAN (modprobe can can-raw can-bcm)"
        case errno.EPERM | errno.EACCES:
            return f"no permission to open {channel}"
        case _:
            return f"{channel} cannot be opened: {error.strerror or error}"
