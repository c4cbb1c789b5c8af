"""Laser landmarks: finding reflecting strips, storing them on the map, correcting the pose by them."""
