"""Components of a RoboMaster EP, one file for each chapter of the manual as in ``protocols.robomaster.chapters``."""
