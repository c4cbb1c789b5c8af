"""Docking on the simulated robot."""

from __future__ import annotations

from typing import TYPE_CHECKING

import pytest

from roboglot.model.actions import ActionStatus
from roboglot.model.components.energy.battery import Battery, DockContact
from roboglot.model.components.mapping.localization import Localization
from roboglot.model.components.mapping.mapping import Mapping
from roboglot.model.components.motion.docking import Docking
from roboglot.model.components.motion.driving import Driving
from roboglot.model.errors import DockNotFound
from roboglot.model.events import ActionChanged, Rebooted
from roboglot.model.geometry import ORIGIN, Pose

if TYPE_CHECKING:
    from tests.autonomy.conftest import Tour


@pytest.mark.slow  # in short: test_go_home of tests/protocols/slamware/motion
@pytest.mark.world("office", seed=3)
async def test_it_finds_back_to_its_dock(tour: Tour) -> None:
    docking, reported, charging = tour.robot[Docking], [], []
    assert docking.home == ORIGIN
    await tour.go((14.0, 10.0))
    assert not tour.robot[DockContact].docked

    def watch(event: ActionChanged) -> None:
        reported.append(event.action.feedback)
        if event.action.status is ActionStatus.SUCCEEDED:
            charging.append(tour.robot[Battery].state.dock_charging)

    tour.robot.events.listen(ActionChanged, watch)
    action = await tour.end_of(docking.dock())
    assert charging == [True]  # in the same instant
    assert action.status is ActionStatus.SUCCEEDED, action.reason
    assert tour.robot[DockContact].docked
    assert tour.truth.distance_to(tour.start) < 0.04
    assert list(dict.fromkeys(reported)) == [None, "approaching", "docking", "docked"]


@pytest.mark.world("empty")
async def test_on_the_dock_there_is_nothing_to_do(tour: Tour) -> None:
    action = await tour.end_of(tour.robot[Docking].dock())
    assert action.status is ActionStatus.SUCCEEDED
    assert tour.truth.distance_to(tour.start) < 0.005


@pytest.mark.slow  # in short: test_an_unknown_dock_far_away_is_reported
@pytest.mark.world("empty")
async def test_no_dock_is_found_in_an_empty_place(tour: Tour) -> None:
    await tour.go((5.0, 5.0))
    tour.robot[Docking].set_home(Pose(*_xy(tour, 5.0, 7.0), 1.0))
    action = await tour.end_of(tour.robot[Docking].dock())
    assert isinstance(action.error, DockNotFound)


@pytest.mark.world("empty")
async def test_home_stays_when_the_map_begins_anew(tour: Tour) -> None:
    await tour.end_of(tour.robot[Driving].move_by(Pose(2.0, 1.0, 2.0)))
    tour.robot[Mapping].clear()
    await tour.clock.advance(1.0)
    home = tour.robot[Docking].home
    assert home is not None
    assert tour.truth.compose(home).distance_to(tour.start) < 0.05
    action = await tour.end_of(tour.robot[Docking].dock())
    assert action.status is ActionStatus.SUCCEEDED, action.reason
    assert tour.robot[DockContact].docked


@pytest.mark.world("empty")
async def test_docking_can_be_cancelled(tour: Tour) -> None:
    await tour.end_of(tour.robot[Driving].move_by(Pose(0.7, 0.0, 0.0)))
    action = tour.robot[Docking].dock()
    await tour.until(lambda: action.feedback == "docking")
    action.cancel()
    await tour.clock.advance(1.0)
    assert action.status is ActionStatus.CANCELED
    assert not tour.robot[DockContact].docked


def _xy(tour: Tour, x: float, y: float) -> tuple[float, float]:
    point = tour.on_map(x, y)
    return point.x, point.y


@pytest.mark.parametrize("aside", [0.28, pytest.param(-0.28, marks=pytest.mark.slow)])
@pytest.mark.world("office")
async def test_dock_that_was_moved_a_little_is_found(tour: Tour, aside: float) -> None:
    await tour.go((20.0, 10.0))
    front = tour.world.building.docks[0][0]
    tour.world.building.move_dock(front.compose(Pose(0.05, aside, 0.1)), 0, 0)
    docking = tour.robot[Docking]
    action = await tour.end_of(docking.dock())
    assert action.status is ActionStatus.SUCCEEDED, action.reason
    assert abs(tour.truth.relative_to(tour.start).y - aside) < 0.05
    assert docking.home is not None
    assert tour.start.compose(docking.home).distance_to(tour.truth) < 0.05  # learned again


@pytest.mark.world("office")
async def test_undocking_leaves_contacts_and_dock_is_found_again(tour: Tour) -> None:
    docking = tour.robot[Docking]
    action = await tour.end_of(docking.undock())
    assert action.status is ActionStatus.SUCCEEDED, action.reason
    assert not tour.robot[DockContact].docked
    assert 0.4 < tour.truth.relative_to(tour.start).x < 0.6
    again = tour.truth
    assert (await tour.end_of(docking.undock())).status is ActionStatus.SUCCEEDED
    assert tour.truth.distance_to(again) < 0.01
    assert (await tour.end_of(docking.dock())).status is ActionStatus.SUCCEEDED


@pytest.mark.slow  # in short: test_dock_that_was_moved_a_little_is_found
@pytest.mark.world("office")
async def test_an_unknown_dock_is_found_nearby(tour: Tour) -> None:
    docking = tour.robot[Docking]
    await tour.end_of(docking.undock())
    await tour.end_of(tour.robot[Driving].move_by(Pose(0.6, 0.3, 0.5)))
    docking.set_home(None)
    action = await tour.end_of(docking.dock())
    assert action.status is ActionStatus.SUCCEEDED, action.reason
    assert tour.truth.distance_to(tour.start) < 0.04
    assert docking.home is not None
    assert tour.start.compose(docking.home).distance_to(tour.truth) < 0.05


@pytest.mark.world("empty")
async def test_an_unknown_dock_far_away_is_reported(tour: Tour) -> None:
    await tour.go((6.0, 5.0))
    tour.robot[Docking].set_home(None)
    action = await tour.end_of(tour.robot[Docking].dock())
    assert isinstance(action.error, DockNotFound)
    assert "sees none within" in action.reason


@pytest.mark.world("office")
async def test_docked_robot_that_finds_itself_knows_its_dock(tour: Tour) -> None:
    mapping, docking = tour.robot[Mapping], tour.robot[Docking]
    await tour.clock.advance(1.0)
    mapping.load(mapping.grid, Pose(3.0, 1.0, 0.5))  # away from its true place
    assert (await tour.end_of(tour.robot_finds_itself())).status is ActionStatus.SUCCEEDED
    assert docking.home is not None
    assert tour.start.compose(docking.home).distance_to(tour.truth) < 0.1


@pytest.mark.world("empty")
async def test_docked_robot_knows_its_dock_after_a_restart(tour: Tour) -> None:
    """Another map was loaded, which forgot the dock; a restart begins a new one, as a start does."""
    mapping, docking = tour.robot[Mapping], tour.robot[Docking]
    await tour.clock.advance(1.0)
    mapping.load(mapping.grid, Pose(3.0, 1.0))
    assert docking.home is None
    tour.robot.events.publish(Rebooted(stamp=tour.clock.time()))
    assert docking.home is not None
    assert tour.start.compose(docking.home).distance_to(tour.truth) < 0.05


@pytest.mark.world("office")
async def test_wrong_pose_keeps_dock_and_docking_corrects_it(tour: Tour, monkeypatch: pytest.MonkeyPatch) -> None:
    # scans alone do not determine the place
    monkeypatch.setattr("roboglot.autonomy.slam.recovery.whole_map_search.places", lambda *_: [])
    await tour.clock.advance(1.0)
    for wrong in (Pose(40.0, 40.0), Pose(3.0, 1.0, 0.5)):
        tour.robot[Localization].set_pose(wrong)
        assert tour.robot[Docking].home == ORIGIN
        await tour.clock.advance(4.0)
        assert tour.error[0] < 0.05
        assert tour.robot[Localization].lost is None


@pytest.mark.world("office")
async def test_dock_of_loaded_map_is_learnt_when_localized(tour: Tour, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr("roboglot.autonomy.slam.recovery.whole_map_search.places", lambda *_: [])
    mapping, docking = tour.robot[Mapping], tour.robot[Docking]
    await tour.clock.advance(1.0)
    mapping.load(mapping.grid, Pose(40.0, 40.0))  # away from its true place
    await tour.clock.advance(3.0)
    assert docking.home is None
    assert tour.robot[Localization].lost is not None
    tour.robot[Localization].set_pose(Pose(0.05, 0.05))  # almost
    assert docking.home is None
    await tour.clock.advance(3.0)
    assert docking.home is not None
    assert tour.start.compose(docking.home).distance_to(tour.truth) < 0.05


@pytest.mark.world("office")
async def test_lost_robot_put_on_its_dock_is_localized(tour: Tour, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr("roboglot.autonomy.slam.recovery.whole_map_search.places", lambda *_: [])
    await tour.end_of(tour.robot[Docking].undock())
    tour.robot[Localization].set_pose(Pose(40.0, 40.0))
    await tour.clock.advance(3.0)
    assert tour.robot[Localization].lost is not None
    tour.world.stage.place("a", tour.start)
    await tour.clock.advance(3.0)
    assert tour.robot[Localization].lost is None
    assert tour.error[0] < 0.05
