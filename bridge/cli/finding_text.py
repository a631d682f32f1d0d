"""Text of the witness's findings, as its command and the monitor print it."""

from __future__ import annotations

from bridge.witness.findings import Stop


def times_of(stop: Stop) -> str:
    """The times of a stop beside their bounds, each after a semicolon, and ": LATE" where it is."""
    parts: list[str] = []
    for what, ms, bound in (
        ("on the bus after", stop.bus_ms, stop.bus_bound_ms),
        ("in the drive after", stop.drive_ms, stop.drive_bound_ms),
    ):
        if ms is not None:
            parts.append(f"{what} {ms} ms" + (f" of {bound}" if bound else ""))
    return f"; {', '.join(parts)}" + ("" if stop.is_in_time else ": LATE")
