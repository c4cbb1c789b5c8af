# Steps of our own: a gait and two paces that no button in the app has.
#
# For teachers: objects with fields. A gait says which feet are on the ground and for how long (x 30 ms); a pace says
# how the body moves meanwhile, and for how long (ms).

walk = MotionSequence()
walk.name = "sway"
for right, left in ((1, 0), (0, 1)):
    gait = MotionSequenceGait()
    gait.right_forefoot = gait.left_hindfoot = right
    gait.left_forefoot = gait.right_hindfoot = left
    gait.duration = 10
    walk.gait_list.push_back(gait)
for speed, duration in ((0.2, 1500), (-0.1, 1000)):
    pace = MotionSequencePace()
    pace.twist.linear.x = speed
    pace.duration = duration
    walk.pace_list.push_back(pace)

cyberdog.motion.go_straight(0.4, 0.5)
before = cyberdog.odometer.get_data().pose.pose.position.x
result = cyberdog.motion.run_sequence(walk)
after = cyberdog.odometer.get_data().pose.pose.position.x
print(walk.gait_list.size(), "gaits:", result.response.result, "forward" if after > before else "back")
