# Delivery: the dog brings something to the kitchen, waits until it is taken, and comes back.
#
# For teachers: steps that can fail. Before, make a map in the app with the labels "kitchen" and "desk".


def go(place):
    cyberdog.task.block("to the " + place)
    answer = cyberdog.navigation.navigation_to_preset(place)
    if answer.response.result != 0:
        raise RobotError("cannot reach the " + place)


places = cyberdog.navigation.get_preset().dictionary
print("I know", ", ".join(sorted(places.keys())))
cyberdog.navigation.turn_on_navigation()
try:
    go("kitchen")
    cyberdog.audio.play("Your delivery. Please touch my head when you have taken it.")
    if cyberdog.touch.get_data(20).touch_state > 0:
        print("taken")
    go("desk")
    print("back")
except RobotError as error:
    print("sorry:", error)
cyberdog.navigation.turn_off_navigation()
