"""The fault of a value that a validator of a model finds."""

from __future__ import annotations

from bridge.text import Text


class Unfit(ValueError):
    """A value that cannot be: ``said`` tells what it must be, or what is wrong with it.

    Pydantic takes it as it takes any ``ValueError``, and ``explain`` gives the text on.
    """

    def __init__(self, said: Text) -> None:
        super().__init__(str(said))
        self.said = said
