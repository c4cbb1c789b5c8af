"""The tour: an independent client of each protocol drives the same robot, one after the other."""
