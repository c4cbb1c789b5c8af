"""Layout of planes shared by the kernels that draw a picture and those that colour it."""

FIRST = 2  # number of the first polygon; 0 and 1 are floor and ceiling
COEFFICIENTS = 11  # of a polygon's plane, see ``raster``
