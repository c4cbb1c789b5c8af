"""Subscriptions to topics."""

from __future__ import annotations

import msgspec

from roboglot.model.errors import InvalidGoal, NotFound
from roboglot.operations import Right
from roboglot.protocols.foxglove.context import Context
from roboglot.protocols.foxglove.table import TABLE

SUBSCRIPTIONS_MAX = 500
NUMBER_MAX = (1 << 32) - 1


class Subscription(msgspec.Struct, rename="camel"):
    """The client's number for messages of a channel."""

    id: int
    channel_id: int


@TABLE.on("subscribe", right=Right.SEE)
async def subscribe(context: Context, *, subscriptions: list[Subscription]) -> None:
    """Subscribe to topics; those that hold a state send their last message at once."""
    topics = context.topics
    known = {channel.id for channel in topics.channels} if topics is not None else set()
    for request in subscriptions:
        if request.channel_id not in known or topics is None:
            raise NotFound(f"there is no channel {request.channel_id}")
        if not 0 <= request.id <= NUMBER_MAX or request.id in context.subscriptions.values():
            raise InvalidGoal(f"a subscription cannot have the number {request.id}, or has it already")
        if request.channel_id in context.subscriptions:
            raise InvalidGoal(f"channel {request.channel_id} is subscribed to already")
        if len(context.subscriptions) >= SUBSCRIPTIONS_MAX:
            raise InvalidGoal(f"more than {SUBSCRIPTIONS_MAX} subscriptions")
        context.subscriptions[request.channel_id] = request.id
        topics.show_last(context, request.channel_id, request.id)
    if topics is not None:
        topics.look_at_camera()


@TABLE.on("unsubscribe", right=Right.SEE)
async def unsubscribe(context: Context, *, subscription_ids: list[int]) -> None:
    """Unsubscribe from topics."""
    gone = set(subscription_ids)
    kept = {channel: number for channel, number in context.subscriptions.items() if number not in gone}
    missing = gone - set(context.subscriptions.values())
    context.subscriptions.clear()
    context.subscriptions.update(kept)
    if context.topics is not None:
        context.topics.look_at_camera()
    if missing:
        raise NotFound(f"there is no subscription {min(missing)}")
