"""Components of the model over a real robot, which is reached by a client of its own protocol.

Units and frames are translated once, here; what the robot does not have is not added. Each package is described by its
``DRIVER``. Another driver is one more line.
"""

from __future__ import annotations

from roboglot.drivers import cyberdog, robomaster, slamware
from roboglot.drivers.driver_type import DriverType

DRIVERS: tuple[DriverType, ...] = (slamware.DRIVER, robomaster.DRIVER, cyberdog.DRIVER)
