"""Settings that the robot is told and that count from then on: what follows is sent behind them, so it comes later."""

from __future__ import annotations

from collections.abc import Awaitable, Callable

from roboglot.drivers.supervisor import Keeper


def tell(keeper: Keeper, what: str, command: Callable[[], Awaitable[None]], undo: Callable[[], object]) -> None:
    """Send ``command``; ``undo`` is called if the robot doesn't take it. Raises Unconnected at once without a link."""

    async def send() -> None:
        try:
            await command()
        except BaseException:
            undo()
            raise

    keeper.send(what, send())
