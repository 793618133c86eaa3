"""Whether the scale that a start-up has learned still fits."""

import math

LOUDER, LOUDER_TICK, QUIETER, PROOF, PERIOD = 1e6, 1e5, 1e-4, 16, 64


class Watch:
    def __init__(self):
        self.last, self.verdicts = math.nan, []

    def disproves(self, z, scale):
        """Looks at a sample, of which every 64th is shown."""
        if not math.isfinite(z):
            return False
        change, self.last = abs(z - self.last), z
        return self.judge(change, scale)

    def judge(self, change, scale, louder=LOUDER):
        if change > 0.0:
            self.verdicts.append(int(change > louder * scale) - int(change < QUIETER * scale))
        latest = self.verdicts[-PROOF:]
        return latest in ([1] * PROOF, [-1] * PROOF)
