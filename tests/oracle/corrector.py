"""The correction of an IMU by matrices, of a whole record at once."""

import numpy as np


def bias_over_temperature(temperature, reference, span, coefficients):
    """Polynomials between the ends of `span`; beyond, the tangent for as much as it is long."""
    low, high = span
    inside = np.clip(temperature, low, high)
    beyond = np.clip(temperature, low - (high - low), high + (high - low)) - inside
    rows = []
    for c in coefficients:
        curve = np.polynomial.Polynomial(c)
        x = (inside - reference) / 10.0
        rows.append(curve(x) + curve.deriv()(x) * beyond / 10.0)
    return np.stack(rows, axis=-1)


def held(values, before):
    """Each row that is missing as the last one that is not, `before` it as that."""
    seen = np.isfinite(values).reshape(len(values), -1).all(axis=1)
    last = np.maximum.accumulate(np.where(seen, np.arange(len(values)), -1))
    known = values[np.maximum(last, 0)].copy()
    known[last < 0] = before
    return known, seen


def corrected(
    z,
    gyro_matrix,
    gyro_bias,
    accel_matrix=None,
    accel_bias=None,
    g_sensitivity=None,
    temperature=None,
):
    """Rates (n, 3), and forces (n, 3) or None, of rows of 3, 6 or 7 numbers."""
    gyro, force, felt = z[:, :3], None, 0.0
    seen = np.isfinite(gyro).all(axis=1)
    if z.shape[1] > 3:
        accel = z[:, 3:6] - (np.zeros(3) if accel_bias is None else accel_bias)
        force = accel @ (np.eye(3) if accel_matrix is None else np.asarray(accel_matrix)).T
        known, present = held(force, np.zeros(3))
        force = np.where(present[:, None], force, np.nan)
        if g_sensitivity is not None:
            felt = known @ np.asarray(g_sensitivity).T
    bias = np.broadcast_to(gyro_bias, gyro.shape)
    if temperature is not None:
        t, _ = held(z[:, 6], np.nan)
        found = bias_over_temperature(
            t, temperature["reference"], temperature["range"], temperature["coefficients"]
        )
        bias = np.where(np.isfinite(t)[:, None], found, bias)
    rate = (gyro - bias - felt) @ np.asarray(gyro_matrix).T
    return np.where(seen[:, None], rate, np.nan), force
