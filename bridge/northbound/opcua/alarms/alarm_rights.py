"""Rights to the bridge's alarms, and the effect of an acknowledgement on a drive."""

from __future__ import annotations

import logging
from collections.abc import Mapping
from typing import Final

from bridge.command.messages.request import Action, Code, Request, Role, command_of
from bridge.northbound.opcua.alarms.alarm_nodes import Alarm
from bridge.northbound.opcua.requests.session_user import SessionUser
from bridge.northbound.opcua.requests.writes import ask
from bridge.northbound.opcua.space.data_values import outcome_status, rejection
from bridge.northbound.opcua.space.nodes import pascal_case
from bridge.northbound.view import View
from bridge.uaserver.library import StatusCodes, ua

LEAST_ROLE: Final[Mapping[str, Role]] = {
    **dict.fromkeys(
        ("AddComment", "Acknowledge", "Confirm", "TimedShelve", "OneShotShelve", "Unshelve"), Role.OPERATOR
    ),
    **dict.fromkeys(("Enable", "Disable"), Role.ENGINEER),
}
"""The role that a method of an alarm needs."""
_log = logging.getLogger(__name__)


class AlarmRights:
    """Owner of the conditions. With ``resets`` an acknowledgement resets the fault of a drive; ``alarms`` are
    by their NodeIds."""

    def __init__(self, view: View, *, resets: bool) -> None:
        self._view = view
        self._resets = resets
        self.alarms: Mapping[ua.NodeId, Alarm] = {}

    def permits(self, user: SessionUser, method: str) -> bool:
        return user.identity.role >= LEAST_ROLE[method]

    async def acknowledging(self, user: SessionUser, condition: ua.NodeId) -> int:
        alarm = self.alarms[condition]
        if not (self._resets and alarm.place.kind == "drive" and alarm.condition.state.active):
            return StatusCodes.Good
        request = Request(user.identity, alarm.place.owner, command_of(Action.RESET_FAULT))
        outcome = await ask(self._view, request)
        return StatusCodes.Good if outcome.code is Code.OK else outcome_status(outcome).value

    def on_call(self, user: SessionUser, condition: ua.NodeId, method: str, code: int) -> None:
        """Refusals are in the audit log, as those of other calls; what was done is in the log."""
        place = self.alarms[condition].place
        if code:
            action = "".join(f"_{one.lower()}" if one.isupper() else one for one in method).strip("_")
            self._view.rejected(rejection(user.identity, place.owner, action, code, {}))
        else:
            _log.info("alarm of %s: %s by %s", place.owner, pascal_case(method), user.identity)
