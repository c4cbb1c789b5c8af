-- Maps made outdoors, the number that an app gives a map, and where on the globe a map lies.
ALTER TABLE map ADD COLUMN outdoor INTEGER NOT NULL DEFAULT 0;
ALTER TABLE map ADD COLUMN number TEXT NOT NULL DEFAULT '0'; -- up to 64 bits without a sign; 0: none was given
ALTER TABLE map ADD COLUMN anchor TEXT; -- JSON
