"""Linear algebra on 3x3 matrices."""

from __future__ import annotations

from roboglot.kernels.arrays import FloatArray
from roboglot.kernels.compiled import CHECKED, kernel


@kernel("void(float64[:,::1])", error_model=CHECKED)
def invert(matrix: FloatArray) -> None:
    """Turn a symmetric positive definite 3x3 matrix into its inverse, by cofactors. Raises ZeroDivisionError."""
    a, b, c = matrix[0, 0], matrix[0, 1], matrix[0, 2]
    d, e, f = matrix[1, 1], matrix[1, 2], matrix[2, 2]
    xx, xy, xz = d * f - e * e, c * e - b * f, b * e - c * d
    yy, yz, zz = a * f - c * c, b * c - a * e, a * d - b * b
    determinant = a * xx + b * xy + c * xz
    matrix[0, 0], matrix[0, 1], matrix[0, 2] = xx / determinant, xy / determinant, xz / determinant
    matrix[1, 0], matrix[1, 1], matrix[1, 2] = xy / determinant, yy / determinant, yz / determinant
    matrix[2, 0], matrix[2, 1], matrix[2, 2] = xz / determinant, yz / determinant, zz / determinant
