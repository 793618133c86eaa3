"""Costs of the hypotheses on units and axes of gyro and magnetometer, in windows of a record.

All windows at once, tick by tick, in rotation matrices; `zerorate.checks` says what they mean.
"""

import itertools
import math

import numpy as np

TICK = 0.02
UNITS = (1.0, math.pi / 180.0, 180.0 / math.pi)
FLOOR = 0.01
BRIDGED = 0.05
MOST = 150


def rotations():
    """The 24 signed permutations of determinant 1, the identity first."""
    found = []
    for order in itertools.permutations(range(3)):
        for signs in itertools.product((1, -1), repeat=3):
            matrix = np.zeros((3, 3))
            matrix[range(3), order] = signs
            if np.linalg.det(matrix) > 0:
                found.append(matrix)
    return np.array(found)


ROTATIONS = rotations()


def cross(v):
    x, y, z = np.moveaxis(v, -1, 0)
    zero = np.zeros_like(x)
    return np.stack([zero, -z, y, z, zero, -x, -y, x, zero], axis=-1).reshape(*v.shape, 3)


def exponential(phi):
    angle = np.linalg.norm(phi, axis=-1)[..., None, None]
    x = cross(phi)
    half = np.sinc(angle / (2.0 * np.pi))
    return np.eye(3) + np.sinc(angle / np.pi) * x + 0.5 * half**2 * x @ x


def clipped(time, values):
    """Samples at the end of a sensor's range."""
    full = np.zeros(len(values), dtype=bool)
    step = -(-len(values) // 20_000)
    for axis in values.T:
        there = np.isfinite(axis)
        some = axis[::step][there[::step]]
        if not len(some):
            continue
        median = np.median(some)
        spread = np.median(np.abs(some - median))
        for end in (np.max(axis[there]), np.min(axis[there])):
            hits = there & (np.abs(axis - end) <= 1e-3 * abs(end))
            beside = hits[2:] & hits[1:-1] & hits[:-2]
            count = hits.sum()
            if 5 <= count < 0.1 * there.sum() and beside.any() and abs(end - median) > 20 * spread:
                full |= hits
    return full


def ticks(time, values, start, count):
    """Means over ticks, NaN where half of one or more is missing."""
    there = np.isfinite(values).all(axis=1) & ~clipped(time, values)
    period = np.median(np.diff(time))
    t, x = time[there], values[there]
    if not len(t):
        return np.full((count, 3), np.nan)
    near = np.diff(t) - period <= BRIDGED + 1e-9
    middle = (t[1:] + t[:-1]) / 2.0
    left = np.append(t[0] - period / 2, np.where(near, middle, t[1:] - period / 2))
    right = np.append(np.where(near, middle, t[:-1] + period / 2), t[-1] + period / 2)
    edges = start + TICK * np.arange(count + 1)
    knots = np.stack([left, right], axis=1).ravel()
    held = right - left
    columns = np.column_stack([held, held[:, None] * x])
    sums = np.concatenate([np.zeros((1, 4)), np.cumsum(columns, axis=0)])
    before_after = np.stack([sums[:-1], sums[1:]], axis=1).reshape(-1, 4)
    whole = np.stack([np.interp(edges, knots, c) for c in before_after.T], axis=1)
    part = np.diff(whole, axis=0)
    with np.errstate(invalid="ignore", divide="ignore"):
        means = part[:, 1:] / part[:, :1]
    means[part[:, 0] < 0.5 * TICK] = np.nan
    return means


def windows(rates, forces, length, most=MOST):
    """First ticks of windows, half of one apart, that miss nothing: those that tell most."""
    whole = np.isfinite(rates).all(axis=1) & np.isfinite(forces).all(axis=1)
    hop = length // 2
    lost = np.append(0, np.cumsum(~whole))
    starts = np.arange(0, len(rates) - length + 1, hop)
    starts = starts[lost[starts + length] == lost[starts]]
    if len(starts) <= most:
        return starts
    pieces = np.arange(8) * (length // 8)
    some = np.array(
        [[forces[s + p : s + p + length // 8].mean(axis=0) for p in pieces] for s in starts]
    )
    varies = some.var(axis=1).sum(axis=1)
    centre = np.nanmedian(rates[:: -(-len(rates) // 20_000)], axis=0)
    turned = np.array([np.abs(rates[s : s + length] - centre).sum() for s in starts])
    first = np.argsort(-varies, kind="stable")[: most * 2 // 3]
    rest = np.setdiff1d(np.arange(len(starts)), first)
    more = rest[np.argsort(-turned[rest], kind="stable")][: most - len(first)]
    return starts[np.sort(np.concatenate([first, more]))]


def triangles(length):
    """Weights of the three triangular means of a window, shape (3, length)."""
    block = length // 4
    rise = (np.arange(block) + 0.5) / block
    one = np.concatenate([rise, rise[::-1]]) / block
    found = np.zeros((3, length))
    for k in range(3):
        found[k, k * block : (k + 2) * block] = one
    return found


def carried(rates, forces, weights):
    """Tensors mean(R_ij a_c), (w, 3, 3, 3, 3) by window and mean; means of the integral of R."""
    w, n = rates.shape[:2]
    rotation = np.broadcast_to(np.eye(3), (w, 3, 3))
    tensor = np.zeros((w, len(weights), 3, 3, 3))
    psi, integral = np.zeros((w, len(weights), 3, 3)), np.zeros((w, 3, 3))
    half = exponential(rates * (TICK / 2))
    for k in range(n):
        if k == n // 2:
            middle = integral.copy()
        rotation = rotation @ half[:, k]
        now = integral + rotation * (TICK / 2)
        integral = integral + rotation * TICK
        product = rotation[:, :, :, None] * forces[:, k, None, None, :]
        for j in np.flatnonzero(weights[:, k]):
            tensor[:, j] += weights[j, k] * product
            psi[:, j] += weights[j, k] * now
        rotation = rotation @ half[:, k]
    return tensor, psi - middle[:, None] * weights.sum(axis=1)[:, None, None]


def costs(f):
    """Cost of windows whose three means are f, shape (w, 3, 3), and gravity."""
    mean = f.mean(axis=1)
    size = np.linalg.norm(mean, axis=1)
    g = np.median(size)
    scatter = ((f - mean[:, None]) ** 2).sum(axis=2).mean(axis=1)
    off = np.maximum(0.0, np.abs(size - g) - 0.05 * g) ** 2
    c = (scatter + off + max(0.0, 0.6 - g) ** 2) / max(g, 1e-300) ** 2
    return np.minimum(c, 4.0), g


def with_bias(f, psi, spread):
    """Costs with the constant error of the rate that makes them least, and that error."""
    best, bias = costs(f)[0], np.zeros(3)
    beta, moved = np.zeros(3), f
    for _ in range(2):
        c, g = costs(moved)
        weight = 1.0 / ((c + 0.05**2) * 3.0 * max(g, 1e-300) ** 2)
        jacobian = cross(moved) @ psi
        jacobian = jacobian - jacobian.mean(axis=1, keepdims=True)
        residual = moved - moved.mean(axis=1, keepdims=True)
        normal = np.einsum("w,wkij,wkil->jl", weight, jacobian, jacobian) + np.eye(3) / 0.1**2
        right = -np.einsum("w,wkij,wki->j", weight, jacobian, residual) - (beta + spread) / 0.1**2
        beta = beta + np.linalg.solve(normal, right)
        moved = np.einsum("wkij,wkj->wki", exponential(-(psi @ beta)), f)
        c = costs(moved)[0]
        if c.mean() < best.mean():
            best, bias = c, beta
    return best, bias


def unit_costs(rates, forces, starts, length, unit, bias):
    """Costs of the 48 senses of a unit, (48, w), and their biases, rad/s, (48, 3)."""
    places = starts[:, None] + np.arange(length)
    weights = triangles(length)
    found, biases = np.zeros((48, len(starts))), np.zeros((48, 3))
    for i, sign in enumerate((1.0, -1.0)):
        r = sign * (unit * rates[places] - bias)
        tensor, psi = carried(r, forces[places], weights)
        for j, q in enumerate(ROTATIONS):
            f = np.einsum("wkijc,cj->wki", tensor, q)
            found[24 * i + j], more = with_bias(f, sign * psi, bias)
            biases[24 * i + j] = bias + more
    found += np.linalg.norm(biases, axis=1)[:, None] > 0.35
    return found, biases


def null_costs(forces, starts, length):
    places = starts[:, None] + np.arange(length)
    return costs(np.einsum("kt,wti->wki", triangles(length), forces[places]))[0]


def gyro_costs(rates, forces):
    """Costs (3, 48, w), null (w,), biases (3, 48, 3), first ticks (w,), length."""
    starts, length = windows(rates, forces, 400), 400
    found = [unit_costs(rates, forces, starts, length, unit, np.zeros(3)) for unit in UNITS]
    longer = windows(rates, forces, 800)
    if len(longer) >= 6:
        starts, length = longer, 800
        begun = []
        for c, b in found:
            one = b[c.mean(axis=1).argmin()]
            begun.append(one * min(1.0, 0.175 / max(np.linalg.norm(one), 1e-300)))
        own = found[0][1][0]
        found = [
            unit_costs(rates, forces, starts, length, unit, b)
            for unit, b in zip(UNITS, begun, strict=True)
        ]
        for b in (np.zeros(3), own):
            c, biases = unit_costs(rates, forces, starts, length, 1.0, b)
            if c[0].mean() < found[0][0][0].mean():
                found[0][0][0], found[0][1][0] = c[0], biases[0]
    c, biases = (np.array(x) for x in zip(*found, strict=True))
    return c, null_costs(forces, starts, length), biases, starts, length


def fitted(rates, forces, starts, length, bias, fits=True):
    """Costs (w,) of the given gyro with what fits best, those 13 numbers and their deviations."""
    places = starts[:, None] + np.arange(length)
    weights, (g, a) = triangles(length), (rates[places], forces[places])
    prior = np.repeat([0.1, 0.1, 0.05], [3, 9, 1])
    x = np.concatenate([bias, np.zeros(10)])
    best = None
    for _ in range(4):
        f, jacobian = sensitivities(g, a, weights, x)
        c, gravity = costs(f)
        if best is None or c.mean() < best[0].mean():
            best = c, x
        weight = 3.0 / (c + FLOOR**2) if fits else 1.0 / (3.0 * (c + 0.05**2))
        weight /= gravity**2
        j = jacobian - jacobian.mean(axis=1, keepdims=True)
        r = f - f.mean(axis=1, keepdims=True)
        normal = np.einsum("w,wkip,wkiq->pq", weight, j, j) + np.diag(prior**-2.0)
        if best[1] is x:
            sigma = np.sqrt(np.diag(np.linalg.inv(normal)))
        right = -np.einsum("w,wkip,wki->p", weight, j, r) - x / prior**2
        x = x + np.linalg.solve(normal, right)
    return *best, sigma


def sensitivities(rates, forces, weights, x):
    """Means f of windows, (w, 3, 3), and their derivatives by bias, matrix and delay."""
    bias, matrix, delay = x[:3], np.eye(3) + x[3:12].reshape(3, 3), x[12]
    w, n = rates.shape[:2]
    raw = rates - bias
    rate = raw @ matrix.T
    half, later = exponential(rate * (TICK / 2)), exponential(rate * delay)
    rotation = np.broadcast_to(np.eye(3), (w, 3, 3))
    theta = np.zeros((w, 3, 12))
    f, jacobian = np.zeros((w, 3, 3)), np.zeros((w, 3, 3, 13))
    for k in range(n):
        rotation = rotation @ half[:, k]
        step = np.concatenate(
            [-rotation @ matrix, np.einsum("wai,wj->waij", rotation, raw[:, k]).reshape(w, 3, 9)],
            axis=2,
        )
        now = theta + step * (TICK / 2)
        theta = theta + step * TICK
        force = np.einsum("wij,wjk,wk->wi", rotation, later[:, k], forces[:, k])
        turned = np.einsum("wij,wj->wi", rotation, rate[:, k])
        columns = -cross(force) @ np.concatenate([now, turned[:, :, None]], axis=2)
        for j in np.flatnonzero(weights[:, k]):
            f[:, j] += weights[j, k] * force
            jacobian[:, j] += weights[j, k] * columns
        rotation = rotation @ half[:, k]
    return f, jacobian


def field_costs(rates, fields):
    """Costs (24, w), null (w,) and first ticks (w,) of windows of a magnetometer."""
    length, block = 1200, 25
    starts = windows(rates, fields, length, 60)
    places = starts[:, None] + np.arange(length)
    g, m = rates[places], fields[places]
    w, blocks = len(starts), length // block
    tensor, turns, psi = (np.zeros((w, blocks, *shape)) for shape in ((3, 3, 3), (3, 3), (3, 3)))
    rotation, integral = np.broadcast_to(np.eye(3), (w, 3, 3)), np.zeros((w, 3, 3))
    half = exponential(g * (TICK / 2))
    for k in range(length):
        if k == length // 2:
            middle = integral
        rotation = rotation @ half[:, k]
        b = k // block
        tensor[:, b] += rotation[:, :, :, None] * m[:, k, None, None, :] / block
        turns[:, b] += rotation / block
        psi[:, b] += (integral + rotation * (TICK / 2)) / block
        integral = integral + rotation * TICK
        rotation = rotation @ half[:, k]
    psi -= middle[:, None]
    found = [sense_costs(np.einsum("wkijc,cj->wki", tensor, q), turns, psi) for q in ROTATIONS]
    means = m.reshape(w, blocks, block, 3).mean(axis=2)
    null = ((means - means.mean(axis=1, keepdims=True)) ** 2).sum(axis=2).mean(axis=1)
    return np.array(found), null, starts


def sense_costs(y, turns, psi):
    """Costs of a sense in all windows, with field, hard iron and a bias of the gyro."""
    w, blocks = y.shape[:2]
    eye = np.broadcast_to(np.eye(3), turns.shape)
    design = np.concatenate([eye, turns], axis=3).reshape(w, 3 * blocks, 6)
    ridge = np.diag([0.0] * 3 + [1e-3] * 3)
    inverse = np.linalg.inv(np.einsum("wni,wnj->wij", design, design) + ridge)
    bias, best = np.zeros(3), None
    for _ in range(4):
        moved = np.einsum("wkij,wkj->wki", exponential(-(psi @ bias)), y)
        columns = np.concatenate([moved[..., None], cross(moved) @ psi], axis=3)
        columns = columns.reshape(w, 3 * blocks, 4)
        left = columns - design @ (inverse @ np.einsum("wni,wnj->wij", design, columns))
        c = np.minimum((left[..., 0] ** 2).sum(axis=1) / blocks, 4.0)
        if best is None or c.mean() < best.mean():
            best = c
        weight = 1.0 / ((c + 0.05**2) * blocks)
        j, r = left[..., 1:], left[..., 0]
        normal = np.einsum("w,wni,wnj->ij", weight, j, j) + np.eye(3) / 0.05**2
        right = -np.einsum("w,wni,wn->i", weight, j, r) - bias / 0.05**2
        bias = bias + np.linalg.solve(normal, right)
    return best
