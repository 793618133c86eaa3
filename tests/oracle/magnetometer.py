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
