"""Components made of other components: driving, localization and mapping, navigation, docking.

They see the robot's own parts (Lidar, Odometry, Base, Legs, DockContact) and nothing of the world behind them, hence
run the same over a simulated and a real robot.
"""

from roboglot.extras import explaining

with explaining("roboglot.autonomy", "simulation"):
    from roboglot.autonomy.skills import Autonomy

__all__ = ["Autonomy"]
