# Voice commands: the dog obeys the three phrases it was trained with.
#
# For teachers: functions as values. The words are the robot's own: 暂停任务 (pause), 继续任务 (go on), 终止任务 (end).


def pause():
    cyberdog.motion.get_down()


def go_on():
    cyberdog.motion.resume_standing()


ACTIONS = {"suspend": pause, "recover": go_on}
words = cyberdog.train.get_training_words_set().dictionary
print("I listen for", len(words), "phrases")
while True:
    heard = cyberdog.train.training_words_recognized(20).response
    if heard.value == "":
        print("no one speaks")
        break
    print("heard", heard.trigger)
    if heard.value == "shutdown":
        break
    ACTIONS[heard.value]()
