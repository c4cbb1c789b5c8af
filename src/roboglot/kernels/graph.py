"""Pose graphs: poses that best fit many measured relative poses, by Gauss-Newton with conjugate gradients.

Loops instead of array expressions: Numba compiles them ten times as fast, and they run as fast.
"""

from __future__ import annotations

import numpy as np

from roboglot.kernels.arrays import FloatArray, Int32Array
from roboglot.kernels.compiled import CHECKED, kernel
from roboglot.kernels.linear import invert

SETTLED = 1e-4  # m, rad: iterations end when no pose moves farther
RESIDUAL = 1e-6  # of the linear system, relative
STEPS_MAX = 500  # of conjugate gradients
ROBUST = 9.0  # squared standard deviations beyond which an edge loses its influence


@kernel("void(float64[:,::1], int32[:,::1], float64[:,::1], float64[:,::1], float64[:,:,::1], float64[:,::1])")
def _linearise(
    poses: FloatArray,
    pairs: Int32Array,
    measured: FloatArray,
    weights: FloatArray,
    slopes: FloatArray,
    system: FloatArray,
) -> None:
    """Fill in each edge's Jacobian (3, 6) by its two poses, and its 3 residuals and 3 weights after the robust cut."""
    for k in range(pairs.shape[0]):
        i, j = pairs[k, 0], pairs[k, 1]
        dx, dy = poses[j, 0] - poses[i, 0], poses[j, 1] - poses[i, 1]
        c, s = np.cos(poses[i, 2]), np.sin(poses[i, 2])
        system[k, 0] = c * dx + s * dy - measured[k, 0]
        system[k, 1] = -s * dx + c * dy - measured[k, 1]
        turn = poses[j, 2] - poses[i, 2] - measured[k, 2]
        system[k, 2] = np.arctan2(np.sin(turn), np.cos(turn))
        strain = 0.0
        for r in range(3):
            strain += weights[k, r] * system[k, r] * system[k, r]
        for r in range(3):
            system[k, 3 + r] = weights[k, r] * min(1.0, ROBUST / max(strain, 1e-12))
        for r in range(3):
            for column in range(6):
                slopes[k, r, column] = 0.0
        slopes[k, 0, 0], slopes[k, 0, 1], slopes[k, 0, 2] = -c, -s, -s * dx + c * dy
        slopes[k, 1, 0], slopes[k, 1, 1], slopes[k, 1, 2] = s, -c, -c * dx - s * dy
        slopes[k, 0, 3], slopes[k, 0, 4], slopes[k, 1, 3], slopes[k, 1, 4] = c, s, -s, c
        slopes[k, 2, 2], slopes[k, 2, 5] = -1.0, 1.0


@kernel("void(int32[:,::1], float64[:,:,::1], float64[:,::1], float64[:,::1], float64[:,::1])")
def _apply(pairs: Int32Array, slopes: FloatArray, system: FloatArray, step: FloatArray, result: FloatArray) -> None:
    """``result`` = normal matrix times ``step`` (n, 3); the first pose is held."""
    for i in range(result.shape[0]):
        result[i, 0], result[i, 1], result[i, 2] = 0.0, 0.0, 0.0
    for k in range(pairs.shape[0]):
        i, j = pairs[k, 0], pairs[k, 1]
        for r in range(3):
            value = 0.0
            for c in range(3):
                value += slopes[k, r, c] * step[i, c] + slopes[k, r, 3 + c] * step[j, c]
            value *= system[k, 3 + r]
            for c in range(3):
                result[i, c] += slopes[k, r, c] * value
                result[j, c] += slopes[k, r, 3 + c] * value
    result[0, 0], result[0, 1], result[0, 2] = 0.0, 0.0, 0.0


@kernel("Tuple((float64[:,:,::1], float64[:,:,::1]))(int64, int32[:,::1], float64[:,:,::1], float64[:,::1])")
def _chain(count: int, pairs: Int32Array, slopes: FloatArray, system: FloatArray) -> tuple[FloatArray, FloatArray]:
    """Return the normal matrix along the chain of poses, factorised: inverted blocks, and those beside them."""
    blocks, beside = np.zeros((count, 3, 3)), np.zeros((count, 3, 3))
    for k in range(pairs.shape[0]):
        i, j = pairs[k, 0], pairs[k, 1]
        for r in range(3):
            weight = system[k, 3 + r]
            for a in range(3):
                for b in range(3):
                    blocks[i, a, b] += slopes[k, r, a] * slopes[k, r, b] * weight
                    blocks[j, a, b] += slopes[k, r, 3 + a] * slopes[k, r, 3 + b] * weight
                    if j == i + 1:
                        beside[i, a, b] += slopes[k, r, a] * slopes[k, r, 3 + b] * weight
    for a in range(3):
        for b in range(3):
            blocks[0, a, b], beside[0, a, b] = (1.0 if a == b else 0.0), 0.0
    for i in range(1, count):
        for a in range(3):
            blocks[i, a, a] += 1e-9
            for b in range(3):
                for c in range(3):
                    for d in range(3):
                        blocks[i, a, b] -= beside[i - 1, c, a] * blocks[i - 1, c, d] * beside[i - 1, d, b]
        invert(blocks[i])
    return blocks, beside


@kernel("void(float64[:,:,::1], float64[:,:,::1], float64[:,::1], float64[:,::1])")
def _solve_chain(blocks: FloatArray, beside: FloatArray, right: FloatArray, result: FloatArray) -> None:
    """``result`` = inverse of the chain's part times ``right``."""
    count = right.shape[0]
    for i in range(count):
        for a in range(3):
            result[i, a] = right[i, a]
        if i > 0:
            for a in range(3):
                for b in range(3):
                    result[i, a] -= beside[i - 1, b, a] * result[i - 1, b]
        x, y, z = result[i, 0], result[i, 1], result[i, 2]
        for a in range(3):
            result[i, a] = blocks[i, a, 0] * x + blocks[i, a, 1] * y + blocks[i, a, 2] * z
    for i in range(count - 2, -1, -1):
        x, y, z = result[i + 1, 0], result[i + 1, 1], result[i + 1, 2]
        p = beside[i, 0, 0] * x + beside[i, 0, 1] * y + beside[i, 0, 2] * z
        q = beside[i, 1, 0] * x + beside[i, 1, 1] * y + beside[i, 1, 2] * z
        r = beside[i, 2, 0] * x + beside[i, 2, 1] * y + beside[i, 2, 2] * z
        for a in range(3):
            result[i, a] -= blocks[i, a, 0] * p + blocks[i, a, 1] * q + blocks[i, a, 2] * r


@kernel("float64(float64[:,::1], float64[:,::1])")
def _product(left: FloatArray, right: FloatArray) -> float:
    """Return the sum of the products of the elements."""
    total = 0.0
    for i in range(left.shape[0]):
        for c in range(3):
            total += left[i, c] * right[i, c]
    return total


@kernel("void(float64[:,::1], float64, float64[:,::1])")
def _follow(direction: FloatArray, share: float, fresh: FloatArray) -> None:
    """``direction`` = ``fresh`` + ``share`` * ``direction``."""
    for i in range(direction.shape[0]):
        for c in range(3):
            direction[i, c] = fresh[i, c] + share * direction[i, c]


@kernel("float64[:,::1](int64, int32[:,::1], float64[:,:,::1], float64[:,::1])", error_model=CHECKED)
def _solve(count: int, pairs: Int32Array, slopes: FloatArray, system: FloatArray) -> FloatArray:
    """Return the Gauss-Newton step, by conjugate gradients after the chain's part, which is solved exactly."""
    right = np.zeros((count, 3))
    for k in range(pairs.shape[0]):
        for r in range(3):
            for side in range(2):
                for c in range(3):
                    right[pairs[k, side], c] -= slopes[k, r, 3 * side + c] * system[k, 3 + r] * system[k, r]
    right[0, 0], right[0, 1], right[0, 2] = 0.0, 0.0, 0.0
    blocks, beside = _chain(count, pairs, slopes, system)
    step, applied, scaled = np.zeros((count, 3)), np.empty((count, 3)), np.empty((count, 3))
    _solve_chain(blocks, beside, right, scaled)
    direction, power = np.zeros((count, 3)), _product(right, scaled)
    _follow(direction, 0.0, scaled)
    enough = power * RESIDUAL * RESIDUAL
    for _ in range(STEPS_MAX):
        if power <= enough or power == 0.0:
            break
        _apply(pairs, slopes, system, direction, applied)
        length = power / _product(direction, applied)
        for i in range(count):
            for c in range(3):
                step[i, c] += length * direction[i, c]
                right[i, c] -= length * applied[i, c]
        _solve_chain(blocks, beside, right, scaled)
        before, power = power, _product(right, scaled)
        _follow(direction, power / before, scaled)
    return step


@kernel("float64[:,::1](float64[:,::1], int32[:,::1], float64[:,::1], float64[:,::1], int64)")
def relaxed(
    poses: FloatArray, pairs: Int32Array, measured: FloatArray, weights: FloatArray, iterations: int
) -> FloatArray:
    """``poses`` (n, 3: x, y, yaw) moved so that they fit the edges best; the first one stays.

    Edge k says that pose ``pairs[k, 1]`` lies at ``measured[k]`` in the frame of pose ``pairs[k, 0]``; ``weights`` are
    inverse variances (1/m2, 1/m2, 1/rad2).
    """
    result = np.empty((poses.shape[0], 3))
    for i in range(poses.shape[0]):
        result[i, 0], result[i, 1], result[i, 2] = poses[i, 0], poses[i, 1], poses[i, 2]
    slopes, system = np.empty((pairs.shape[0], 3, 6)), np.empty((pairs.shape[0], 6))
    for _ in range(iterations):
        _linearise(result, pairs, measured, weights, slopes, system)
        step = _solve(poses.shape[0], pairs, slopes, system)
        farthest = 0.0
        for i in range(poses.shape[0]):
            for c in range(3):
                result[i, c] += step[i, c]
                farthest = max(farthest, abs(step[i, c]))
        if farthest < SETTLED:
            break
    return result
