# Gesture control: thumb up, the dog stands up; hand up, it lies down; pull, it comes a step.
#
# For teachers: what a program knows at a moment. Discuss why recognition is switched on once, before the loop.

cyberdog.gesture.turn_on_recognition(60)
for _ in range(3):
    seen = cyberdog.gesture.recognized_any_gesture(30, 1).data
    if seen.stop_sign:
        print("down")
        cyberdog.motion.get_down()
    elif seen.thumb_up:
        print("up")
        cyberdog.motion.resume_standing()
    elif seen.pulling_hand_or_two_fingers_in:
        print("coming")
        cyberdog.motion.go_straight(0.3, 0.4)
    else:
        print("I see nothing I know")
    time.sleep(3)  # until the hand is down again
cyberdog.gesture.turn_off_recognition()
