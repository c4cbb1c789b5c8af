# Patrol: a round along a square, with a look ahead at every corner.
#
# For teachers: loops and lists. Let the pupils change the length of the sides, add a second round, or make the dog say
# what it measures. The blocks show in the app where the dog is on its round.

SIDE = 0.6  # metres

cyberdog.motion.resume_standing()
cyberdog.motion.go_straight(0.4, 0.8)  # away from the dock
free = []
for corner in ["east", "north", "west", "south"]:
    cyberdog.task.block("corner " + corner)
    distance = cyberdog.ultrasonic.get_data().range
    free.append(distance)
    print(corner, "clear" if distance > 1.0 else "something is there")
    cyberdog.motion.go_straight(0.4, SIDE)
    cyberdog.motion.turn(90, 2)
print("round finished, clear on", sum(distance > 1.0 for distance in free), "of", len(free), "sides")
