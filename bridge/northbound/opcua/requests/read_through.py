"""Reads of parameters that go through to their drives: for clients that accept no older value."""

from __future__ import annotations

import asyncio
from collections.abc import Callable, Iterable, Sequence
from typing import Final

from bridge.command.messages.request import Identity, Outcome, ReadParameter, Request
from bridge.northbound.opcua.requests.outcome_texts import explanation
from bridge.northbound.opcua.requests.writes import ask
from bridge.northbound.opcua.space.data_values import outcome_status
from bridge.northbound.opcua.space.nodes import VariableNode
from bridge.northbound.view import View
from bridge.uaserver.explanations import Explanation
from bridge.uaserver.library import ua

MOST_AT_ONCE: Final = 16
"""Parameters that one request has read from their drives; of the others it gets the values read last."""
LIMIT_S: Final = 3.0
"""Longest wait of a request for all of them, seconds; clients wait for an answer for four or more."""


class ReadThrough:
    """Reads the parameters that ``parameter`` finds."""

    def __init__(self, view: View, parameter: Callable[[ua.NodeId], VariableNode | None]) -> None:
        self._view = view
        self._parameter = parameter

    def wanted(self, nodes: Iterable[ua.NodeId]) -> list[ua.NodeId]:
        """The first of the ``nodes`` that are parameters, each once."""
        found: dict[ua.NodeId, None] = {}
        for where in nodes:
            if self._parameter(where) is not None:
                found[where] = None
                if len(found) >= MOST_AT_ONCE:
                    break
        return list(found)

    async def read(
        self, identity: Identity, nodes: Sequence[ua.NodeId]
    ) -> dict[ua.NodeId, tuple[ua.StatusCode, Explanation]]:
        """Parameters that were refused. What was read is in the image; what takes too long is as it was."""
        asking = {where: asyncio.create_task(self._ask(identity, where)) for where in nodes}
        try:
            await asyncio.wait(asking.values(), timeout=LIMIT_S)
        finally:
            for task in asking.values():
                task.cancel()
        outcomes = {where: task.result() for where, task in asking.items() if task.done()}
        return {
            where: (outcome_status(outcome), explanation(outcome))
            for where, outcome in outcomes.items()
            if not outcome.ok
        }

    async def _ask(self, identity: Identity, where: ua.NodeId) -> Outcome:
        node = self._parameter(where)
        assert node, "wanted"
        owner, _, leaf = node.point.name.rpartition("/")
        target = owner.rpartition("/")[0]
        return await ask(self._view, Request(identity, target, ReadParameter(leaf)))
