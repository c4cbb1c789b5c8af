"""The studio: block programs in the browser, run and stepped on a robot, missions, classes. Knows no door."""
