"""Kalman filters that know flicker, one a level, for the standard deviation of the drift alone."""

import numpy as np
from scipy.special import logsumexp
from scipy.stats import t as student

from oracle.walks import DEGREES, KEPT, NO_DRIFT, PRIOR

LEVELS = 1e-3 * 5.0 ** np.arange(8)
TIMES = np.array([5.0, 100.0])
PROCESS = np.log(20.0) / np.pi
WALK = 0.003
# Flicker in the Allan variance of ticks, of which a block has eight.
IN_TICKS = 2.0 * np.log(2.0) / np.pi / 8.0
PRIORS = {"none": 0.05, "walks": 0.10, "flicker": 0.85}
CAUTION = 1.1
STATED = 10.0


def unseen(seconds, rate):
    """Variance over B^2 of flicker faster than the states, in the mean of so many seconds."""
    slow = np.inf if seconds == 0.0 else 1.0 + 2.6 / seconds
    return np.log(max(min(slow, 8.94 * rate), 1.0)) / np.pi


def passage(seconds):
    """What is left of the states after so long, and the variances that arise, over B^2."""
    phi = np.array([*np.exp(-seconds / TIMES), 1.0])
    return phi, np.array([*(PROCESS * (1.0 - phi[:2] ** 2)), WALK * seconds])


def mean_of(seconds):
    """Part of the states in their mean, its variance given the start, and what both ends share."""
    if seconds == 0.0:
        return np.ones(3), 0.0, np.zeros(3)
    r = seconds / TIMES
    a = -np.expm1(-r) / r
    # The variance of the mean less what the start explains, without the terms that cancel.
    within = np.where(r < 1e-3, 2.0 * r / 3.0 - r**2 / 2.0, 2.0 * (1.0 - a) / r - a**2)
    common = np.array([*(PROCESS * a * -np.expm1(-r)), WALK * seconds / 2.0])
    return np.array([*a, 1.0]), PROCESS * within.sum() + WALK * seconds / 3.0, common


class Flicker:
    def __init__(self, noise, seconds, rate):
        """``noise`` is the variance of the white noise of a full block's mean."""
        self.seconds, self.rate = seconds, rate
        self.b = LEVELS * noise
        self.x = np.zeros((LEVELS.size, 3))
        self.P = np.zeros((LEVELS.size, 3, 3))
        self.squares = np.full(LEVELS.size, DEGREES)
        self.evidence = np.zeros(LEVELS.size)
        self.waiting = 0.0

    def begin(self, mean, variance):
        self.x = np.tile([0.0, 0.0, mean], (LEVELS.size, 1))
        own = PROCESS * self.b
        self.P = np.array([np.diag([g, g, variance + 2.0 * g]) for g in own])
        self.waiting = 0.0

    def wait(self, blocks):
        """True once a block's time is over, of which the states then know."""
        self.waiting += blocks
        if self.waiting < 1.0:
            return False
        self.catch_up()
        return True

    def catch_up(self):
        self.go_on(self.waiting * self.seconds)
        self.waiting = 0.0

    def go_on(self, seconds):
        phi, arises = passage(seconds)
        self.x = self.x * phi
        self.P = self.P * np.outer(phi, phi) + np.diag(arises) * self.b[:, None, None]

    def correct(self, block, degrees, best):
        """A full block, of which the walks have learned; ``best`` is the evidence of the best."""
        self.catch_up()
        mean, noise, _ = block
        a, within, common = mean_of(self.seconds)
        faster = max(unseen(self.seconds, self.rate) - IN_TICKS, 0.0)
        Pa = self.P @ a
        S = Pa @ a + self.b * (within + faster) + noise
        e = mean - self.x @ a
        c = Pa * passage(self.seconds)[0] + self.b[:, None] * common
        self.go_on(self.seconds)
        self.x = self.x + c * (e / S)[:, None]
        self.P = self.P - c[:, :, None] * c[:, None, :] / S[:, None, None]
        scale = self.squares / degrees
        likelihood = student.logpdf(e, degrees, scale=np.sqrt(S * scale))
        self.evidence = KEPT * self.evidence + likelihood - best
        self.squares = KEPT * self.squares + e**2 / S

    def stated(self, walks, seconds=STATED):
        """Variance of the mean drift over so many seconds, and B^2; none has waited."""
        a, within, _ = mean_of(seconds)
        own = np.einsum("i,mij,j->m", a, self.P, a)
        own = own + self.b * (within + unseen(seconds, self.rate))
        prior = PRIOR / np.where(np.arange(PRIOR.size) == 0, NO_DRIFT, 1.0 - NO_DRIFT)
        prior = prior * np.where(np.arange(PRIOR.size) == 0, PRIORS["none"], PRIORS["walks"])
        levels = np.full(LEVELS.size, PRIORS["flicker"] / LEVELS.size)
        evidence = np.concatenate([walks.evidence - walks.evidence.max(), self.evidence])
        weight = np.log(np.concatenate([prior, levels])) + evidence
        weight = np.exp(weight - logsumexp(weight))
        estimate = walks.weight @ walks.x
        own_walks = walks.P + walks.q * (seconds / self.seconds / 3.0)
        own = np.concatenate([own_walks * walks.scale, own * self.squares / walks.degrees])
        off = np.concatenate([walks.x, self.x @ a]) - estimate
        flicker = weight[-LEVELS.size :] @ (self.squares / walks.degrees * self.b)
        return CAUTION**2 * (weight @ (own + off**2)), flicker

    def over(self, walks, seconds):
        """The same also while the states have not been told of the time that has passed."""
        now = Flicker(1.0, self.seconds, self.rate)
        now.__dict__.update(self.__dict__)
        now.catch_up()
        return now.stated(walks, seconds)
