"""The torso of a body on legs: its goal, its way there, and its present state in the physics."""

from __future__ import annotations

from roboglot.model.actions import Action
from roboglot.model.clock import Clock
from roboglot.model.geometry import LEVEL
from roboglot.simulation.bodies.hull import Hull
from roboglot.simulation.bodies.performing import Body, Track
from roboglot.simulation.bodies.walking_body import followed


class Torso:
    """``body``: the set pose without sway; ``taken``: the pose in the physics; ``straight``: the straight stand."""

    def __init__(self, hull: Hull, straight: Body) -> None:
        assert hull.legs is not None, "legs belong to a body that has them"
        self._hull, self._legs = hull, hull.legs
        self.straight = self.body = self.taken = straight
        self.track: Track | None = None

    @property
    def is_straight(self) -> bool:
        """True if the set pose is the straight stand."""
        return self.body == self.straight

    async def follow(self, track: Track, action: Action, clock: Clock, period: float) -> None:
        """Move along ``track``, and wait for its end; never returns if another track takes over."""
        self.track = track
        try:
            await followed(track, action, clock, period)
        finally:
            self.track = None if self.track is track else self.track

    def take(self, body: Body, *, weightless: bool = False) -> None:
        """Hold the torso at ``body`` from now on."""
        self.taken = body
        self._legs.hold(body.height, weightless=weightless)
        # One shared object for a level torso: the IMU asks for it in every tick.
        self._hull.attitude = LEVEL if body.attitude == LEVEL else body.attitude
        self._hull.shift = body.shift

    def put(self, height: float) -> None:
        """Set the torso's height (m) at once."""
        self._legs.put(height)
        self._hull.look()

    def let_sink(self) -> None:
        """Release the torso, which sinks."""
        self._legs.hold(None)
