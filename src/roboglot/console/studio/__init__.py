"""The studio: block programs in the browser, run and stepped on a robot, missions, classes. Sees no door's insides."""
