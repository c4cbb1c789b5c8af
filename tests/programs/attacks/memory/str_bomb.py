class Angry(Exception):
    def __str__(self):
        while True:
            pass
raise Angry()
