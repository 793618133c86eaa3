"""NumPy twin of the partition of a magnetometer's record into spans of one hard iron."""

import numpy as np

PRICE, DROP, WILD, LONGEST, PER = 24.0, 64.0, 0.35, 60, 10


class Filters:
    """One filter of hard iron and field a start, side by side."""

    def __init__(self, variance, walk):
        self.variance, self.walk = variance, walk
        self.x = np.zeros((0, 6))
        self.P = np.zeros((0, 6, 6))

    def begin(self, field):
        x = np.concatenate([np.zeros(3), field])
        self.x = np.vstack([self.x, x])
        self.P = np.concatenate([self.P, np.eye(6)[None]])

    def keep(self, where):
        self.x, self.P = self.x[where], self.P[where]

    def step(self, e, B, ticks):
        """Cost of a tick for each, after ``ticks`` of walking."""
        P = self.P
        P[:, 3:, 3:] += np.eye(3) * (self.walk**2 * self.variance * 0.1 * ticks)
        H = np.hstack([B, np.eye(3)])
        PH = P @ H.T
        S = H @ PH + np.eye(3) * self.variance
        v = e - self.x @ H.T
        d = np.einsum("ai,aij,aj->a", v, np.linalg.inv(S), v)
        far = np.sqrt(np.maximum(d, 9.0) / 9.0)
        cost = np.log(np.linalg.det(S)) + np.where(d < 9.0, d, 18.0 * far - 9.0)
        S = S + np.eye(3) * ((far - 1.0) * self.variance)[:, None, None]
        K = PH @ np.linalg.inv(S)
        self.x = self.x + np.einsum("aij,aj->ai", K, v)
        P = P - K @ PH.transpose(0, 2, 1)
        self.P = 0.5 * (P + P.transpose(0, 2, 1))
        return cost


def partition(number, e, B, variance, walk):
    """Least cost, and spans (first second, last second, wild)."""
    seconds = int(number[-1]) // PER + 1
    edges = np.searchsorted(number, np.arange(seconds + 1) * PER)
    best, came = np.zeros(seconds + 1), [None] * (seconds + 1)
    starts, costs = np.zeros(0, int), np.zeros(0)
    filters = Filters(variance, walk)
    wild = 3.0 * (np.log(WILD**2) + 1.0) * np.diff(edges)
    for j in range(seconds):
        inside = slice(edges[j], edges[j + 1])
        if edges[j + 1] > edges[j]:
            starts = np.append(starts, j)
            costs = np.append(costs, 0.0)
            filters.begin(np.median(e[inside], axis=0))
        for k in range(edges[j], edges[j + 1]):
            ticks = number[k] - number[k - 1] if k else 1
            costs = costs + filters.step(e[k], B[k], ticks)
        found, way = best[j] + wild[j] + (PRICE if came[j] is None or not came[j][1] else 0), None
        i = j
        total = 0.0
        found = np.inf
        for i in range(j, max(j - LONGEST, -1), -1):
            total += wild[i]
            if best[i] + total + PRICE < found:
                found, way = best[i] + total + PRICE, (i, True)
        own = best[starts] + costs + PRICE
        if len(own) and own.min() < found:
            found, way = own.min(), (int(starts[own.argmin()]), False)
        best[j + 1], came[j + 1] = found, way
        keep = own - PRICE <= found + DROP
        starts, costs = starts[keep], costs[keep]
        filters.keep(keep)
    spans, j = [], seconds
    while j:
        i, is_wild = came[j]
        spans.append((i, j, is_wild))
        j = i
    return best[-1], spans[::-1]


IRON, SOFT, WALK, ROUNDS, LITTLE = 1.0, 0.2, 0.1, 8, 1e-9


def jacobian(rotation, window, groups, group, elements, values, fields):
    """Derivatives of every sample by every unknown, dense: fields, elements, hard irons."""
    n, windows, soft = len(rotation), len(fields), len(elements)
    found = np.zeros((n, 3, 3 * windows + soft + 3 * groups))
    D = np.eye(3) + np.tensordot(values, elements, axes=1)
    for k in range(n):
        w, g, back = window[k], group[k], rotation[k].T
        found[k, :, 3 * w : 3 * w + 3] = D @ back
        for i in range(soft):
            found[k, :, 3 * windows + i] = elements[i] @ back @ fields[w]
        first = 3 * windows + soft + 3 * g
        found[k, :, first : first + 3] = np.eye(3)
    return found


def left_of(rotation, field, group, window, elements, values, fields, iron):
    D = np.eye(3) + np.tensordot(values, elements, axes=1)
    seen = np.array([D @ b.T @ fields[w] for b, w in zip(rotation, window, strict=True)])
    return field - seen - iron[group]


def coupled(windows):
    """Second differences of neighbouring fields."""
    found = np.zeros((3 * windows, 3 * windows))
    for w in range(windows - 1):
        row = np.zeros((3, 3 * windows))
        row[:, 3 * w : 3 * w + 3], row[:, 3 * w + 3 : 3 * w + 6] = -np.eye(3), np.eye(3)
        found += row.T @ row / WALK**2
    return found


def fit(rotation, field, turned, group, window, elements):
    """Hard irons, elements, fields, scatter and weights, by dense Gauss-Newton rounds."""
    windows, groups, soft = window[-1] + 1, group.max() + 1, len(elements)
    fields = np.tile(np.median(turned, axis=0), (windows, 1))
    iron, values = np.zeros((groups, 3)), np.zeros(soft)
    prior = np.zeros(3 * windows + soft + 3 * groups)
    prior[3 * windows :] = 1.0 / IRON**2
    prior[3 * windows : 3 * windows + soft] = 1.0 / SOFT**2
    smooth = np.zeros((len(prior), len(prior)))
    smooth[: 3 * windows, : 3 * windows] = coupled(windows)
    for _ in range(ROUNDS):
        left = left_of(rotation, field, group, window, elements, values, fields, iron)
        squares = (left**2).sum(axis=1)
        variance = max(np.median(squares) / 3.0 / 0.79, 1e-10)
        weights = np.minimum(1.0, 2.5 * np.sqrt(variance / np.maximum(squares, 1e-30)))
        J = jacobian(rotation, window, groups, group, elements, values, fields)
        J = J.reshape(-1, len(prior))
        W = np.repeat(weights / variance, 3)
        now = np.concatenate([fields.ravel(), values, iron.ravel()])
        normal = (J.T * W) @ J + smooth + np.diag(prior + LITTLE)
        step = np.linalg.solve(normal, (J.T * W) @ left.ravel() - smooth @ now - prior * now)
        now = now + step
        fields = now[: 3 * windows].reshape(-1, 3)
        values = now[3 * windows : 3 * windows + soft]
        iron = now[3 * windows + soft :].reshape(-1, 3)
        if np.abs(step).max() < 1e-7:
            break
    left = left_of(rotation, field, group, window, elements, values, fields, iron)
    scatter = np.sqrt(np.mean((left**2).sum(axis=1) * weights) / 3.0)
    return iron, values, fields, scatter, weights


def covariance(rotation, group, window, elements, found, doubt):
    """Of elements, then hard irons: each group's information with its fields taken out."""
    iron, values, fields, scatter, weights = found
    soft, groups = len(elements), len(iron)
    information = np.diag(np.concatenate([1.0 / np.square(doubt), np.full(3 * groups, IRON**-2)]))
    for g in range(groups):
        mine = group == g
        inside, own = np.unique(window[mine], return_inverse=True)
        zeros = np.zeros(mine.sum(), dtype=int)
        J = jacobian(rotation[mine], own, 1, zeros, elements, values, fields[inside])
        J = J.reshape(-1, 3 * len(inside) + soft + 3)
        N = (J.T * np.repeat(weights[mine], 3)) @ J
        f = 3 * len(inside)
        N[:f, :f] += coupled(len(inside)) * max(scatter**2, 1e-10) + LITTLE * np.eye(f)
        part = N[f:, f:] - N[f:, :f] @ np.linalg.solve(N[:f, :f], N[:f, f:])
        count = np.clip(mine.sum() * 0.1 / 10.0, 0.5, 4.0)
        places = [*range(soft), *range(soft + 3 * g, soft + 3 * g + 3)]
        information[np.ix_(places, places)] += part * count / mine.sum() / max(scatter, 0.01) ** 2
    return np.linalg.inv(information)
