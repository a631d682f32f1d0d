"""From the last cases before a failure to the few that do it."""

from __future__ import annotations

from collections.abc import Callable, Sequence

from tests.fuzz.case import Case


def reduced(cases: Sequence[Case], fails: Callable[[Sequence[Case]], bool]) -> list[Case]:
    """Fewest of ``cases``, in their order, that still fail (Zeller's ddmin, without its last round of tries).

    ``cases`` themselves have to fail.
    """
    left = list(cases)
    pieces = 2
    while len(left) > 1:
        size = -(-len(left) // pieces)
        parts = [left[begin : begin + size] for begin in range(0, len(left), size)]
        without = [[case for other in parts if other is not part for case in other] for part in parts]
        tries = [*reversed(parts), *(without if len(parts) > 2 else [])]
        smaller = next((one for one in tries if fails(one)), None)
        if smaller is not None:
            pieces = max(2, pieces - 1) if len(smaller) > size else 2
            left = smaller
        elif size == 1:
            break
        else:
            pieces = min(len(left), 2 * pieces)
    return left
