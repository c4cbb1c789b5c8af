"""Components of a CyberDog and where they are only approximate. Source of the capability page."""

from __future__ import annotations

from roboglot.media.recorder import Recorder
from roboglot.media.video import VideoStream
from roboglot.model.components.component import Component
from roboglot.model.components.energy.battery import Battery, DockContact
from roboglot.model.components.energy.power import Power
from roboglot.model.components.interaction.skin import ElectronicSkin
from roboglot.model.components.interaction.speaker import Speaker
from roboglot.model.components.mapping.localization import Localization
from roboglot.model.components.mapping.mapping import Mapping
from roboglot.model.components.motion.base import Base
from roboglot.model.components.motion.docking import Docking
from roboglot.model.components.motion.driving import Driving
from roboglot.model.components.motion.following import Following
from roboglot.model.components.motion.legs import Legs
from roboglot.model.components.motion.motors import Motors
from roboglot.model.components.motion.navigation import Navigation
from roboglot.model.components.motion.stair_alignment import StairAlignment
from roboglot.model.components.sensing.camera import Camera
from roboglot.model.components.sensing.lidar import Lidar
from roboglot.model.components.sensing.odometry import Odometry
from roboglot.model.components.system.health import Health
from roboglot.model.components.system.link import Link
from roboglot.model.components.system.network import Network

# Component to a plain description of what is approximate about it; empty if exact.
APPROXIMATIONS: dict[type[Component], str] = {
    Base: "servo frames of the slow trot or the gait chosen; velocity as commanded, single wheels are refused",
    Legs: "how the body is held is what was commanded; a motion that has begun ends by itself; no own choreographies",
    Driving: "ours, over that odometry",
    Odometry: "what was commanded, set right five times a second by the pose while the dog is localized",
    Lidar: "only while the dog is localized or navigates, and only what came back",
    Battery: "volts, temperature and capacity are up to 2 s old; no current and no cycles",
    Motors: "temperatures are up to 2 s old",
    Network: "up to 2 s old; its Wi-Fi cannot be set through its app's protocol",
    Speaker: "speaks by a program of one line; plays no sounds",
    ElectronicSkin: "set at every connection, at first dark; shows what was commanded, no patches of the legs",
    Camera: "single pictures are its photos; its mount and angle are those of a dog that stands",
    VideoStream: "re-encoded",
    Recorder: "",
    Power: "low power, where it goes by itself alone; no sleep; restarts at once or not at all",
    DockContact: "charging without a wire",
    Localization: "five poses a second while the dog is localized; its pose cannot be set",
    Mapping: "the map as the app sees it, with three kinds of cells; it can be read alone",
    Navigation: "by the dog's own skill and speed, goal by goal, stopped only after a lost link is back; no plans",
    Docking: "by the dog's own skill; the place of its dock is not reported",
    Following: "by the dog's own skill; people in sight are reported only while it runs, so the nearest is followed",
    StairAlignment: "by the dog's own skill; ends when the dog stands still; its result is not reported",
    Health: "only the state of the link",
    Link: "",
}
