"""Maps a recorded drive with the robots' estimator. Needs the kernels."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from time import thread_time

from roboglot.autonomy.slam.belief import Belief
from roboglot.autonomy.slam.slam import Slam
from roboglot.autonomy.slam.trajectory import TrajectoryPoint
from roboglot.datasets.drive_log import DriveLog
from roboglot.datasets.replay import Replay
from roboglot.model.clock import LockstepClock
from roboglot.model.events import Event, LocalizationLost, LocalizationRecovered, LoopClosed
from roboglot.model.maps import OccupancyGrid
from roboglot.model.robot import Description, Robot
from roboglot.values import dataclass

RADIUS = 0.3  # m, for a robot of unknown hull


@dataclass(frozen=True, slots=True)
class MappedDrive:
    """Result of a replay; processor ``seconds`` and ``qualities`` (0..1) of each scan, ``news``: its events.

    ``noise``: learnt noise of odometry's way and yaw, as multiples of the assumed one.
    """

    grid: OccupancyGrid
    trajectory: Sequence[TrajectoryPoint]
    seconds: Sequence[float]
    qualities: Sequence[float]
    news: Sequence[Event]
    noise: tuple[float, float]

    def count(self, kind: type[Event]) -> int:
        """Return the number of events of one kind."""
        return sum(isinstance(event, kind) for event in self.news)


def map_recording(recording: DriveLog, progress: Callable[[int], None] = lambda _done: None) -> MappedDrive:
    """Return the map of ``recording``; ``progress`` is called with the number of scans played."""
    plate = Description(
        maker="", model="recording", serial="", hardware_version="", software_version="", radius=RADIUS, height=RADIUS
    )
    robot = Robot(id="recording", description=plate, clock=LockstepClock())
    replay, news = Replay(robot.events), list[Event]()
    belief = Belief(replay.odometry)
    for kind in (LoopClosed, LocalizationLost, LocalizationRecovered):
        robot.events.listen(kind, news.append)
    slam = Slam(robot, belief)
    seconds, qualities = [], []
    for done, recorded in enumerate(recording.scans, 1):
        began = thread_time()
        replay.play(recorded)
        seconds.append(thread_time() - began)
        qualities.append(belief.quality)
        progress(done)
    slam.settle()
    slam.close()
    return MappedDrive(belief.map.occupancy(), slam.trajectory(), seconds, qualities, news, slam.odometry.noise.factors)
