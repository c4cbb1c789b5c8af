"""Commands of the EP, one file per chapter of the manual as in ``protocols.robomaster.chapters``."""
