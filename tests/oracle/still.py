"""Whether a sensor can be at rest at all, where it is known what rest can be."""

LASTING = 6
# Spread of the means, as a share of the deviation that samples may have.
STANDING = 0.3


class Still:
    def __init__(self, rest_limit=None, bias_limit=None):
        self.rest_limit, self.bias_limit = rest_limit, bias_limit
        self.standing = None if rest_limit is None else STANDING * rest_limit
        # Of ticks in a row that can be rest.
        self.means = []

    def take(self, seen):
        """Whether a tick can be one of rest."""
        if beyond(seen.deviation, self.rest_limit) or beyond(abs(seen.mean), self.bias_limit):
            self.means = []
            return False
        self.means = [*self.means, seen.mean][-LASTING:]
        if beyond(max(self.means) - min(self.means), self.standing):
            self.means = [seen.mean]
            return False
        return True

    @property
    def lasts(self):
        return len(self.means) == LASTING


def beyond(size, limit):
    return limit is not None and size > limit
