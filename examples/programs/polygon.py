# Polygon: the dog walks any regular polygon and checks how well it closes.
#
# For teachers: the exterior angles of a polygon add up to 360 degrees. The odometer says where the dog believes to be.

import math


def place():
    return cyberdog.odometer.get_data().pose.pose.position


def polygon(corners, side):
    for _ in range(corners):
        cyberdog.motion.go_straight(0.4, side)
        cyberdog.motion.turn(360 / corners, 2)


cyberdog.motion.go_straight(0.4, 1.0)  # away from the dock
for corners in (3, 4):
    start = place()
    polygon(corners, 0.5)
    end = place()
    error = math.hypot(end.x - start.x, end.y - start.y)
    print(corners, "corners:", "closed" if error < 0.15 else f"{error:.2f} m off")
