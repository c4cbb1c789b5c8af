-- Where the dock stands on a map.
ALTER TABLE map ADD COLUMN dock TEXT; -- JSON: x, y in m, yaw in rad; NULL: none was known
