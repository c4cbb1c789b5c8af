# Explorer: the dog walks on while the way is free, and turns to the freer side where it is not.
#
# For teachers: making decisions from measurements; a first robot with a behaviour. Put boxes in its way.

import math

turns = 0
cyberdog.motion.go_straight(0.4, 0.6)
for _ in range(8):
    scan = cyberdog.lidar.get_data()

    def free(degrees, scan=scan):
        rays = range(-15, 16, 3)
        places = [round((math.radians(degrees + ray) - scan.angle_min) / scan.angle_increment) for ray in rays]
        return min(scan.ranges[place % len(scan.ranges)] for place in places)

    if free(0) > 1.2:
        cyberdog.motion.go_straight(0.4, 0.6)
    else:
        turns += 1
        side = 1 if free(60) > free(-60) else -1
        print("turning", "left" if side > 0 else "right")
        cyberdog.motion.turn(60 * side, 2)
print(turns, "turns")
