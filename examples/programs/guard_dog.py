# Guard dog: the dog learns what is around it, and barks with red lights when something comes nearer.
#
# For teachers: comparing lists of measurements. The lidar measures the distance in all directions; what was not there
# a moment ago is an intruder. Discuss: why the limit of 0.5 m, and not 0? What happens if the dog itself moves?

LIMIT = 0.5  # metres: less than that is noise

before = cyberdog.lidar.get_data().ranges
print("watching")
alarm = False
for _ in range(60):
    time.sleep(0.5)
    now = cyberdog.lidar.get_data().ranges
    nearer = [i for i in range(len(now)) if before[i] - now[i] > LIMIT]
    if len(nearer) > 5:
        alarm = True
        break
if alarm:
    cyberdog.led.play(LedConstraint.target_head, LedConstraint.system_effect_line_red_blink_fast)
    cyberdog.audio.offline_play(4001, 80)
    print("intruder at", round(min(now[i] for i in nearer), 1), "m")
else:
    print("all quiet")
