# Light show: the dog's lights go through the colours of the rainbow, faster and faster.
#
# For teachers: tuples, dictionaries, nested loops. A colour is three numbers from 0 to 255: so
# much red, green and blue. Lights that a program has taken are given back when it ends.

RAINBOW = {
    "red": (255, 0, 0),
    "orange": (255, 120, 0),
    "yellow": (255, 255, 0),
    "green": (0, 255, 0),
    "blue": (0, 0, 255),
    "violet": (140, 0, 255),
}
pause = 0.8
for _ in range(2):
    for name, (red, green, blue) in RAINBOW.items():
        for target in (LedConstraint.target_head, LedConstraint.target_tail):
            cyberdog.led.play_rgb(target, LedConstraint.effect_line_on, red, green, blue)
        print(name, end=" ")
        time.sleep(pause)
    print()
    pause /= 2
cyberdog.led.play(LedConstraint.target_mini, LedConstraint.system_effect_mini_one_by_one)
time.sleep(1)
cyberdog.led.freed(LedConstraint.target_head)
cyberdog.led.freed(LedConstraint.target_tail)
