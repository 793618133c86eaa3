"""A foot whose stances are known: `oracle.navigation.Navigation` over a plane that does not turn.

Stances, rests and restored rates come from formulas with whole arrays; the filter is given zero
velocities, of which the gyro's biases are considered (Schmidt), rests and the floor.
"""

from types import SimpleNamespace

import numpy as np

from oracle.navigation import (
    ALL,
    GYRO,
    I3,
    PHI,
    RADIUS,
    Navigation,
    R,
    V,
    nearest_rotation,
    skew,
)

DEG, G = np.pi / 180.0, 9.81


class Plane:
    """A ball so large that it is one."""

    gravity, earth, meridian, parallel = G, np.zeros(3), RADIUS, RADIUS

    def transport(self, v):
        return np.array([v[1], -v[0], 0.0]) / RADIUS


def spans(flags):
    edges = np.flatnonzero(np.diff(np.r_[False, flags, False].astype(int)))
    return list(zip(edges[::2], edges[1::2], strict=True))


def unclipped(gyro, dt):
    """Restored rates, and the density of their noise."""
    gyro, variance = gyro.copy(), np.zeros(len(gyro))
    for axis, sign in [(axis, sign) for axis in range(3) for sign in (1.0, -1.0)]:
        x = sign * gyro[:, axis]
        most = x.max()
        at, near = np.sum(x > 0.96 * most), np.sum((x > 0.88 * most) & (x <= 0.96 * most))
        if most < 100.0 * DEG or at * dt < 0.1 or at < 0.5 * near:
            continue
        runs = [
            (a, b)
            for a, b in spans(x > 0.965 * most)
            if b - a >= 2 and (b - a) * dt <= 0.5 and a >= 3 and b + 3 <= len(x)
        ]
        peaks = [flanks(x, a, b) for a, b in runs]
        more = [peak - x[a:b] for peak, (a, b) in zip(peaks, runs, strict=True)]
        if not runs or np.concatenate(more).mean() < 0.015 * most:
            continue
        for (a, b), peak, excess in zip(runs, peaks, more, strict=True):
            variance[a:b] += (0.5 * excess.mean() + 0.05 * most) ** 2 * (b - a) * dt
            gyro[a:b, axis] = sign * np.clip(np.maximum(peak, x[a:b]), None, 2.0 * most)
    return gyro, variance


def flanks(x, a, b):
    """The cubic of Hermite from the sample before to the sample after."""
    m = b - a + 1
    s = np.arange(1, m) / m
    rise, fall = max(x[a - 1] - x[a - 2], 0.0), min(x[b + 1] - x[b], 0.0)
    return (
        (1.0 + 2.0 * s) * (1.0 - s) ** 2 * x[a - 1]
        + s * (1.0 - s) ** 2 * m * rise
        + s**2 * (3.0 - 2.0 * s) * x[b]
        - s**2 * (1.0 - s) * m * fall
    )


def windowed(values, half):
    """Means over a window that is shorter at the ends."""
    n = len(values)
    return np.array([values[max(k - half, 0) : k + half + 1].mean(axis=0) for k in range(n)])


def bound(gyro, accel, dt, bias, force):
    half = max(1, round(0.025 / dt))
    mean = windowed(accel, half)
    still = force * mean / np.linalg.norm(mean, axis=1, keepdims=True)
    turns, pushes = (np.sum(x**2, axis=1) for x in (gyro - bias, accel - still))
    return np.sqrt(0.1**2 * windowed(turns, half) + 0.0175**2 * windowed(pushes, half))


def best_part(gyro, dt):
    """Deviation, first and past the last, mean rate of the part that tells it best."""
    size = max(1, round(0.1 / dt))
    n = len(gyro) // size
    blocks = gyro[: n * size].reshape(n, size, 3).mean(axis=1)
    best = (np.inf,)
    for count in range(5, n + 1, max(1, n // 40)):
        for first in range(0, n - count + 1, max(1, count // 40)):
            part = blocks[first : first + count]
            d = part - part.mean(axis=0)
            rho = np.clip((d[1:] * d[:-1]).sum(axis=0) / (d**2).sum(axis=0), 0.0, 0.9)
            of_blocks = part.var(axis=0, ddof=1) / count * (1.0 + rho) / (1.0 - rho)
            least = (0.02 * DEG) ** 2 / (count * size * dt) + (0.01 * DEG) ** 2
            s = np.sqrt(of_blocks.mean() + least)
            if s < best[0]:
                best = (s, first * size, (first + count) * size, part.mean(axis=0))
    return best


def rests(u, gyro, dt, begin=0):
    """Rows of first, past the last, mean rate, deviation, and where the still interval ends."""
    found = []
    for a, b in spans(u < 0.01):
        if (b - a) * dt < 0.5:
            continue
        s, *part = best_part(gyro[a:b], dt)
        if s <= 0.2 * DEG and a + part[0] >= begin:
            found.append((a + part[0], a + part[1], part[2], s, b))
    return found


def levelled(force):
    x, y, z = -force / np.linalg.norm(force)
    roll, pitch = np.arctan2(y, z), np.arctan2(-x, np.hypot(y, z))
    (cr, sr), (cp, sp) = ((np.cos(a), np.sin(a)) for a in (roll, pitch))
    return np.array([[cp, sp * sr, sp * cr], [0.0, cr, -sr], [-sp, cp * sr, cp * cr]])


def about_down(angle):
    c, s = np.cos(angle), np.sin(angle)
    return np.array([[c, -s, 0.0], [s, c, 0.0], [0.0, 0.0, 1.0]])


def quaternion(C):
    from scipy.spatial.transform import Rotation

    return Rotation.from_matrix(C).as_quat(scalar_first=True)


class Foot(Navigation):
    """A whole recording: `positions` is known after each sample."""

    def __init__(self, time, gyro, accel, level=False):
        self.t, self.level, dt = time, level, (time[-1] - time[0]) / (len(time) - 1)
        gyro, self.extra_rate = unclipped(gyro, dt)
        force = np.linalg.norm(np.median(accel[: round(0.5 / dt)], axis=0))
        force = force if abs(force - G) < 0.3 else G
        u = bound(gyro, accel, dt, 0.0, force)
        found = rests(u, gyro, dt)
        rested = bool(found) and found[0][0] * dt < 1.5
        if rested:
            a, b, rate, s, _ = found[0]
            share = (0.3 * DEG) ** 2 / ((0.3 * DEG) ** 2 + s**2)
            mean = accel[a:b].mean(axis=0)
            size, b_g, b_a = np.linalg.norm(mean), share * rate, np.zeros(3)
            if abs(size - G) < 0.3:
                force, b_a = size, (size - G) / size * mean
            u = bound(gyro, accel, dt, b_g, force)
            found = rests(u, gyro, dt, b)
            sigmas = 0.01, 0.3 * DEG, np.sqrt(share) * s
        self.gyro, self.accel, self.u, self.found_rests = gyro, accel, u, found
        self.every, self.dt = max(1, round(0.02 / dt)), dt
        self.look_for_stances()
        self.origin, heading_sigma = 0, 1e-6
        if not rested:
            mean, level, speed = self.valley()
            b_g, b_a, sigmas = np.zeros(3), np.zeros(3), (speed, level, 0.3 * DEG)
        C = levelled(mean)
        if self.origin:
            self.lead = self.go_back(C)
            first = self.lead[0][1]
            C = about_down(-np.arctan2(first[1, 0], first[0, 0])) @ C
            self.lead = self.go_back(C)
            since = time[self.origin] - time[0]
            slope = first[2, 0] ** 2
            slope = np.sqrt(slope / max(1.0 - slope, 0.01))
            heading_sigma = np.hypot(sigmas[2] * since, sigmas[1] * slope)
        start = SimpleNamespace(
            quaternion=quaternion(C),
            heading_known=True,
            course=False,
            latitude=0.0,
            gyro_bias=b_g,
            accel_bias=b_a,
            level_sigma=sigmas[1],
            heading_sigma=heading_sigma,
            gyro_bias_sigma=sigmas[2],
            accel_bias_sigma=0.1,
            time=time[self.origin],
        )
        noise = [(0.05 * DEG, 1e-7), (0.03, 0.01)]
        super().__init__(
            start, *([np.repeat(part, 3) for part in one] for one in noise), covariance_step=1e9
        )
        self.C, self.place, self.navigating = C, Plane(), True
        self.P[R, R], self.P[V, V] = I3 * 1e-10, I3 * sigmas[0] ** 2

    def valley(self):
        """Mean force, and deviations of tilt and velocity, of the stance in which it begins."""
        marks = [int(group[np.argmin(self.u[group])]) for group in self.stances]
        early = [k for k in marks if self.t[k] - self.t[0] < 3.0] or marks[:1]
        low = min(self.u[k] for k in early)
        self.origin = next(k for k in marks if self.u[k] < 2.0 * max(low, 0.01))
        half, u = round(0.05 / self.dt), self.u[self.origin]
        mean = self.accel[max(self.origin - half, 0) : self.origin + half + 1].mean(axis=0)
        noise = (0.003**2 + u**2 * (1.0 + (u / 0.1) ** 2)) * max(1.0, 0.05 / (self.every * self.dt))
        return mean, max(3.0 * DEG, min(u / (0.0175 * G), 1.0)), np.sqrt(noise)

    def go_back(self, C):
        """Positions and attitudes before it begins: strapdown with time reversed."""
        from scipy.spatial.transform import Rotation

        place, speed, found = np.zeros(3), np.zeros(3), []
        for k in range(self.origin, 0, -1):
            dt = self.t[k] - self.t[k - 1]
            w, f = -self.gyro[[k, k - 1]], self.accel[[k, k - 1]]
            turn = w.mean(axis=0) * dt + np.cross(w[0], w[1]) * dt**2 / 12.0
            gain = f.mean(axis=0) * dt
            gain = (
                gain
                + (np.cross(w[0], f[1]) + np.cross(f[0], w[1])) * dt**2 / 12.0
                + 0.5 * np.cross(turn, gain)
            )
            frame = np.array([speed[1], -speed[0], 0.0]) / RADIUS
            pushed = C @ gain
            change = pushed + np.array([0.0, 0.0, G * dt])
            change -= np.cross(frame, speed + 0.5 * pushed) * dt
            place, speed = place + (speed + 0.5 * change) * dt, speed + change
            C = Rotation.from_rotvec(-frame * dt).as_matrix() @ C
            C = nearest_rotation(C @ Rotation.from_rotvec(turn).as_matrix())
            found.append((place, C))
        return found[::-1]

    def look_for_stances(self):
        n, round_ = len(self.u), round(0.7 / self.dt)
        self.nodes = np.arange(self.every, n, self.every)
        low = np.array([self.u[max(k - round_, 0) : k + round_ + 1].min() for k in self.nodes])
        here = self.u[self.nodes]
        stands = self.nodes[(here < 2.0 * np.maximum(low, 0.01)) & (here < 0.5)]
        gaps = np.flatnonzero(np.diff(stands) * self.dt >= 0.15)
        self.stances = np.split(stands, gaps + 1)
        self.stands = set(stands.tolist())
        self.lowest = {int(group[np.argmin(self.u[group])]) for group in self.stances}
        ends = [self.nodes[self.nodes <= rest[4] - 1][-1] for rest in self.found_rests]
        self.ends = dict(zip(ends, self.found_rests, strict=True))

    def settle(self):
        self.C = nearest_rotation(self.C)

    def growth(self, T, C, v):
        more, S = self.more, skew(v)
        G_ = super().growth(T, C, v)
        G_[PHI, PHI] += 0.5 * more[0] * I3
        G_[V, PHI] -= 0.5 * more[0] * S
        G_[PHI, V] -= 0.5 * more[0] * S.T
        G_[V, V] += 0.5 * (more[0] * S @ S.T + more[1] * I3)
        return G_

    def run(self):
        floor, rejected, begin = None, 0.0, self.origin
        positions = [place for place, _ in self.lead] + [np.zeros(3)] if begin else [np.zeros(3)]
        self.more = np.zeros(2)
        self.update(self.t[begin], self.gyro[begin], self.accel[begin])
        for k in range(begin + 1, len(self.t)):
            self.update(self.t[k], self.gyro[k], self.accel[k])
            dt, rate = self.t[k] - self.t[k - 1], self.gyro[k] - self.b_g
            shock = np.linalg.norm(self.accel[k]) - G
            own = 1e-6 * rate @ rate + self.extra_rate[k]
            self.more += dt * np.array([own, 0.015**2 * shock**2])
            if k % self.every == 0:
                self.propagate()
                self.more = np.zeros(2)
                x = np.zeros(ALL)
                if k in self.stands:
                    x, rejected = self.zero_velocity(k, x, rejected)
                if k in self.lowest and self.level:
                    x, floor = self.on_floor(x, floor)
                if k in self.ends:
                    _, _, mean, s, _ = self.ends[k]
                    self.P, x, _ = self.correct(mean - self.b_g, rows(GYRO), [s * s] * 3, x)
                self.apply(x)
            positions.append(np.array([self.latitude, self.longitude, 0.0]) * RADIUS)
            positions[-1][2] = -self.height
        return np.array(positions) - positions[0]

    def zero_velocity(self, k, x, rejected):
        u, T = self.u[k], self.every * self.dt
        noise = (0.003**2 + u**2 * (1.0 + (u / 0.1) ** 2)) * max(1.0, 0.05 / T)
        P, taken, nis = self.considering(noise, x)
        if nis > 100.0:
            rejected += T
            if rejected <= 0.15:
                return x, rejected
            square = self.v @ self.v
            self.P[V, V] += I3 * square
            self.P[R, R] += I3 * square / 4.0
            self.P[PHI, PHI] += np.diag([1e-3, 1e-3, 0.0])
            P, taken, _ = self.considering(noise, x)
        self.P = P
        return taken, 0.0

    def considering(self, noise, x):
        """With a gain of which the rows of the gyro's biases are zero."""
        P, nis = self.P.copy(), 0.0
        for h, z in zip(rows(V), self.v, strict=True):
            S, e = h @ P @ h + noise, z - h @ x
            gain = P @ h / S
            gain[GYRO] = 0.0
            keep = np.eye(ALL) - np.outer(gain, h)
            P = keep @ P @ keep.T + noise * np.outer(gain, gain)
            x, nis = x + gain * e, nis + e * e / S
        return P, x, nis

    def on_floor(self, x, floor):
        down = -self.height
        if floor is None or abs(down - x[2] - floor) >= 0.1:
            return x, down - x[2]
        self.P, x, _ = self.correct([down - floor], rows(R)[2:], [0.02**2], x)
        return x, floor


def rows(part):
    H = np.zeros((3, ALL))
    H[:, part] = I3
    return H
