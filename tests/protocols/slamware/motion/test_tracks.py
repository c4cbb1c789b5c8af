"""Ways along virtual tracks: the graph alone, and through a real socket."""

from __future__ import annotations

import itertools
import math

import httpx
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from roboglot.model.components.interaction.light import Colour, Light
from roboglot.model.components.mapping.annotations import Line, LineKind
from roboglot.model.components.mapping.localization import Localization
from roboglot.model.components.mapping.track_graph import way_along
from roboglot.model.errors import InvalidGoal
from roboglot.model.geometry import Point
from roboglot.model.robot import Robot
from roboglot.testing import Forward

SEARCH = "/api/multi-floor/map/v1/search_path_points"
ACTIONS, TRACKS = "/api/core/motion/v1/actions", "/api/core/artifact/v1/lines/tracks"
LIGHTS = "/api/core/system/v1/light/control"


def track(x1: float, y1: float, x2: float, y2: float) -> Line:
    return Line(1, LineKind.TRACK, Point(x1, y1), Point(x2, y2))


def length(way: list[Point]) -> float:
    return sum(a.distance_to(b) for a, b in itertools.pairwise(way))


RING = [track(0, 0, 4, 0), track(4, 0, 4, 4), track(4, 4, 0, 4), track(0, 4, 0, 0)]


def test_tracks_give_the_shorter_or_only_directed_way() -> None:
    way = way_along(RING, Point(1, 0), Point(0, 1))
    assert length(way) == pytest.approx(2)
    way = way_along(RING, Point(1, 0), Point(0, 1), directed=True)
    assert length(way) == pytest.approx(14)
    assert Point(4, 4) in way


def test_tracks_of_too_many_crossings_are_refused() -> None:
    """A graph of a million crossings took minutes, in which no robot was served."""
    fan = [track(number, 0.0, 1000.0 - number, 1000.0) for number in range(1000)]
    with pytest.raises(InvalidGoal, match="cross more than 3000 times"):
        way_along(fan, Point(0, 0), Point(1, 1))
    curve = Line(1, LineKind.TRACK, Point(), Point(1, 0), (Point(1e5, 0), Point(0, 1e5)))
    with pytest.raises(InvalidGoal, match="3000 straight pieces"):
        way_along([curve] * 10_000, Point(0, 0), Point(1, 1))


def test_tracks_are_joined_where_they_cross_and_touch() -> None:
    cross = [track(0, 0, 4, 0), track(2, -2, 2, 2), track(2.05, 2.0, 5, 2)]
    way = way_along(cross, Point(0, 0.5), Point(5, 2.5))
    assert [(p.x, p.y) for p in way] == [(0, 0.5), (0, 0), (2, 0), (2.05, 2), (5, 2), (5, 2.5)]


def test_tracks_without_length_are_no_way() -> None:
    dot = track(0.0, 0.0, 0.0, 1e-200)
    assert way_along([dot], Point(0, 0), Point(0, 0)) == []
    assert way_along([dot, track(0, 0, 4, 0)], Point(0, 0), Point(4, 0)) == [Point(0, 0), Point(4, 0)]


def test_no_way() -> None:
    assert way_along([], Point(0, 0), Point(1, 1)) == []
    apart = [track(0, 0, 1, 0), track(0, 5, 1, 5)]
    assert way_along(apart, Point(0, 0), Point(1, 5)) == []
    assert way_along([track(0, 0, 4, 0)], Point(3, 0), Point(1, 0), directed=True) == []


NUMBER = st.floats(-50, 50)
LINES = st.lists(st.builds(track, NUMBER, NUMBER, NUMBER, NUMBER), max_size=12)


@settings(deadline=None, max_examples=60)
@given(LINES, st.builds(Point, NUMBER, NUMBER), st.builds(Point, NUMBER, NUMBER))
def test_any_way_begins_and_ends_where_asked(lines: list[Line], start: Point, end: Point) -> None:
    way = way_along(lines, start, end)
    if way:
        assert way[0] == start
        assert way[-1].distance_to(end) < 1e-5
        assert length(way) >= start.distance_to(end) - 1e-3
    directed = way_along(lines, start, end, directed=True)
    assert not directed or way


@pytest.mark.world("empty")
async def test_searching_through_the_door(robot: Robot, client: httpx.AsyncClient, forward: Forward) -> None:
    await forward(seconds=1)
    query = {"end_point": {"x": 2.0, "y": 2.0}}
    assert (await client.post(SEARCH, json=query)).json() == {"path_points": []}
    ends = [((0.5, 0.0), (2.0, 0.0)), ((2.0, 0.0), (2.0, 2.0))]
    body = [{"start": {"x": a, "y": b}, "end": {"x": c, "y": d}} for (a, b), (c, d) in ends]
    assert (await client.post(TRACKS, json=body)).json() is True
    points = (await client.post(SEARCH, json=query)).json()["path_points"]
    here = robot[Localization].pose
    assert points[0] == pytest.approx([here.x, here.y], abs=0.05)
    assert points[1:] == [[0.5, 0.0], [2.0, 0.0], [2.0, 2.0]]
    back = {"start_point": {"x": 2.0, "y": 2.0}, "end_point": {"x": 0.5, "y": 0.0}}
    assert len((await client.post(SEARCH, json=back)).json()["path_points"]) == 3
    assert (await client.post(SEARCH, json={**back, "with_direction": True})).json() == {"path_points": []}
    assert (await client.post(SEARCH, json={**back, "floor": "9F"})).status_code == 400


@pytest.mark.slow  # in short: test_tracks_give_the_shorter_or_only_directed_way
@pytest.mark.world("empty")
async def test_moving_along_the_tracks_direction_only(
    robot: Robot, client: httpx.AsyncClient, forward: Forward
) -> None:
    await forward(seconds=1)
    corners = [(0.6, 0.0), (2.6, 0.0), (2.6, 2.0), (0.6, 2.0), (0.6, 0.0)]
    body = [{"start": {"x": a, "y": b}, "end": {"x": c, "y": d}} for (a, b), (c, d) in itertools.pairwise(corners)]
    await client.post(TRACKS, json=body)
    flags = ["with_directed_virtual_track"]
    options = {"target": {"x": 0.6, "y": 1.0}, "move_options": {"mode": 1, "flags": flags}}
    reply = await client.post(ACTIONS, json={"action_name": "agent.actions.MoveToAction", "options": options})
    id = reply.json()["action_id"]
    nearest = math.inf
    for _ in range(400):
        nearest = min(nearest, robot[Localization].pose.distance_to(Point(2.6, 2.0)))
        if (state := (await client.get(f"{ACTIONS}/{id}")).json()["state"])["status"] == 4:
            break
        await forward(seconds=0.25)
    assert state == {"status": 4, "result": 0, "reason": ""}
    assert nearest < 0.3  # the detour
    assert robot[Localization].pose.distance_to(Point(0.6, 1.0)) < 0.1


@pytest.mark.world("empty", body="hermes")
async def test_lights_show_what_they_are_given(robot: Robot, client: httpx.AsyncClient, forward: Forward) -> None:
    light = robot[Light]
    red = {"red": 200, "green": 0, "blue": 0}

    async def show(**more: object) -> None:
        body = {"channel": "One", "controlPart": "Left", "mode": "AlwaysBright", "color": red, **more}
        assert (await client.post(LIGHTS, json=body)).status_code == 200

    async def seen(seconds: float, steps: int, zone: str = "left") -> list[tuple[Colour, ...]]:
        found = []
        for _ in range(steps):
            await forward(seconds=seconds)
            found.append(light.lamps(zone))
        return found

    await show()
    assert set((await seen(0.1, 1))[0]) == {Colour(200, 0, 0)}
    assert set(light.lamps("right")) == {Colour(0, 0, 0)}
    await show(mode="Blink", brightMs=300, offMs=100)
    bright = [lamps[0] == Colour(200, 0, 0) for lamps in await seen(0.01, 400)]
    assert sum(bright) == pytest.approx(300, abs=5)
    await show(mode="Breathe", color={}, brightnessEndColor={"red": 100, "green": 50, "blue": 0}, brightMs=10)
    levels = [lamps[0] for lamps in await seen(0.05, 60)]
    assert max(c.red for c in levels) >= 96
    assert min(c.red for c in levels) <= 4
    assert max(c.green for c in levels) == 50
    await show(mode="HorseLamp", brightMs=100)
    lit = [[n for n, c in enumerate(lamps) if c.red] for lamps in await seen(0.1, 40)]
    assert all(len(lamps) == 1 for lamps in lit)
    assert {lamps[0] for lamps in lit} == set(range(light.zones["left"]))
    await show(channel="Two", controlPart="Right")
    assert set((await seen(0.1, 1, "right_lower"))[0]) == {Colour(200, 0, 0)}
    await show(mode="AlwaysBright", color={})
    assert set((await seen(0.1, 1))[0]) == {Colour(0, 0, 0)}
    for wrong in ({"mode": "Disco"}, {"color": {"red": 300}}, {"channel": "Three"}):
        body = {"channel": "One", "controlPart": "Left", "mode": "Blink", "color": red, **wrong}
        assert (await client.post(LIGHTS, json=body)).status_code == 400


@pytest.mark.world("empty")
async def test_a_strip_that_is_not_there(client: httpx.AsyncClient) -> None:
    body = {"channel": "Two", "controlPart": "Left", "mode": "AlwaysBright", "color": {}}
    reply = await client.post(LIGHTS, json=body)
    assert (reply.status_code, reply.reason_phrase) == (501, "Failed to set light control")
