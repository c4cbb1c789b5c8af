# Battery watch: says how long the battery will last, and warns when it is low.
#
# For teachers: rates of change. As a task of its own, saved with the condition "0 * * * *", it reports every hour.

first = cyberdog.bms.get_data()
start = time.time()
cyberdog.motion.go_straight(0.4, 2.0)  # work costs energy
second = cyberdog.bms.get_data()
print("charge", second.batt_soc, "%")
print("charging" if second.power_wired_charging or second.power_wp_charging else "on battery")
print(f"{abs(second.batt_curr) * second.batt_volt / 1e6:.0f} W for {time.time() - start:.0f} s")
if second.batt_soc < 30:
    cyberdog.audio.play("My battery is low. Please take me to the dock.")
    cyberdog.led.play(LedConstraint.target_tail, LedConstraint.system_effect_line_red_breath)
