# Compass: the dog turns until it looks in the direction it looked in at first, whatever happened in between.
#
# For teachers: angles that wrap around (359 and 1 degree are neighbours), and reading an attitude sensor.

import math
import random


def heading():
    q = cyberdog.imu.get_data().orientation
    return math.degrees(math.atan2(2 * (q.w * q.z + q.x * q.y), 1 - 2 * (q.y * q.y + q.z * q.z)))


def difference(a, b):
    return (a - b + 180) % 360 - 180


cyberdog.motion.go_straight(0.4, 0.8)
home = heading()
cyberdog.motion.turn(random.randint(60, 170), 3)
print("I was turned by more than 30 degrees:", abs(difference(heading(), home)) > 30)
for _ in range(4):
    left = difference(home, heading())
    if abs(left) < 3:
        break
    cyberdog.motion.turn(left, 3)
print("back within", math.ceil(abs(difference(home, heading())) / 5) * 5, "degrees")
