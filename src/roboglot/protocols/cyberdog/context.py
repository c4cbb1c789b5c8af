"""State of this door for one robot while it is open: the app, the motion, the task, the chapters' own states."""

from __future__ import annotations

from dataclasses import field

from roboglot.model.robot import Robot
from roboglot.protocols.cyberdog.app_link import AppLink
from roboglot.protocols.cyberdog.chapters.camera.camera_files import CameraFiles
from roboglot.protocols.cyberdog.chapters.camera.transfers import Transfers
from roboglot.protocols.cyberdog.chapters.camera.transmission import Transmission
from roboglot.protocols.cyberdog.chapters.mapping.reports import MapReports
from roboglot.protocols.cyberdog.chapters.mapping.survey import Survey
from roboglot.protocols.cyberdog.chapters.mapping.task_state import Tasks
from roboglot.protocols.cyberdog.chapters.motion.gait import Gaits
from roboglot.protocols.cyberdog.chapters.people.face_recognition import Faces
from roboglot.protocols.cyberdog.chapters.people.pursuit import Pursuit, ThingPursuit
from roboglot.protocols.cyberdog.chapters.people.voice import Voice
from roboglot.protocols.cyberdog.chapters.system.bracelet import Bracelet
from roboglot.protocols.cyberdog.chapters.system.update_jobs import UpdateJobs
from roboglot.protocols.cyberdog.chapters.system.updates import Updates
from roboglot.protocols.cyberdog.frame_queue import FrameQueue
from roboglot.protocols.cyberdog.profile import Profile
from roboglot.protocols.cyberdog.recorded_pushes import PlayedPushes
from roboglot.values import dataclass
from roboglot.wire.visual.relay import FrameRelay


@dataclass(slots=True)
class Context:
    """Context of every handler. ``stored_map``: name under which the current map was saved, if it was."""

    robot: Robot
    app: AppLink
    gaits: Gaits
    tasks: Tasks
    reports: MapReports
    voice: Voice
    faces: Faces
    bracelet: Bracelet
    updates: Updates
    jobs: UpdateJobs
    files: CameraFiles
    transfers: Transfers
    video: Transmission
    address: str  # the robot's address for clients
    relay: FrameRelay | None = None
    frames: FrameQueue | None = None  # frames of programs, queued for the app
    played: PlayedPushes | None = None  # pushes of a recorded robot
    stored_map: str = ""
    map_deleted: bool = False  # the map in use was deleted: do not let it replace a missing stored map
    profile: Profile = Profile.SPEC
    owner: str = ""  # the app's identity, where one is required
    survey: Survey = field(default_factory=Survey)  # of the map being made
    pursuit: Pursuit | ThingPursuit | None = None  # while a person or an object is followed or to be chosen

    def map_replaced(self) -> None:
        """Handle a change of the map by any client: neither its name nor localization in it is known."""
        self.stored_map, self.map_deleted = "", False
        self.tasks.leave()

    def map_gone(self) -> None:
        """Handle the deletion of the current map."""
        self.stored_map, self.map_deleted = "", True
        self.tasks.leave()

    async def close(self) -> None:
        """End the chapters' work, then the app's link."""
        await self.tasks.close()
        self.gaits.close()
        self.voice.close()
        self.faces.close()
        self.bracelet.close()
        self.jobs.close()
        self.updates.close()
        await self.video.close()
        await self.transfers.close()
        await self.reports.close()
        await self.app.close()
