"""Components made of other components: driving, localization and mapping, navigation, docking.

They use the robot's own parts (Lidar, Odometry, Base, Legs, DockContact) and never the world behind them, so they run
alike on simulated and real robots.
"""

from roboglot.extras import explaining

with explaining("roboglot.autonomy", "simulation"):
    from roboglot.autonomy.skills import Autonomy

__all__ = ["Autonomy"]
