"""Components of the model over a real robot, connected by a client of its own protocol.

Units and frames are converted once, here; components that the robot lacks are not added. Each package exports its
``DRIVER``. Another driver is one more line.
"""

from __future__ import annotations

from roboglot.drivers import cyberdog, robomaster, slamware
from roboglot.drivers.driver_type import DriverType

DRIVERS: tuple[DriverType, ...] = (slamware.DRIVER, robomaster.DRIVER, cyberdog.DRIVER)
