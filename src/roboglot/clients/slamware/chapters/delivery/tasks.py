"""Chapter "delivery": its operations as typed methods. Units and frames as the robot has them: m, rad, map."""

# mypy: disable-error-code="empty-body"
# The bodies are made by @call from the signatures.

from __future__ import annotations

from roboglot.clients.slamware.calls import Chapter, call
from roboglot.wire.slamware.chapters.delivery import (
    DeliveryTask,
    TaskCreated,
    TaskExecution,
    TaskRequest,
    TasksCreated,
    TaskStage,
)


class Tasks(Chapter):
    """Chapter "delivery"."""

    @call("GET /api/delivery/v1/tasks")
    async def get_tasks(self, type: str | None = None, status: str | None = None) -> list[DeliveryTask]:
        """List ready and running tasks, oldest first; with ``status`` "all" also ended ones."""

    @call("POST /api/delivery/v1/tasks")
    async def create_task(self, body: TaskRequest) -> TaskCreated:
        """Queue a task; objections are returned with ``result`` false."""

    @call("DELETE /api/delivery/v1/tasks")
    async def cancel_all_tasks(self) -> None:
        """Cancel all tasks; the robot brakes and rests."""

    @call("POST /api/delivery/v1/tasks/:batch")
    async def create_tasks(self, body: list[TaskRequest]) -> TasksCreated:
        """Queue several, all or none."""

    @call("DELETE /api/delivery/v1/tasks/{task_id}")
    async def cancel_task_by_task_id(self, task_id: str) -> None:
        """Cancel one task; 404 if unknown."""

    @call("DELETE /api/delivery/v1/tasks/orders/{order_id}")
    async def cancel_task_by_order_id(self, order_id: str) -> None:
        """Cancel one task by the order id from its creation; 404 if unknown."""

    @call("GET /api/delivery/v1/stage")
    async def get_stage(self) -> TaskStage:
        """Return the current stage: a fault that stops the robot, else the task, else the way to its rest."""

    @call("PUT /api/delivery/v1/tasks/:task_execution")
    async def set_task_execution(self, body: TaskExecution | None = None) -> TaskExecution:
        """Pause (False, while people use the screen) or resume tasks; without a task the robot goes to its rest."""

    @call("PUT /api/delivery/v1/tasks/:task_finish")
    async def end_task(self) -> None:
        """End all tasks as succeeded."""

    @call("PUT /api/delivery/v1/tasks/:start_pickup")
    async def start_pickup(self) -> None:
        """Begin a pickup; 403 unless the robot stands at the target."""

    @call("PUT /api/delivery/v1/tasks/:end_pickup")
    async def end_pickup(self) -> None:
        """Close the current box and open the next one; 403 without a pickup."""

    @call("PUT /api/delivery/v1/tasks/:end_operation")
    async def end_operation(self) -> None:
        """Let the task leave its current point; 403 unless the robot stands at one."""
