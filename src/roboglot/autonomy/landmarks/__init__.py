"""Laser landmarks: finding reflecting strips, keeping them on the map, correcting the pose by them."""
