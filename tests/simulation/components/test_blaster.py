"""Beads: where they land, which plates they hit, how many there are."""

import math
from itertools import pairwise

import pytest
from msgspec import structs

from roboglot.model.components.interaction.armor import Armor, HitKind, PlatePlace
from roboglot.model.components.interaction.blaster import Blaster
from roboglot.model.components.motion.base import Base
from roboglot.model.components.motion.gimbal import FollowMode, Gimbal
from roboglot.model.errors import Busy, InvalidGoal, NotFound, Refused
from roboglot.model.events import ArmorHit, BeadFired, BumperPressed
from roboglot.model.geometry import Pose, Twist, Vector3


@pytest.fixture
async def duel(simulate):
    """``a`` at (3, 5) looks along x at ``b``, 2 m ahead, which looks back."""
    sim = simulate(start=Pose(3, 5), robots=("a", "b"), body="robomaster_ep")
    sim.world.stage.place("b", Pose(5, 5, math.pi))
    sim.world.start()
    sim.robot[Gimbal].set_mode(FollowMode.FREE)
    sim.hits = sim.robots["b"].events.subscribe(ArmorHit)
    await sim.clock.advance(0.1)
    yield sim
    sim.hits.close()


async def shoot(sim, **aim):
    await aim_at(sim, **aim)
    sim.robot[Blaster].fire()
    await sim.clock.advance(0.5)
    return [(hit.place, hit.kind) for hit in sim.hits.drain()]


async def aim_at(sim, **aim):
    sim.robot[Gimbal].move_to(**aim)
    await sim.clock.advance(1.0)


MUZZLE, PLATE, DISTANCE = 0.20, 0.09, 2.0 - 0.175 - 0.10  # heights above the floor, way from muzzle to plate


async def test_bead_hits_plate_that_it_is_aimed_at(duel):
    drop = 9.81 * (DISTANCE / 26) ** 2 / 2
    down = math.atan2(MUZZLE - PLATE - drop, DISTANCE + 0.1)
    assert await shoot(duel, pitch=down) == [(PlatePlace.FRONT, HitKind.BEAD)]
    assert duel.world.truth.bead_landings[-1].what == "b front"
    assert duel.world.truth.bead_landings[-1].z == pytest.approx(PLATE, abs=0.02)


async def test_above_the_plate_it_misses(duel):
    assert await shoot(duel, pitch=-0.02) == []
    assert duel.world.truth.bead_landings[-1].x > 5.1  # it flew over the deck, between the gimbal's plates


async def test_beside_it_lands_on_the_wall(duel):
    assert await shoot(duel, pitch=-0.1, yaw=0.3) == []
    landing = duel.world.truth.bead_landings[-1]
    assert landing.what.startswith("wall")
    assert (landing.x, landing.y) == (pytest.approx(10.0, abs=0.01), pytest.approx(5 + 7 * math.tan(0.3), abs=0.15))
    way = (10 - 3) / math.cos(0.3) - 0.1 * math.cos(0.1)
    time = way / (26 * math.cos(0.1))
    assert landing.z == pytest.approx(MUZZLE + (way + 0.1) * math.tan(0.1) - 9.81 * time**2 / 2, abs=0.08)


@pytest.mark.parametrize(
    ("yaw", "place"),
    [(math.pi / 2, PlatePlace.LEFT), (-math.pi / 2, PlatePlace.RIGHT), (0.0, PlatePlace.REAR)],
)
async def test_hit_plate_depends_on_the_target_s_heading(duel, yaw, place):
    duel.world.stage.place("b", Pose(5, 5, yaw))
    await duel.clock.advance(0.1)
    assert await shoot(duel, pitch=math.atan2(MUZZLE - PLATE, DISTANCE + 0.1)) == [(place, HitKind.BEAD)]


async def test_the_gimbals_plates_turn_with_the_gimbal(duel):
    other = duel.robots["b"][Gimbal]
    other.set_mode(FollowMode.FREE)
    other.move_to(yaw=math.pi / 2)  # its right side faces the shooter
    await duel.clock.advance(1.0)
    assert await shoot(duel, pitch=-0.015) == [(PlatePlace.GIMBAL_RIGHT, HitKind.BEAD)]


async def test_an_insensitive_plate_feels_beads_no_more(duel):
    duel.robots["b"][Armor].set_sensitivity(0)
    aim = math.atan2(MUZZLE - PLATE, DISTANCE + 0.1)
    assert await shoot(duel, pitch=aim) == [(PlatePlace.FRONT, HitKind.BEAD)]  # 26 m/s is a hard impact
    duel.world.stage.place("b", Pose(5, 5 - 0.175 * math.sin(0.75), math.pi - 0.75))
    await duel.clock.advance(0.1)
    assert await shoot(duel, pitch=aim) == []  # at an angle it is not
    duel.robots["b"][Armor].set_sensitivity(10)
    assert await shoot(duel, pitch=aim) == [(PlatePlace.FRONT, HitKind.BEAD)]


async def test_a_shot_of_several_beads_takes_its_time(duel):
    blaster = duel.robot[Blaster]
    fired = duel.robot.events.subscribe(BeadFired)
    blaster.set_beads(5)
    assert blaster.fire() == 5
    with pytest.raises(Busy):
        blaster.fire()
    await duel.clock.advance(1.0)
    stamps = [event.stamp for event in fired.drain()]
    gaps = [b - a for a, b in pairwise(stamps)]
    assert len(stamps) == 5
    assert all(gap == pytest.approx(1 / 8, abs=0.016) for gap in gaps)
    assert blaster.ammo == 995
    assert len(duel.world.truth.bead_landings) == 5
    assert not blaster.firing


async def test_beads_left_are_kept_when_it_ceases(duel):
    blaster = duel.robot[Blaster]
    blaster.set_beads(8)
    blaster.fire()
    await duel.clock.advance(0.2)
    blaster.cease()
    await duel.clock.advance(1.0)
    assert blaster.ammo == 998


async def test_an_empty_magazine_is_reported(duel):
    blaster = duel.robot[Blaster]
    blaster._section = structs.replace(blaster._section, magazine=24)
    blaster.reload()
    blaster.set_beads(8)
    for _ in range(3):
        blaster.fire()
        await duel.clock.advance(1.1)
    assert blaster.ammo == 0
    with pytest.raises(Refused, match="empty"):
        blaster.fire()
    blaster.reload()
    assert blaster.fire() == 8


@pytest.mark.parametrize("beads", [0, 9])
async def test_odd_numbers_of_beads_are_refused(duel, beads):
    with pytest.raises(InvalidGoal):
        duel.robot[Blaster].set_beads(beads)
    assert duel.robot[Blaster].beads == 1


async def test_a_hand_on_a_plate(duel):
    duel.world.stage.touch_plate("b", PlatePlace.GIMBAL_LEFT)
    await duel.clock.advance(0.1)
    assert [(hit.place, hit.kind) for hit in duel.hits.drain()] == [(PlatePlace.GIMBAL_LEFT, HitKind.HAND)]
    with pytest.raises(NotFound):
        duel.world.stage.touch_plate("c", PlatePlace.FRONT)


async def collide(sim, sensitivity, speed):
    """Drive b backwards into the wall behind it."""
    sim.world.stage.place("b", Pose(9.7, 5, math.pi))
    sim.robots["b"][Armor].set_sensitivity(sensitivity)
    sim.world.stage.push("b", Vector3(x=-speed * 3.4))
    await sim.clock.advance(1.0)
    return [(hit.place, hit.kind) for hit in sim.hits.drain()]


async def test_collision_is_felt_if_it_is_hard_enough(duel):
    assert await collide(duel, 5, 1.6) == [(PlatePlace.REAR, HitKind.COLLISION)]
    assert await collide(duel, 0, 1.6) == []


@pytest.mark.parametrize(("place", "turn"), [(PlatePlace.FRONT, 0.0), (PlatePlace.REAR, math.pi)])
async def test_person_who_is_touched_counts_as_a_hand(simulate, tmp_path, place, turn):
    (tmp_path / "room.toml").write_text('name = "room"\n[[floors]]\nsize = [10, 10]\npeople = [{ path = [[6, 5]] }]\n')
    sim = simulate(str(tmp_path / "room.toml"), start=Pose(5, 5, turn), body="robomaster_ep")
    sim.world.start()
    hits = sim.robot.events.subscribe(ArmorHit)
    sim.robot[Base].set_velocity(Twist(0.3 * math.cos(turn)))
    await sim.clock.advance(3.0)
    reported = {(hit.place, hit.kind) for hit in hits.drain()}
    assert reported == {(place, HitKind.HAND)}


async def test_two_robots_that_collide_feel_it_both(duel):
    own = duel.robot.events.subscribe(ArmorHit)
    duel.robot[Base].set_velocity(Twist(2.0))
    await duel.clock.advance(2.0)
    assert (PlatePlace.FRONT, HitKind.COLLISION) in {(hit.place, hit.kind) for hit in duel.hits.drain()}
    assert (PlatePlace.FRONT, HitKind.COLLISION) in {(hit.place, hit.kind) for hit in own.drain()}


async def test_a_collision_presses_bumper_before_plate(duel):
    with duel.robot.events.subscribe(ArmorHit, BumperPressed) as events:
        duel.robot[Base].set_velocity(Twist(x=1.0))
        await duel.clock.advance(3.0)
        found = events.drain()
    hit = next(event for event in found if isinstance(event, ArmorHit))
    assert [type(event) for event in found if event.stamp == hit.stamp] == [BumperPressed, ArmorHit]
