"""The action list of the REST door: the vendor's names for the robot's actions, and the last 20 that ended.

Ids are the model's. Actions of other doors are listed too, under the nearest vendor name, since a client has to see
what the robot is doing.
"""

from __future__ import annotations

from roboglot.model.actions import HISTORY_MAX, Action, ActionStatus
from roboglot.model.components.motion.driving import BASE
from roboglot.model.components.system.lease import ERRAND
from roboglot.model.errors import NotFound
from roboglot.model.robot import Robot
from roboglot.protocols.slamware.chapters.motion.errands import PART
from roboglot.protocols.slamware.vocabulary import action_word, stage_of, state_of
from roboglot.wire.slamware.chapters.motion import ActionGravestone, ActionInfo

# Names of the skills' own actions; all others are manual driving.
FOREIGN = {
    "dock at mark": "MoveToTagAction",
    "back off from mark": "BackOffFromTagAction",
    "navigate": "MoveToAction",
    "dock": "GoHomeAction",
    "sweep": "SweepAction",
    "ride": "MultiFloorMoveAction",
}


class ActionBook:
    """Book of actions, with the names under which clients requested them."""

    def __init__(self, robot: Robot, prefix: str) -> None:
        self._robot = robot
        self.prefix = prefix  # of action names that the robot chooses itself
        self._named: dict[int, tuple[str, Action]] = {}

    def enter(self, name: str, action: Action) -> ActionInfo:
        """Record that ``action`` was requested as ``name``."""
        self._named[action.id] = (name, action)
        ended = [id for id, (_, known) in self._named.items() if known.status.ended]
        for id in ended[: max(0, len(ended) - HISTORY_MAX)]:
            del self._named[id]
        return self._info(action)

    @property
    def current(self) -> Action | None:
        """Return the errand under way, or else the latest action that holds the base; last, an errand that ends."""
        errands = self._robot.actions.running(ERRAND)
        going = [errand for errand in errands if errand.status is not ActionStatus.CANCELING]
        driving = [action for action in self._robot.actions.running(BASE) if action.source != PART]
        found = going or driving or errands
        return found[-1] if found else None

    def current_info(self) -> ActionInfo:
        """Return the current action. Raises NotFound."""
        if (action := self.current) is None:
            raise NotFound("Action Not Found")
        return self._info(action)

    def look_up(self, id: int) -> ActionInfo | ActionGravestone:
        """Return an action under way or one of the last 20. Raises NotFound."""
        _, action = self._named.get(id, ("", None))
        if action is None:
            action = self._robot.actions.get(id)
        return ActionGravestone(action.id, state_of(action)) if action.status.ended else self._info(action)

    def abort(self) -> None:
        """Cancel all motion of the robot, by any client; it starts braking."""
        actions = self._robot.actions
        for action in [*actions.running(ERRAND), *actions.running(BASE)]:
            action.cancel("aborted by a client")

    def name_of(self, action: Action) -> str:
        """Return the requested name of an action, or the nearest vendor name."""
        name, _ = self._named.get(action.id, (self.prefix + _vendor_word(action.name), action))
        return name

    def _info(self, action: Action) -> ActionInfo:
        name = self.name_of(action)
        going_home = action_word(name) in ("GoHomeAction", "MultiFloorBackHomeAction")
        return ActionInfo(action.id, name, stage_of(action, going_home=going_home), state_of(action))


def _vendor_word(name: str) -> str:
    return next((word for key, word in FOREIGN.items() if key in name), "MoveByAction")
