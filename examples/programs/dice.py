# Dice: two throws; the dog lifts its paw as often as the dice say, and knows who has won.
#
# For teachers: chance and functions. The robot's random numbers depend on the run: run it again for another game.

import random


class Player:
    def __init__(self, name, paw):
        self.name = name
        self.paw = paw
        self.points = 0

    def throw(self):
        self.points = random.randint(1, 3)
        for _ in range(self.points):
            self.paw()


players = [Player("left", cyberdog.motion.hold_left_hand), Player("right", cyberdog.motion.hold_right_hand)]
cyberdog.motion.go_straight(0.4, 0.5)
for player in players:
    player.throw()
    print(player.name, player.points)
best = max(player.points for player in players)
winners = [player.name for player in players if player.points == best]
print("winner:", winners[0] if len(winners) == 1 else "no one")
