"""One client of the door, from its arrival to its departure. Knows no socket."""

from __future__ import annotations

import asyncio
from collections.abc import Awaitable, Callable

from roboglot.extras import explained
from roboglot.hosting.error_text import in_words
from roboglot.protocols.foxglove.channels import Source
from roboglot.protocols.foxglove.context import Context
from roboglot.protocols.foxglove.dispatch import answer
from roboglot.wire.foxglove.messages import Level


class Session:
    """Messages of one client, in order."""

    def __init__(
        self, context: Context, topics: Callable[[], Awaitable[Source]], on_close: Callable[[Session], None]
    ) -> None:
        self.context, self._topics, self._on_close = context, topics, on_close
        self._joining = asyncio.get_running_loop().create_task(self._join(), name="foxglove client")
        self._turn = asyncio.Lock()
        self._gone = False

    async def receive(self, message: str | bytes) -> None:
        """Handle one message; none of a client that left while it waited."""
        async with self._turn:
            if not self._gone:
                await answer(self.context, message)

    def close(self) -> None:
        """Handle the client's departure."""
        self._gone = True
        self._joining.cancel()
        self._on_close(self)
        self.context.close()

    async def _join(self) -> None:
        """Advertise all topics to the client; their modules are loaded in a thread the first time."""
        try:
            with self.context.robot.clock.holding():  # lockstep time does not count how long a library loads
                topics = self.context.topics = await self._topics()
                topics.join(self.context)
        except ModuleNotFoundError as error:
            self.context.status(Level.ERROR, explained(error, "the robot's topics") or str(error))
        except (OSError, ValueError) as error:
            self.context.status(Level.ERROR, f"the recording cannot be read: {in_words(error)}")
        finally:
            self.context.joined.set()
