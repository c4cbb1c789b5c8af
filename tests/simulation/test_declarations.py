"""World and body files: what is wrong with a bad one is said with its line."""

import pytest

from roboglot.simulation.bodies.files import load_body
from roboglot.simulation.world.declarations import FILE_BYTES_MAX, BadFile
from roboglot.simulation.world.world_files import load_world

GOOD = """\
name = "test"

[[floors]]
name = "low"
size = [10, 8]
walls = [
    { from = [0, 4], to = [6, 4], doors = [{ at = 2 }] },
    { from = [6, 0], to = [6, 4] },
]
furniture = [{ shape = "box", at = [1, 1], size = [1, 1, 1] }]

[[floors]]
name = "high"
like = "low"
size = [10, 8]
furniture = [{ shape = "cylinder", at = [8, 6], radius = 0.3, height = 1 }]
"""


@pytest.fixture
def write(tmp_path):
    def make(text, name="world.toml"):
        path = tmp_path / name
        path.write_bytes(text if isinstance(text, bytes) else text.encode())
        return path

    return make


def test_a_good_world(write):
    world = load_world(write(GOOD))
    assert [floor.name for floor in world.floors] == ["low", "high"]
    assert len(world.floors[1].walls) == 2
    assert len(world.floors[1].furniture) == 2
    assert world.elevation(1) == pytest.approx(3.2)


@pytest.mark.parametrize("name", ["office", "empty", "playground"])
def test_the_shipped_worlds_load(name):
    world = load_world(name)
    assert world.name == name
    assert all(floor.docks and floor.access_points for floor in world.floors)


@pytest.mark.parametrize(
    ("old", "new", "message"),
    [
        ("furniture = [{ shape", "furnitur = [{ shape", r"world.toml:10: .*furnitur is unknown; .* 'furniture'\?"),
        ("to = [6, 4] }", "too = [6, 4] }", r"world.toml:8: .*did you mean 'to'\?"),
        ("to = [6, 4] }", "to = [6] }", r"world.toml:8: .*walls\[1\].to"),
        ("from = [6, 0]", 'from = [6, "x"]', r"world.toml:8: .*walls\[1\].from\[1\]"),
        ("size = [1, 1, 1] }", "size = [1, 1, 1], facing = nan }", r"world.toml:10: .*facing must be at least -3600"),
        ("radius = 0.3", "radius = -0.3", r"world.toml:16: .*furniture\[0\].radius"),
        ('shape = "cylinder"', 'shape = "ball"', r"world.toml:16: .*'ball'"),
        ("doors = [{ at = 2 }]", "doors = [{ at = 5.9 }]", r"floors\[0\].walls\[0\].doors\[0\].*6 m long"),
        ("from = [6, 0], to = [6, 4]", "from = [6, 4], to = [6, 4]", r"floors\[0\].walls\[1\] has no length"),
        ('like = "low"', 'like = "lower"', "not an earlier floor; there are: 'low'"),
        ("at = [8, 6]", "at = [8, 60]", r"floors\[1\].furniture\[1\].at = \[8.0, 60.0\] lies outside the floor"),
        ('name = "test"', 'name = "test', "not TOML"),
        ('name = "test"', 'start = { at = [5, 5], floor = 2 }', "start.floor = 2, but the highest floor is 1"),
        ('name = "test"', 'lift = { at = [5, 5], facing = 45 }', "lift.facing = 45"),
        ('name = "test"', 'lift = { at = [50, 5] }', "lies outside a floor"),
    ],
)  # fmt: skip
def test_bad_worlds(write, old, new, message):
    assert old in GOOD
    with pytest.raises(BadFile, match=message):
        load_world(write(GOOD.replace(old, new)))


@pytest.mark.parametrize(
    ("people", "message"),
    [
        ("[{ path = [] }]", "path is empty"),
        ("[{ path = [[1, 1], [1, 1]] }]", "same point"),
        ("[{ path = [[1, 90]] }]", "outside"),
    ],
)
def test_bad_people(write, people, message):
    with pytest.raises(BadFile, match=message):
        load_world(write(f"{GOOD}people = {people}\n"))


def test_files_that_are_none(write, tmp_path):
    with pytest.raises(BadFile, match="No such file"):
        load_world(tmp_path / "gone.toml")
    with pytest.raises(BadFile, match="not UTF-8"):
        load_world(write(b"name = '\xff'"))
    with pytest.raises(BadFile, match="longer than"):
        load_world(write(b"#" * (FILE_BYTES_MAX + 1)))
    with pytest.raises(BadFile, match="1 to 20 floors"):
        load_world(write("floors = []"))
    with pytest.raises(BadFile, match=r"no world is named 'palace', .* file; there are empty, obstacle_course, office"):
        load_world("palace")


def test_bodies(write):
    assert load_body("universal").model == "universal"
    with pytest.raises(BadFile, match="no body is named"):
        load_body("../universal")
    with pytest.raises(BadFile, match="is missing"):
        load_body(str(write("maker = 'x'", "body.toml")))


def test_the_example_in_the_documentation(request, write):
    page = (request.config.rootpath / "docs/worlds/worlds.md").read_text()
    example = page.split("```toml\n")[1].split("```")[0]
    assert load_world(write(example)).floors[0].docks
    with pytest.raises(BadFile) as caught:
        load_world(write(example.replace("to = [3, 6]", "too = [3, 6]"), "flat.toml"))
    said = str(caught.value).split("/")[-1].replace("`to`?", "")
    assert said in page.replace("\n", " ")
