"""Components of a Slamware robot, by the chapters of the manual as in ``protocols.slamware.chapters``."""
