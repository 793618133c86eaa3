"""Median of a stream and the median distance from it, from 32 samples at most."""

ROOM = 32
NORMAL = 1.482602218505602


class Sketch:
    def __init__(self):
        self.kept, self.stride, self.seen = [], 1, 0

    def insert(self, z):
        if self.seen % self.stride == 0:
            if len(self.kept) == ROOM:
                self.thin()
            self.kept = sorted([*self.kept, z])
        self.seen += 1

    def thin(self):
        """Of each pair the one nearer to the median stays."""
        half = ROOM // 2
        self.kept = self.kept[1:half:2] + self.kept[half::2]
        self.stride *= 2

    @property
    def median(self):
        n = len(self.kept)
        return 0.5 * (self.kept[(n - 1) // 2] + self.kept[n // 2]) if n else 0.0

    @property
    def deviation(self):
        """Where most samples are equal, the least distance that is not zero."""
        median = self.median
        distances = sorted([abs(z - median) for z in self.kept])[len(self.kept) // 2 :]
        if not distances:
            return 0.0
        if distances[0] > 0.0:
            return NORMAL * distances[0]
        return next((d for d in distances if d > 0.0), 0.0)
