# Follow me: the dog walks after a person whose face it knows, and stops at a touch.
#
# For teachers: waiting for an event in a loop. Before, enter a family member named Anna with her face, in the app.
# Following goes on while the program does something else.

WHO = "Anna"

if cyberdog.follow.add_personnel(WHO).code != StateCode.success:
    print("I do not know", WHO)
    exit()
cyberdog.follow.follow_personnel(WHO, 1.2)
print("coming")
for _ in range(30):
    time.sleep(1)
    if cyberdog.touch.data.touch_state > 0:
        print("stopped by a touch")
        break
cyberdog.follow.cancel_follow(WHO)
walked = cyberdog.odometer.get_data().pose.pose.position
print("I am", round(walked.x, 0), "m further")
