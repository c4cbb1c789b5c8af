# Touch piano: a touch, a double touch and a long touch each have a sound and a colour; the dog remembers the tune.
#
# For teachers: dictionaries as tables instead of many ifs. The piano ends 5 seconds after the last touch.

KEYS = {
    1: ("woof", 4000, (0, 255, 0)),
    2: ("bow-wow", 4001, (0, 0, 255)),
    3: ("grrr", None, (255, 0, 0)),
}
tune = []
last = None
while True:
    touch = cyberdog.touch.get_data(5)
    stamp = (touch.header.stamp.sec, touch.header.stamp.nanosec)
    if touch.touch_state == 0 or stamp == last:
        break
    last = stamp
    name, sound, colour = KEYS[touch.touch_state]
    cyberdog.led.play_rgb(LedConstraint.target_head, LedConstraint.effect_line_on, *colour)
    if sound is None:
        cyberdog.audio.instantly_play(name)
    else:
        cyberdog.audio.offline_instantly_play(sound)
    tune.append(name)
print("tune:", " ".join(tune))
