"""Chapter "motion": its operations as typed methods. Units and frames as the robot has them: m, rad, map."""

# mypy: disable-error-code="empty-body"
# The bodies are made by @call from the signatures.

from __future__ import annotations

from roboglot.clients.slamware.calls import Chapter, call
from roboglot.clients.slamware.values import ActionReport
from roboglot.wire.slamware.chapters.motion import (
    ActionFactory,
    ActionInfo,
    ActionRequest,
    PathPoints,
    PathQuery,
    Speed,
    Strategy,
)


class Motion(Chapter):
    """Chapter "motion"."""

    @call("GET /api/core/motion/v1/action-factories")
    async def get_action_factories(self) -> list[ActionFactory]:
        """Return the kinds of action that this robot can do."""

    @call("GET /api/core/motion/v1/actions/:current")
    async def get_current_action(self) -> ActionInfo:
        """Return the current action; 404 without one."""

    @call("DELETE /api/core/motion/v1/actions/:current")
    async def abort_current_action(self) -> None:
        """Stop the motion of any client; succeeds even if nothing moves."""

    @call("POST /api/core/motion/v1/actions")
    async def create_action(self, body: ActionRequest) -> ActionInfo:
        """Start an action in place of the current one; 400 for unknown or invalid actions."""

    @call("GET /api/core/motion/v1/actions/{action_id}")
    async def get_action_result(self, action_id: int) -> ActionReport:
        """Return a running action or the result of one of the last 20; 404 otherwise."""

    @call("GET /api/core/motion/v1/path")
    async def get_remaining_path(self) -> PathPoints:
        """Return the remaining path; empty without a goal."""

    @call("GET /api/core/motion/v1/milestones")
    async def get_remaining_milestones(self) -> PathPoints:
        """Return the remaining goals."""

    @call("GET /api/core/motion/v1/speed")
    async def get_current_speed(self) -> Speed:
        """Return the velocity by odometry."""

    @call("GET /api/core/motion/v1/time")
    async def get_remaining_time(self) -> float:
        """Return the remaining time to the goal, s; 0 without a goal."""

    @call("POST /api/core/motion/v1/:search_path")
    async def search_path(self, body: PathQuery) -> PathPoints:
        """Return the path that the robot would take to a target, without moving; empty if there is none."""

    @call("GET /api/core/motion/v1/strategies")
    async def get_motion_strategies(self) -> list[str]:
        """List all."""

    @call("GET /api/core/motion/v1/strategies/:current")
    async def get_current_strategy(self) -> str:
        """Return the current strategy."""

    @call("PUT /api/core/motion/v1/strategies/:current")
    async def set_current_strategy(self, body: Strategy) -> bool:
        """Use another one for future actions; 400 for an unknown name."""
