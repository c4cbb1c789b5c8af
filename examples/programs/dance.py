# Dance: steps, lights and a bow, in the order of a list.
#
# For teachers: a list of functions is a choreography. Let every group write its own dance and join them with +.

motion = cyberdog.motion


def lights(red, green, blue):
    cyberdog.led.play_rgb(LedConstraint.target_tail, LedConstraint.effect_line_blink, red, green, blue)


verse = [motion.step_left_and_right, motion.head_circle, motion.jump3d_left90deg]
refrain = [motion.jump3d_right90deg, motion.butt_circle]
motion.go_straight(0.4, 1.0)  # room to dance
for number, step in enumerate(verse + refrain):
    lights(255 * (number % 2), 0, 255 * ((number + 1) % 2))
    if not step().response.result:
        print("step", number, "did not work")
choreographer.moonwalk(-0.05, 0, 0.05, 1)
dancer.dance()
motion.bow()
print("thank you!")
