"""Layouts shared by kernels and those who fill their arrays: planes of a picture, tables of a world's robots.

A table has a row for each robot. Poses and motion are in world, m, rad, m/s, rad/s, unless said otherwise; a flag is 0
or 1. Imports no Numba.
"""

from __future__ import annotations

# Planes of a picture.
FIRST = 2  # number of the first polygon; 0 and 1 are floor and ceiling
COEFFICIENTS = 11  # of a polygon's plane, see ``raster``

# Hull: the body in the physics.
HULL_Q, HULL_V, HULL_A = 0, 1, 2  # its first position, velocity and control in the physics
HULL_TORSO = 3  # its position in the physics, if legs move it; else -1
HULL_ON_SPRING, HULL_REST_Z = 4, 5  # flag: a spring supports it in place of contacts; its height at rest
HULL_FLOOR_CHECK_Z = 6  # height at which its floor was last determined
HULL_LOOKUP_X, HULL_LOOKUP_Y, HULL_LOOKUP_RANGE = 7, 8, 9  # place of the last search for edges and walls; its range
HULL_X, HULL_Y, HULL_Z, HULL_YAW = 10, 11, 12, 13  # the yaw without wrapping
HULL_VX, HULL_VY, HULL_VZ, HULL_YAW_RATE = 14, 15, 16, 17
HULL_LAST_V = 18  # and three more: the four velocities one step earlier
HULL_HELD = 22  # flag: the wheels do not drive it: it is held, lies or rolls freely
HULL_DRIVE_X, HULL_DRIVE_Y, HULL_DRIVE_YAW = 23, 24, 25  # commanded velocity of the wheels, base_link
HULL_TILTED = 26  # flag: hull or torso is tilted
HULL_WHEEL_X, HULL_WHEEL_Y, HULL_WHEEL_YAW = 27, 28, 29  # current velocity of the wheels, base_link
HULL_UNDRIVEN = 30  # flag: a wheel has no power, or all roll freely
HULL_TORSO_V, HULL_UNDERSIDE = 31, 32  # speed of the torso in the physics; height of its underside above the floor, m
HULL_GIMBAL_PITCH, HULL_GIMBAL_YAW = 33, 34  # 0 without a gimbal
HULL_TORSO_CONTROL = 35  # index of the torso's servo in the physics' controls
HULL_RADIUS = 36
HULL_FLOOR, HULL_WALLS = 37, 38  # floor of the last search; distance to the nearest wall from its place, m
HULL_GOAL_X, HULL_GOAL_Y, HULL_GOAL_YAW = 39, 40, 41  # velocity towards which the wheels accelerate, base_link
HULL_LINEAR_STEP, HULL_ANGULAR_STEP = 42, 43  # change of velocity per tick; both 0: it is reached
HULL_WIDTH = 44

BATCHED, SINGLE = 1.0, 2.0  # values of column USE below: by a kernel for all, by its own code; 0: no such part
USE = 0

# IMU.
IMU_NEXT_NOISE, IMU_SCALE, IMU_TILTED = 1, 2, 3  # index of the next noise; scale of the gyro; flag: torso was tilted
IMU_HULL_YAW, IMU_HULL_VX, IMU_HULL_VY, IMU_HULL_VZ = 4, 5, 6, 7  # of the hull at the last measurement
IMU_YAW, IMU_RATE = 8, 9  # integral of the gyro, and its mean over the last tick
IMU_AX, IMU_AY, IMU_AZ = 10, 11, 12  # measured acceleration, m/s2, base_link
IMU_STAMP, IMU_RATES = 13, 14  # s, and three turn rates
IMU_WIDTH = 17
IMU_NOISES = 6  # per tick

# Odometry, in odom.
ODOMETRY_NEXT_NOISE, ODOMETRY_SCALE_X, ODOMETRY_SCALE_Y, ODOMETRY_NOISE, ODOMETRY_STILL = 1, 2, 3, 4, 5
ODOMETRY_STATE = 6  # and seven more: stamp; x, y, yaw; vx, vy, turn rate (base_link); distance
ODOMETRY_WIDTH = 14
ODOMETRY_NOISES = 2  # per tick

# Motion status.
STATUS_IMPACT_MIN, STATUS_STAMP, STATUS_IMPACTS, STATUS_SLIPPING = 1, 2, 3, 6  # m/s2; s; stamps of 3; ticks of slip
STATUS_WIDTH = 7

# Gimbal: its yaw axis, relative to the body.
GIMBAL_HULL_YAW, GIMBAL_HULL_TURNS = 1, 2  # yaw of the hull at the last tick; its turns since the start, rad
GIMBAL_YAW, GIMBAL_RATE, GIMBAL_LOWEST, GIMBAL_HIGHEST, GIMBAL_ACCELERATION, GIMBAL_SPEED_MAX = 3, 4, 5, 6, 7, 8
GIMBAL_WIDTH = 9

# Dock contact; and docks: x, y, cosine, sine and value of yaw, floor.
CONTACT_DISTANCE, CONTACT_ANGLE, CONTACT_MADE = 1, 2, 3  # tolerances; flag: at a dock
CONTACT_WIDTH = 4
DOCK_WIDTH = 6

# People. A person who does anything but stand, wait or walk acts.
PERSON_STATE = 0  # one of the next four
STANDS, WAITS, WALKS, ACTS = 0.0, 1.0, 2.0, 3.0
PERSON_X, PERSON_Y, PERSON_YAW = 1, 2, 3
PERSON_GOAL_X, PERSON_GOAL_Y, PERSON_SPEED = 4, 5, 6  # of the current walk
PERSON_IDLE = 7  # further ticks of a wait
PERSON_WALKED = 8  # flag: walked in the last tick
PERSON_DISTANCE, PERSON_WAITED = 9, 10  # m walked so far; s for which a robot has stood in the way
PERSON_FLOOR, PERSON_BODY = 11, 12  # place among the movable bodies of the physics
PERSON_WIDTH = 13

# Stages of a tick at which ``ticks.run`` leaves the rest to others.
DONE, GIMBALS, DRIVE, PEOPLE, NEAR, STUCK, SETTLING, SEEN, TOUCHED, MEASURED, WATCHED, RECKONED = range(12)
STAGE_UNIT, COUNT_UNIT, TICKS_UNIT = 2, 32, 32 * 65536  # of the parts of its answer; odd: something moved
