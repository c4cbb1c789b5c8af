"""Detections agree with the picture: OpenCV finds the same codes at the same places in what the camera draws."""

import numpy as np
import pytest

from roboglot.model.components.sensing.camera import Camera
from roboglot.model.errors import NotFound
from roboglot.model.geometry import Pose
from roboglot.model.perception import TagKind
from tests.simulation.perceiving import lab

cv2 = pytest.importorskip("cv2")
APRIL = cv2.aruco.DICT_APRILTAG_36h11


async def picture(room):
    frame = await room.robot[Camera].capture()
    return cv2.cvtColor(frame.rgb(), cv2.COLOR_RGB2GRAY)


async def test_tags_on_walls_docks_and_shelves():
    hidden = {"at": [4.5, 5.8], "facing": 190, "text": "43", "size": 0.3}  # by one of the shelf's legs
    with lab(
        tags=[hidden, {"at": [5.5, 6.9], "facing": 200, "text": "42", "size": 0.3}],
        docks=[{"at": [4.0, 4.6], "facing": 170, "tag": 3}],
        shelves=[{"at": [4.0, 5.2], "facing": 180, "clearance": 0.6, "height": 1.0, "tag": 4}],
    ) as room:
        seen = {int(tag.text): tag.box for tag in await room.see("tags")}
        image = await picture(room)
    corners, numbers, _ = cv2.aruco.ArucoDetector(cv2.aruco.getPredefinedDictionary(APRIL)).detectMarkers(image)
    found = {int(number): quad[0] / (1280, 720) for number, quad in zip(numbers.ravel(), corners, strict=True)}
    assert set(found) == set(seen) == {3, 4, 42}
    for number, quad in found.items():
        box = seen[number]
        low, high = quad.min(axis=0), quad.max(axis=0)
        assert (low + high) / 2 == pytest.approx((box.x, box.y), abs=0.004)
        assert high - low == pytest.approx((box.width, box.height), rel=0.08)


@pytest.mark.slow
async def test_tags_that_hands_hang_up_and_move():
    detector = cv2.aruco.ArucoDetector(cv2.aruco.getPredefinedDictionary(APRIL))
    with lab() as room:
        stage, read = room.world.stage, {}
        for text in [*map(str, range(40)), "7"]:  # more than the drawing cache holds
            number = stage.add_tag(text, Pose(4.0, 5.3, np.pi), size=0.3)
            if text in ("7", "39"):
                (seen,) = await room.see("tags")
                corners, numbers, _ = detector.detectMarkers(await picture(room))
                assert str(numbers.item()) == seen.text == text
                read[text] = corners[0][0].mean(axis=0) / (1280, 720)
                assert read[text] == pytest.approx((seen.box.x, seen.box.y), abs=0.004)
            else:
                await picture(room)
            stage.remove_tag(number)
        assert await room.see("tags") == []
        number = stage.add_tag("roboglot", Pose(4.0, 5.3, np.pi), kind=TagKind.QR, size=0.3)
        stage.move_tag(number, Pose(4.0, 4.9, np.pi), 0)
        (seen,) = await room.see("tags")
    assert (seen.kind, seen.text) == (TagKind.QR, "roboglot")
    assert seen.box.x > read["7"][0] + 0.05


def test_only_tags_that_exist_can_be_hung_up():
    with lab() as room:
        stage = room.world.stage
        for text, kind in (("587", TagKind.APRIL), ("x", TagKind.APRIL), ("", TagKind.QR), ("x" * 107, TagKind.QR)):
            with pytest.raises(ValueError, match=r"AprilTag|QR"):
                stage.add_tag(text, Pose(4, 5), kind=kind)
        with pytest.raises(ValueError, match="no place"):
            stage.add_tag("1", Pose(40, 5))
        with pytest.raises(ValueError, match="large"):
            stage.add_tag("1", Pose(4, 5), size=3.0)
        for number in range(16):
            stage.add_tag(str(number), Pose(4, 5))
        with pytest.raises(ValueError, match="16"):
            stage.add_tag("1", Pose(4, 5))
        with pytest.raises(NotFound):
            stage.remove_tag(16)
        with pytest.raises(NotFound):
            stage.move_tag(16, Pose(4, 5), 0)


async def test_a_qr_code_can_be_read():
    code = {"at": [4.0, 5.3], "facing": 180, "kind": "qr", "text": "roboglot:playground", "size": 0.4}
    with lab(tags=[code]) as room:
        (seen,) = await room.see("tags")
        image = await picture(room)
    text, corners, _ = cv2.QRCodeDetector().detectAndDecode(image)
    assert text == seen.text == "roboglot:playground"
    middle = corners[0].mean(axis=0) / (1280, 720)
    assert middle == pytest.approx((seen.box.x, seen.box.y), abs=0.005)


async def test_a_line_is_where_its_pixels_are():
    with lab(lines=[{"points": [[2.5, 4.6], [6.0, 5.6]], "colour": "red", "width": 0.08}]) as room:
        (line,) = await room.see("lines")
        rgb = (await room.robot[Camera].capture()).rgb().astype(int)
    red = rgb[..., 0] - rgb[..., 1:].max(axis=-1) > 60
    for point in line.points[1:-1]:
        row = np.flatnonzero(red[round(point.y * 720)])
        assert row.mean() / 1280 == pytest.approx(point.x, abs=0.01)


async def test_a_person_covers_their_box():
    anna = {"name": "anna", "path": [[5.0, 5.3]], "facing": 180, "height": 1.7}
    with lab(people=[anna], start=Pose(1.5, 5)) as room:
        (seen,) = await room.see("people")
        with_her = await picture(room)
        room.world.stage.person("anna").place(0.6, 9.0)
        await room.clock.advance(0.1)
        without = await picture(room)
    changed = np.abs(with_her.astype(int) - without)[:400] > 12  # her shadow lies below
    rows, columns = np.flatnonzero(changed.sum(axis=1) > 2), np.flatnonzero(changed.sum(axis=0) > 2)
    assert columns[0] / 1280 == pytest.approx(seen.box.x - seen.box.width / 2, abs=0.02)
    assert columns[-1] / 1280 == pytest.approx(seen.box.x + seen.box.width / 2, abs=0.02)
    assert rows[0] / 720 == pytest.approx(max(0.0, seen.box.y - seen.box.height / 2), abs=0.03)
