"""Bias and its temperature slope, learned at rest: Kalman filters that differ in their walk."""

import math

import numpy as np

from oracle.ticks import Ticks

# Variance that the walk adds in one tick, over the white variance of one full tick.
RATIOS = 10.0 ** np.arange(-7.0, 0.5)
# Half-Cauchy in the walk's deviation, about a walk as strong as the noise of five seconds.
MIDDLE = 2.5e-3
PRIOR = np.sqrt(RATIOS / MIDDLE) / (1.0 + RATIOS / MIDDLE)
# Ticks after which evidence counts for 1/e, and what the noise is believed to be worth at first.
KEPT = 1.0 - 1.0 / 4000.0
DEGREES = 2.0
# Standard deviation of the slope before any sample: that of one sample of noise per kelvin.
SLOPE_SIGMA = 1.0
# Bounds of what is counted in deviations of the noise, and of kelvins from the reference.
LEVEL_MAX, VARIANCE_MAX, SLOPE_MAX, KELVIN_MAX = 1e12, 1e24, 1e8, 1e4
# Of answers, in units of the samples.
RAW_MAX, SIGMA_MAX = 1e300, 1e150
# Of the noise's variance over that of the first tick.
NOISE_MIN = 1e-12
# Ticks at most over which temperature is averaged, and what is left of them at the next change.
PACE_MAX, PACE_KEPT = 240.0, 0.75


class Thermometer:
    """Kelvins from the reference, averaged over as many ticks as lie between two changes.

    Of a thermometer of fine steps that is the mean of a tick. One of whole degrees stands still
    and jumps while the bias glides: taken as it is, it would show a bias that does not follow.
    """

    def __init__(self, reference):
        self.reference = reference
        self.last = self.kelvin = None
        self.sum, self.count, self.changed = 0.0, 0, False
        self.since, self.pace = 0, 1.0

    def observe(self, temperature):
        kelvin = temperature - self.reference
        if abs(kelvin) <= KELVIN_MAX:
            self.changed |= self.last is not None and kelvin != self.last
            self.last = kelvin
            self.sum += kelvin
            self.count += 1

    def end_tick(self):
        """The temperature of a tick; None before the first."""
        if self.count:
            self.since += 1
            if self.changed:
                self.pace = min(max(self.since, PACE_KEPT * self.pace), PACE_MAX)
                self.since = 0
            mean = self.sum / self.count
            before = mean if self.kelvin is None else self.kelvin
            self.kelvin = before + (mean - before) / self.pace
        self.sum, self.count, self.changed = 0.0, 0, False
        return self.kelvin


class TemperatureFilter:
    def __init__(
        self,
        rate,
        *,
        reference=25.0,
        slope=None,
        slope_sigma=None,
        walk=None,
        rest_limit=None,
        bias_limit=None,
    ):
        # A slope that is given is fixed if nothing is said of its error.
        fixed = slope is not None and slope_sigma is None
        self.slope_before = 0.0 if slope is None else slope
        self.slope_sigma_before = 0.0 if fixed else slope_sigma
        self.reference, self.walk = reference, walk
        self.ticks = Ticks(rate, rest_limit, bias_limit)
        # Of one full tick, s; a walk of `walk` per root second adds walk^2 times this.
        self.seconds = self.ticks.length / rate
        self.reset()

    def reset(self):
        self.ticks.reset()
        self.thermometer = Thermometer(self.reference)
        self.d = None
        self.reach, self.at_rest = 0.0, False
        self.forget()

    def forget(self):
        """Nothing has been learned."""
        self.offset = self.scale = 0.0
        self.begun = False

    def update(self, z, temperature=math.nan):
        """The bias after a sample, at its temperature."""
        self.thermometer.observe(temperature)
        if math.isfinite(z):
            self.reach = max(self.reach, min(abs(z), 1e300))
        tick = self.ticks.observe(z)
        if tick is not None:
            self.feel(self.thermometer.end_tick())
            self.take(tick)
        return self.bias

    def feel(self, kelvin):
        """What was learned before the first temperature counts as learned at that."""
        if self.d is None and kelvin is not None and self.scale > 0.0:
            self.x = bounded(self.x - self.k * kelvin)
            self.u = self.u - kelvin
        self.d = kelvin

    @property
    def kelvin(self):
        """From the reference; zero before the first temperature, as if it stayed there."""
        return 0.0 if self.d is None else self.d

    def take(self, tick):
        if tick.event == "forget":
            self.at_rest = False
            self.forget()
        elif tick.event is not None:
            self.at_rest = tick.event != "motion"
        if self.scale > 0.0:
            self.walk_on()
        if not self.at_rest or not tick.present:
            return
        if self.scale == 0.0:
            self.start(tick)
        elif tick.event == "jump":
            self.begin(self.counted(tick.mean), tick.present)
        else:
            self.correct(self.counted(tick.mean), 1.0 / tick.present, self.kelvin)

    def counted(self, z):
        """From the first tick on, in deviations of its samples."""
        return min(max((z - self.offset) / self.scale, -LEVEL_MAX), LEVEL_MAX)

    def start(self, tick):
        """The first tick at rest, or the first whose samples differ, gives offset and scale."""
        self.begun, self.offset = True, tick.mean
        self.scale = min(math.sqrt(tick.variance), SIGMA_MAX)
        if self.scale == 0.0:
            return
        sigma = self.slope_sigma_before
        spread = SLOPE_SIGMA if sigma is None else min(sigma / self.scale, SLOPE_MAX)
        self.k = np.full(
            RATIOS.size, np.clip(self.slope_before / self.scale, -SLOPE_MAX, SLOPE_MAX)
        )
        self.c = np.full(RATIOS.size, spread**2)
        self.evidence = np.zeros(RATIOS.size)
        self.degrees, self.squares = DEGREES, np.full(RATIOS.size, DEGREES)
        self.begin(0.0, tick.present)

    def begin(self, y, present):
        """The bias is that of a tick, whatever it was; the slope is what it was."""
        self.x = bounded(y - self.k * self.kelvin)
        self.v = np.full(RATIOS.size, 1.0 / present)
        self.u = np.full(RATIOS.size, -self.kelvin)

    @property
    def noise(self):
        """What variances are multiplied by: the noise, over that of the first tick."""
        return self.squares / self.degrees

    def walk_on(self):
        """One tick of random walk: of the bias alone, so only its own variance grows."""
        self.v = np.minimum(self.v + self.step, VARIANCE_MAX)

    @property
    def step(self):
        """Variance that each walk adds in a tick, over its noise."""
        if self.walk is None:
            return RATIOS / self.ticks.length
        return min(self.walk / self.scale, LEVEL_MAX) ** 2 * self.seconds / self.noise

    def correct(self, y, R, d):
        """One tick: Bierman's update of P = U D U', U = [1 u; 0 1], D = diag(v, c), H = [1 d]."""
        h = self.u + d
        e = y - (self.x + self.k * d)
        a = R + self.v
        S = a + h**2 * self.c
        self.learn(e, S)
        self.x = bounded(self.x + (self.v + self.u * h * self.c) / S * e)
        self.k = bounded(self.k + h * self.c / S * e)
        self.u = self.u - h * self.v / a
        self.v = self.v * R / a
        self.c = self.c * a / S

    def learn(self, e, S):
        """Evidence of each walk, Student's with the noise learned so far, then the noise."""
        square = e**2 / S
        spread = np.log1p(square / self.squares) * (self.degrees + 1.0) + np.log(S * self.noise)
        self.evidence = KEPT * self.evidence - 0.5 * spread
        self.degrees = KEPT * self.degrees + 1.0
        self.squares = np.maximum(KEPT * self.squares + square, NOISE_MIN * self.degrees)

    @property
    def weight(self):
        weight = PRIOR * np.exp(self.evidence - self.evidence.max())
        return weight / weight.sum()

    def mixture(self, values, variances):
        """Mean and standard deviation over all walks, counted in deviations."""
        mean = self.weight @ values
        spread = variances * self.noise + (values - mean) ** 2
        return mean, math.sqrt(self.weight @ spread)

    @property
    def level(self):
        values = self.x + self.k * self.kelvin
        return self.mixture(values, self.v + (self.u + self.kelvin) ** 2 * self.c)

    @property
    def bias(self):
        """At the last temperature; zero before the first rest, and its mean without noise."""
        if self.scale == 0.0:
            return self.offset
        return min(max(self.offset + self.scale * self.level[0], -RAW_MAX), RAW_MAX)

    @property
    def bias_sigma(self):
        """Of the mean over the next ten seconds; the largest sample before the first rest."""
        if self.scale == 0.0:
            return 0.0 if self.begun else self.reach
        values = self.x + self.k * self.kelvin
        walked = np.minimum(self.step * 10.0 / self.seconds / 3.0, VARIANCE_MAX)
        now = self.v + (self.u + self.kelvin) ** 2 * self.c
        sigma = self.scale * self.mixture(values, now + walked)[1]
        return max(sigma, abs(self.bias)) if self.ticks.provisional else sigma

    @property
    def slope(self):
        """Per kelvin."""
        if self.scale == 0.0:
            return self.slope_before
        return self.scale * self.mixture(self.k, self.c)[0]

    @property
    def slope_sigma(self):
        if self.scale == 0.0:
            return self.slope_sigma_before or 0.0
        return self.scale * self.mixture(self.k, self.c)[1]


def bounded(values):
    return np.clip(values, -LEVEL_MAX, LEVEL_MAX)
