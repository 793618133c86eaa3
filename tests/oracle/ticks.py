"""What the rest detector says of each tick, as the filters need it."""

from dataclasses import dataclass

from oracle.rest import RestDetector


@dataclass
class Tick:
    present: int
    mean: float
    variance: float
    event: str | None
    outliers: int
    stuck: int


class Ticks:
    def __init__(self, rate, rest_limit=None, bias_limit=None):
        self.arguments = rate, rest_limit, bias_limit
        self.reset()

    def reset(self):
        self.detector = RestDetector(*self.arguments)

    @property
    def length(self):
        return self.detector.length

    @property
    def stuck(self):
        return self.detector.stuck

    @property
    def provisional(self):
        return not self.detector.proven

    @property
    def standing(self):
        return self.detector.standing

    def judged(self, z):
        return self.detector.ticker.judged(z)

    def observe(self, z):
        """The tick that a sample completes."""
        told = self.detector.observe(z)
        if told is None:
            return None
        seen, event = told
        if event == "restart":
            event = "jump" if self.detector.at_rest else "forget"
        # A tick without samples that count tells nothing.
        mean, deviation = (seen.mean, seen.deviation) if seen.count else (0.0, 0.0)
        return Tick(seen.count, mean, deviation**2, event, seen.outliers, seen.stuck)


class Tally:
    """Samples that did not count although they were finite."""

    def __init__(self, limit=None):
        self.limit = float("inf") if limit is None else limit
        self.saturated_count = self.outlier_count = self.stuck_count = 0

    def within_range(self, z):
        """A sample, NaN for one at the end of the sensor's range."""
        self.saturated = self.limit <= abs(z) < float("inf")
        self.saturated_count += self.saturated
        return float("nan") if self.saturated else z

    def add(self, tick):
        self.outlier_count += tick.outliers
        self.stuck_count += tick.stuck
