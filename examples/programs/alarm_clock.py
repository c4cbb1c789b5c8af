# Alarm clock: at the scheduled time the dog barks louder and louder until it is touched.
#
# For teachers: schedules and loops with two ends. Save it with the condition "30 6 * * 1-5": every school day at 6:30.

volume = 20
touched_before = cyberdog.touch.data.header.stamp.sec
for ring in range(1, 9):
    cyberdog.audio.offline_play(4001, volume)
    volume = min(100, volume + 20)
    touch = cyberdog.touch.get_data(2)
    if touch.touch_state > 0 and touch.header.stamp.sec > touched_before:
        print("good morning after", ring, "rings")
        cyberdog.motion.stretch_the_body()
        break
else:
    print("no one at home")
