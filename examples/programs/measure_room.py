# Measuring a room: the dog looks in four directions and says how large the room is.
#
# For teachers: list slices, medians, units. The lidar gives one distance for each angle; the median of a few neighbours
# is better than one alone. inf means: nothing came back. Let the pupils check the result with a folding rule.

import math

cyberdog.motion.go_straight(0.4, 1.0)  # away from the wall behind the dock
scan = cyberdog.lidar.get_data()


def distance(degrees):
    middle = round((math.radians(degrees) - scan.angle_min) / scan.angle_increment)
    near = [scan.ranges[(middle + i) % len(scan.ranges)] for i in range(-2, 3)]
    return sorted(near)[2]


length = distance(0) + distance(180)
width = distance(90) + distance(-90)
print(f"length {length:.1f} m, width {width:.1f} m, area {length * width:.0f} m2")
