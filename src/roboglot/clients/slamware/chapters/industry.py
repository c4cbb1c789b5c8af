"""Chapter "industry": its operations as typed methods. Units and frames as the robot has them: m, rad, map."""

# mypy: disable-error-code="empty-body"
# The bodies are made by @call from the signatures.

from __future__ import annotations

from roboglot.clients.slamware.calls import Chapter, call
from roboglot.wire.slamware.chapters.industry import (
    CommonResponse,
    IndustryTask,
    LandingPose,
    LandingRequest,
    TaskEvent,
    TaskTemplate,
    TemplateRequest,
)


class Industry(Chapter):
    """Chapter "industry"."""

    @call("POST /api/industry/v1/tasks/templates")
    async def create_task_template(self, body: TemplateRequest) -> TaskTemplate:
        """Store a template, in place of one with the same key; 404 for a place that is not on the map."""

    @call("GET /api/industry/v1/tasks/templates")
    async def get_task_templates(self) -> list[TaskTemplate]:
        """List them in order of creation."""

    @call("DELETE /api/industry/v1/tasks/templates/{key_id}")
    async def delete_task_template(self, key_id: str) -> CommonResponse:
        """Delete a template; 404 if there is none."""

    @call("GET /api/industry/v1/tasks")
    async def get_industry_tasks(self, type: str | None = None, status: str | None = None) -> list[IndustryTask]:
        """List ready and running tasks, oldest first; with ``status`` "all" also ended ones."""

    @call("POST /api/industry/v1/tasks/events")
    async def post_task_event(self, body: TaskEvent) -> None:
        """Report the progress of a call that the client carries out; 404 for an unknown call, 403 for an ended one."""

    @call("POST /api/industry/v1/generate_landing_pose")
    async def generate_landing_pose(self, body: LandingRequest) -> LandingPose:
        """Return the robot's pose and a landing point at the given distance ahead of it; beyond the manual."""
