"""Requests that the page's server refuses for a reason of which there is a sentence."""

from __future__ import annotations

from starlette.responses import JSONResponse

from bridge.text import Text, Words, as_json, render


class BodyTooLong(ValueError):
    """A body of a request of more bytes than are read."""

    def __init__(self) -> None:
        self.said = Text.of("page.body_long")
        super().__init__(render(self.said))


def refused(status: int, said: Words) -> JSONResponse:
    """``error`` is the reason in English, ``text`` its code with facts where it has one."""
    text = as_json(said)
    return JSONResponse({"error": render(said)} | ({"text": text} if text else {}), status)
