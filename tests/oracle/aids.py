"""Aids of the navigation filter: a barometer, a compass and the baseline of two antennas."""

import numpy as np

BAROMETER, COMPASS = 21, 22
SENSORS = ("barometer", "compass", "baseline")
SENSOR_OF = {"height": 0, "pressure": 0, "heading": 1, "baseline": 2}
LIMITS = {
    None: (10.0, 10.0, 1.0, 0.05, 0.17),
    "wheeled": (5.0, 5.0, 0.5, 0.05, 0.1),
}
OUTPUTS = ("position", "height", "velocity", "attitude", "heading")
NIS_MAX = (9.0, 9.0, 16.27)
LEARNED_MAX = (5.0, 0.2, 0.5)
SIGMA_MIN, SIGMA_MAX = (1e-3, 1e-4, 1e-4), 1e6
# Seconds of agreement with the filter, and of readings with each other.
AGREEMENT, CHANGE = (1.0, 2.0, 2.0), (3.0, 10.0, 10.0)
REFERENCE_SIGMA, GAIN_MAX = 1e3, 1e13


def wrapped(angle):
    return angle if abs(angle) <= np.pi else angle - 2.0 * np.pi * np.round(angle / (2.0 * np.pi))


def skew(v):
    x, y, z = np.asarray(v).tolist()
    return np.array([[0.0, -z, y], [z, 0.0, -x], [-y, x, 0.0]])


def pressure_height(p):
    """Height in the standard atmosphere, and metres a pascal, by its definition of 1976."""
    if not 5474.89 <= p <= 115000.0:
        return None
    if p < 22632.06:
        scale = 6341.6156
        return 11000.0 + scale * np.log(22632.06 / p), scale / p
    scale, exponent = 288.15 / 0.0065, 0.1902632373
    power = (p / 101325.0) ** exponent
    return scale * (1.0 - power), scale * exponent * power / p


class Sensor:
    """Whether readings are believed, and the noise that their innovations show."""

    def __init__(self, index):
        self.index, self.axes = index, 3 if index == 2 else 1
        self.spread, self.count = np.zeros(self.axes), 0
        self.time, self.counts = np.nan, {"used": 0, "rejected": 0, "refused": 0}
        self.value, self.equal_since = None, np.nan
        self.restart()

    def restart(self):
        self.last, self.last_time = np.zeros(self.axes), np.nan
        self.nis = np.nan
        self.calm()

    def calm(self):
        self.mean, self.rejected, self.disturbed = np.zeros(self.axes), 0, False
        self.agrees_since, self.first = None, None

    def learn(self, time, z):
        if time - self.last_time <= 1.5:
            self.count += 1
            w = max(0.03, 1.0 / self.count)
            new = 0.5 * (z - self.last) ** 2
            if self.count > 1:
                new = np.minimum(new, 4.0 * self.spread)
            self.spread = (1.0 - w) * self.spread + w * new
        self.last, self.last_time = z, time

    def noise(self, sigma, adapt):
        told = sigma[: self.axes] ** 2
        if self.count < 10 or adapt == "fixed":
            return told
        shown = np.maximum(self.spread, told if adapt == "inflate" else 1e-4 * told)
        return np.minimum(shown, np.maximum(told, LEARNED_MAX[self.index] ** 2))

    def is_frozen(self, value, moving):
        if self.value is None or not np.array_equal(self.value, value):
            self.value, self.equal_since = value, self.time
        return moving and self.time - self.equal_since > 2.0

    def decide(self, time, passes, error, variance, broken):
        if broken:
            self.disturbed, self.agrees_since, self.first = True, None, None
            return "reject"
        if passes and np.max(np.abs(self.mean)) <= 0.7:
            self.rejected, self.first = 0, None
            if self.disturbed:
                self.agrees_since = time if self.agrees_since is None else self.agrees_since
                if time - self.agrees_since < AGREEMENT[self.index]:
                    return "reject"
                self.calm()
            return "take"
        self.agrees_since = None
        self.rejected += 1
        self.disturbed = self.disturbed or self.rejected >= 2
        if self.first is None or np.sum((error - self.first[0]) ** 2) > 18.0 * variance:
            self.first = (error, time)
        elif time - self.first[1] >= CHANGE[self.index]:
            self.calm()
            return "change"
        return "reject"


class Aided:
    """Part of the filter's twin."""

    def begin_aids(
        self,
        barometer_sigma=0.5,
        barometer_walk=0.02,
        compass_sigma=0.035,
        compass_walk=0.001,
        baseline=None,
        limits=None,
    ):
        self.usual_sigmas = (barometer_sigma, 0.05, 0.02)
        self.compass_sigma, self.walks = compass_sigma, np.array([barometer_walk, compass_walk])
        self.baseline = baseline
        usual = dict(zip(OUTPUTS, LIMITS["wheeled" if self.wheeled else None], strict=True))
        self.limits = np.array(list({**usual, **(limits or {})}.values()))
        self.sensors = [Sensor(k) for k in range(3)]
        self.reference, self.offset = 0.0, 0.0
        self.gains, self.walked = np.zeros(2), np.nan
        self.heading_start = None
        self.usable = np.zeros(5, dtype=bool)

    def restart_aids(self):
        for sensor in self.sensors:
            sensor.restart()
        self.heading_start = None

    def take_out(self, x):
        self.reference += x[BAROMETER]
        self.offset = wrapped(self.offset + x[COMPASS])

    def judge_outputs(self):
        parts = (slice(0, 2), slice(2, 3), slice(3, 6), slice(6, 8), slice(8, 9))
        sizes = np.array([np.sum(self.sigma[part] ** 2) for part in parts])
        share = np.where(self.usable, 1.0, 0.49)
        self.usable = sizes <= share * self.limits**2

    def walk_constants(self):
        """Variances that the constants gain with a step."""
        if np.isnan(self.walked):
            return
        more = self.walks**2 * max(self.time - self.walked, 0.0) + self.gains
        self.walked, self.gains = self.time, np.zeros(2)
        for k, gain in zip((BAROMETER, COMPASS), more, strict=True):
            if self.P[k, k] > 0.0:
                self.P[k, k] += min(gain, GAIN_MAX - min(self.P[k, k], GAIN_MAX))

    def update_aid(self, kind, t, value, sigma=None, baseline=None):
        index = SENSOR_OF[kind]
        sensor = self.sensors[index]
        verdict = self.looked_at_aid(sensor, kind, t, value, sigma, baseline)
        sensor.counts[verdict] += 1
        return verdict

    def looked_at_aid(self, sensor, kind, t, value, sigma, baseline):
        age, per = self.time - t, 1.0
        raw = np.array([np.nan] if value is None else value, dtype=float).reshape(-1)
        given = raw
        if kind == "pressure":
            found = pressure_height(raw[0])
            if found is None:
                return "refused"
            given, per = np.array([found[0]]), found[1]
        bound = (1e6, 4.0 * np.pi, 2e3)[sensor.index]
        there = np.all(np.abs(given) <= bound)
        if not (there and -0.1 <= age <= 1.0 and t >= self.start.time) or t <= sensor.time:
            return "refused"
        sensor.time = t
        usual = self.usual_sigmas[sensor.index]
        spread = usual if sigma is None else np.broadcast_to(sigma, sensor.axes) * per
        spread = np.clip(np.broadcast_to(spread, sensor.axes), SIGMA_MIN[sensor.index], SIGMA_MAX)
        known = self.baseline if baseline is None else baseline
        if not self.navigating:
            if sensor.index != 1:
                return "refused"
            return self.start_heading(given[0], spread[0], age)
        self.begin_constant(sensor.index, given[0], age)
        self.propagate()
        if not self.navigating:
            return "refused"
        measured = self.measured_aid(sensor.index, given, age, known)
        if measured is None:
            return "refused"
        return self.gated(sensor, raw, given, spread, known, *measured)

    def begin_constant(self, index, value, age):
        if index == 2 or self.P[(BAROMETER, COMPASS)[index]][(BAROMETER, COMPASS)[index]] > 0.0:
            return
        if index == 0:
            self.reference = value - self.height_at(age)
            self.P[BAROMETER, BAROMETER] = REFERENCE_SIGMA**2
        else:
            self.P[COMPASS, COMPASS] = self.compass_sigma**2
        if np.isnan(self.walked):
            self.walked = self.time

    def height_at(self, age):
        return self.height + self.v[2] * age - 0.5 * self.a[2] * age**2

    def heading_at(self, age):
        north, east, down = self.C[:, 0]
        level = north**2 + east**2
        if level < 0.03:
            return None
        row = np.array([-down * north / level, -down * east / level, 1.0])
        return np.arctan2(east, north) - row @ self.C @ (self.w - self.b_g) * age, row

    def measured_aid(self, index, value, age, baseline):
        """Innovation, its derivatives, and what a constant error of the sensor is constant in."""
        H = np.zeros((3 if index == 2 else 1, len(self.P)))
        if index == 0:
            z = value - self.reference - self.height_at(age)
            H[0, 2], H[0, BAROMETER] = 1.0, 1.0
            error = z
        elif index == 1:
            found = self.heading_at(age)
            if found is None:
                return None
            z = np.array([wrapped(value[0] - self.offset - found[0])])
            H[0, 6:9], H[0, COMPASS] = found[1], float(self.P[COMPASS, COMPASS] > 0.0)
            error = z
        else:
            body = np.array(baseline, dtype=float)
            turned = self.C @ body
            z = turned - self.C @ skew(self.w - self.b_g) @ body * age - value
            H[:, 6:9] = skew(turned)
            error = self.C.T @ z
        return z, H, error

    def gated(self, sensor, raw, value, sigma, baseline, z, H, error):
        moving = np.linalg.norm(self.v) >= 0.5 + 3.0 * np.linalg.norm(self.sigma[3:6])
        broken = sensor.is_frozen(raw, moving)
        if sensor.index == 2:
            length = np.linalg.norm(baseline)
            apart = abs(np.linalg.norm(value) - length)
            broken = broken or apart > 4.0 * np.max(sigma) + 0.02 * length
        sensor.learn(self.time, z)
        noise = sensor.noise(sigma, self.adapt)
        kept, x, nis = self.P, np.zeros(len(self.P)), 0.0
        for i, (h, one, variance) in enumerate(zip(H, z, noise, strict=True)):
            S = h @ self.P @ h + max(variance, 1e-8 * (h @ self.P @ h))
            u = np.clip((one - h @ x) / np.sqrt(S), -5.0, 5.0)
            self.P, x, more = self.correct([one], h[None], [variance], x)
            sensor.mean[i] += 0.05 * (u - sensor.mean[i])
            nis += more
        sensor.nis = nis
        passes = nis <= NIS_MAX[sensor.index]
        decision = sensor.decide(self.time, passes, error, np.max(noise), broken)
        if decision == "take":
            self.apply(x)
            return "used" if self.navigating else "refused"
        self.P = kept
        if decision == "change":
            k = (BAROMETER, COMPASS, None)[sensor.index]
            if k is not None and self.P[k, k] > 0.0:
                self.gains[k - BAROMETER] = min(100.0 * z[0] ** 2, GAIN_MAX)
        return "rejected"

    def start_heading(self, heading, sigma, age):
        begun = self.heading_start
        if (self.heading_known and begun is None) or self.ages[0] > 2.0:
            return "refused"
        found = self.heading_at(age)
        if found is None:
            return "refused"
        off = wrapped(heading - self.offset - found[0])
        agrees = off**2 <= 32.0 * sigma**2
        count = min((begun[0] if begun is not None and agrees else 0.0) + 1.0, 100.0)
        angle = off / count
        c, s = np.cos(angle), np.sin(angle)
        self.C = np.array([[c, -s, 0.0], [s, c, 0.0], [0.0, 0.0, 1.0]]) @ self.C
        self.heading_start = (count, sigma**2 / count, self.time)
        self.heading_known = True
        return "used"

    def take_heading_start(self):
        """The variance of a heading from the compass at the first fix."""
        if self.heading_start is None:
            return None
        _, variance, time = self.heading_start
        self.heading_start = None
        if self.P[COMPASS, COMPASS] == 0.0:
            self.P[COMPASS, COMPASS] = self.compass_sigma**2
        if np.isnan(self.walked):
            self.walked = self.time
        t = self.time - time
        return variance + self.P[COMPASS, COMPASS] + (self.N_g[2] + self.P[11, 11] * t) * t

    @property
    def aid_nis(self):
        return {name: one.nis for name, one in zip(SENSORS, self.sensors, strict=True)}
