# Parking aid: the dog walks towards an obstacle in smaller and smaller steps and stops a hand's breadth before it.
#
# For teachers: feedback. The dog measures, moves by a part of what is left, and measures again. Discuss: why not all at
# once? What if the part is larger than 1? The ToF sensors in the head see 64 points each; the nearest one counts.

STOP = 0.30  # metres
EYES = 3  # rows of the picture that look ahead and not at the floor


def nearest():
    head = cyberdog.tof.get_data().head
    points = head.left_head.data[: 8 * EYES] + head.right_head.data[: 8 * EYES]
    return min(points)


steps = 0
while True:
    distance = nearest()
    left = distance - STOP
    print(f"{distance:.2f} m")
    if left < 0.04:
        break
    steps += 1
    cyberdog.motion.go_straight(0.2, min(0.2, max(0.05, left * 0.6)))
cyberdog.audio.offline_play(4000)
print("parked after", steps, "steps")
