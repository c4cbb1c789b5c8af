# Fitness coach: the dog counts your squats and praises you.
#
# For teachers: functions with parameters, and results that say whether something worked. Other exercises are in
# SkeletonType: highknees, situp, pressup, plank, jumpjack.


def train(sport, name, goal):
    cyberdog.audio.play("Let us do " + str(goal) + " " + name)
    result = cyberdog.skeleton.sports_recognition(sport, goal, 30, False)
    if result.state.code != StateCode.success:
        return 0
    return result.response.counts


done = train(SkeletonType.squat, "squats", 3)
print(done, "squats")
if done >= 3:
    cyberdog.audio.play("Well done!")
    cyberdog.motion.nodding_in_place()
else:
    cyberdog.audio.play("Let us try again tomorrow")
