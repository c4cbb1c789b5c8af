"""The robot as its doors see it: values, components, actions, events, errors and the clock.

Pure Python and numpy. Knows no socket, no database, no vendor and no simulator. Units are SI, frames follow
REP-103/105: x forward, y left, z up, yaw counter-clockwise; ``map -> odom -> base_link``.
"""
