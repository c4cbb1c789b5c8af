"""Heartbeat of a tunnel: times of beats, and the meaning of silence. Knows no clock and no socket."""

from __future__ import annotations

from typing import NamedTuple

PING_PERIOD = 0.1  # s
IDLE_PERIOD = 0.05  # s between two checks while no one drives
QUICK_PERIOD = 0.0125  # s between heartbeats while the client drives: later ones reveal a packet that TCP lost
QUICK_SECONDS = 0.5  # for which an end keeps this up after the other has stopped
QUIET_AFTER = 0.3  # s of silence after which the client counts as gone: all that it drives by hand stops
QUIET_ALONE_AFTER = 1.0  # s of silence of the tunnel itself that its separate heartbeats excuse: data is late
QUIET_LOOKS = 3  # in a row: the loop has read its sockets between them, in any order
HELD_UP = 0.1  # s between two checks: this end was held up, and the other may have been too, so it may speak first
LOST_AFTER = 5.0  # s of silence that the tunnel and its connections survive: lossy lines recover


class Look(NamedTuple):
    """Decision at one moment, and the seconds until the next look."""

    beat: bool
    quiet: bool
    lost: bool
    pause: float


class Heartbeat:
    """Call ``note_life`` for all that is received, and ``look`` again after each look's pause. Times in s."""

    def __init__(self, now: float) -> None:
        self.heard = self._heard_beside = self._looked = now
        self.quick_until = 0.0
        """Time until which the other end wants quick heartbeats."""
        self._said = now - PING_PERIOD
        self._patient_until = 0.0
        self._looks = 0  # in a row in which the other end was silent

    def note_life(self, now: float, *, quick: bool = False) -> None:
        """Note a sign of life of the other end; ``quick``: it wants quick beats."""
        self.heard = now
        if quick:
            self.quick_until = now + QUICK_SECONDS

    def note_life_beside(self, now: float) -> None:
        """Note a sign of life on the second connection."""
        self._heard_beside = now

    def look(self, now: float, drives: bool) -> Look:
        """Return the decision at ``now``; ``drives``: the client moves the robot."""
        quick = drives or now < self.quick_until
        beat = quick or now - self._said >= PING_PERIOD
        if beat:
            self._said = now
        if now - self._looked > HELD_UP:
            self._patient_until = now + QUICK_PERIOD
        self._looked = now
        alone = now - self.heard
        silent = max(now - max(self.heard, self._heard_beside), alone - QUIET_ALONE_AFTER + QUIET_AFTER)
        self._looks = self._looks + 1 if silent >= QUIET_AFTER and now >= self._patient_until else 0
        pause = QUICK_PERIOD if quick else IDLE_PERIOD
        if 0 < self._looks < QUIET_LOOKS:
            pause = 0.0
        elif silent < QUIET_AFTER:
            pause = min(pause, QUIET_AFTER - silent)
        return Look(beat, self._looks == QUIET_LOOKS, alone >= LOST_AFTER, pause)
