"""Gives a robot camera, microphone, loudspeaker and what makes sense of them; they work only while used."""

from __future__ import annotations

from roboglot.model.components.interaction.speaker import Speaker
from roboglot.model.components.sensing.camera import Camera
from roboglot.model.components.sensing.hearing import Hearing
from roboglot.model.components.sensing.microphone import Microphone
from roboglot.model.components.sensing.reflectors import Reflectors
from roboglot.model.components.sensing.vision import Vision
from roboglot.model.robot import Robot
from roboglot.simulation.bodies.hull import Hull
from roboglot.simulation.components.interaction.speaker import SimulatedSpeaker
from roboglot.simulation.components.sensing.camera import SimulatedCamera
from roboglot.simulation.components.sensing.hearing import SimulatedHearing
from roboglot.simulation.components.sensing.microphone import SimulatedMicrophone
from roboglot.simulation.components.sensing.reflectors import SimulatedReflectors
from roboglot.simulation.components.sensing.vision import SimulatedVision
from roboglot.simulation.detectors.glance import Surroundings
from roboglot.simulation.rendering.studio import Studio
from roboglot.simulation.sound.sound import Air
from roboglot.simulation.world.randomness import stream


class Senses:
    """Those of them that the robot's body has."""

    def __init__(self, robot: Robot, hull: Hull, studio: Studio, air: Air, around: Surroundings, seed: int) -> None:
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
        self._vision: SimulatedVision | None = None
        if body.vision and self._camera:
            self._vision = SimulatedVision(body.vision, robot, self._camera, hull, around, seed)
            robot.add(Vision, self._vision)
        self._hearing: SimulatedHearing | None = None
        if body.hearing and body.microphone:
            self._hearing = SimulatedHearing(robot, hull, air, body.microphone.noise)
            robot.add(Hearing, self._hearing)
        self._reflectors: SimulatedReflectors | None = None
        if body.reflectors and body.lidar:
            self._reflectors = SimulatedReflectors(hull, body.lidar.above_belly, around.world, robot)
            robot.add(Reflectors, self._reflectors)

    def close(self) -> None:
        """Nobody sees or hears any more."""
        for part in (self._vision, self._hearing, self._reflectors, self._camera, self._microphone):
            if part:
                part.close()
