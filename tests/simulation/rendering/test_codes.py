"""Printed codes are read by OpenCV, which made none of them."""

import numpy as np
import pytest

from roboglot.simulation.building.printed_codes import QR_BYTES_MAX, april, qr

cv2 = pytest.importorskip("cv2")


def printed(squares, pixels=10):
    """Black on white with a margin of four squares."""
    return (255 * (1 - np.pad(squares, 4))).repeat(pixels, 0).repeat(pixels, 1).astype(np.uint8)


@pytest.mark.parametrize("text", ["A", "roboglot:playground", "x" * 53, "y" * QR_BYTES_MAX, "充电桩", "1" * 78])
def test_qr_codes_are_read(text):
    read, corners, _ = cv2.QRCodeDetector().detectAndDecode(printed(qr(text)))
    assert read == text
    assert corners is not None


@pytest.mark.parametrize("number", [0, 1, 42, 586])
def test_tags_are_read(number):
    detector = cv2.aruco.ArucoDetector(cv2.aruco.getPredefinedDictionary(cv2.aruco.DICT_APRILTAG_36h11))
    _, numbers, _ = detector.detectMarkers(printed(april(number), 20))
    assert numbers.ravel().tolist() == [number]


def test_too_long_codes_are_refused():
    with pytest.raises(ValueError, match="up to 106 bytes"):
        qr("y" * (QR_BYTES_MAX + 1))
    with pytest.raises(ValueError, match="tags 0 to 586"):
        april(587)
