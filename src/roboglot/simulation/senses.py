"""Gives a robot its camera, microphone and loudspeaker, which run on their own beats and only while used."""

from __future__ import annotations

from roboglot.model.components.camera import Camera
from roboglot.model.components.microphone import Microphone
from roboglot.model.components.speaker import Speaker
from roboglot.model.robot import Robot
from roboglot.simulation.camera_studio import Studio
from roboglot.simulation.components.camera import SimulatedCamera
from roboglot.simulation.components.microphone import SimulatedMicrophone
from roboglot.simulation.components.speaker import SimulatedSpeaker
from roboglot.simulation.hull import Hull
from roboglot.simulation.randomness import stream
from roboglot.simulation.sound import Air


class Senses:
    """Those of them that the robot's body has."""

    def __init__(self, robot: Robot, hull: Hull, studio: Studio, air: Air, seed: int) -> None:
        body = hull.body
        self._camera = SimulatedCamera(body.camera, hull, studio, robot.clock) if body.camera else None
        chance = stream(seed, robot.id, "microphone")
        self._microphone: SimulatedMicrophone | None = None
        if body.microphone:
            self._microphone = SimulatedMicrophone(body.microphone, hull, air, robot.clock, chance)
        if self._camera:
            robot.add(Camera, self._camera)
        if self._microphone:
            robot.add(Microphone, self._microphone)
        if body.speaker:
            robot.add(Speaker, SimulatedSpeaker(body.speaker, hull, air, robot))

    def close(self) -> None:
        """Nobody sees or hears any more."""
        for part in (self._camera, self._microphone):
            if part:
                part.close()
