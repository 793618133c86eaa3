"""What the self-tuning filter has learned of one sensor: its noise and its drift."""

import numpy as np

from oracle.allan_noise import AllanNoise
from oracle.flicker import Flicker
from oracle.walks import DEGREES, Walks

# Ticks of a block, and ticks after which a noise level counts for 1/e.
BLOCK = 8
NOISE_MEMORY = 240
# In variances of the start-up.
FLOOR = 1e-12
# Deviations of a sample that are followed, what the walks' interval is widened by, and what is
# stated before the first block over it.
SURPRISE = 4.0
CAUTION = 1.15
FRESH = 2.0
# Ticks that a noise counts for which one tick has shown.
FIRST_TICKS = 8
# Ratio of the variances of two noises that are not the same sensor's at rest.
ANOTHER = 9.0


class Learned:
    """In units of the start-up: ``offset`` and ``scale`` lead back to those of the samples."""

    def __init__(self, offset, scale, length, samples, rate):
        self.offset, self.scale, self.length = offset, scale, length
        self.tick_noise = AllanNoise(1.0 - 1.0 / NOISE_MEMORY)
        self.tick_noise.believe(1.0 / length, int(samples / length))
        self.sample_noise = 1.0
        self.ticks = samples / length
        block = length * BLOCK
        self.walks = Walks(1.0 / block)
        self.flicker = Flicker(1.0 / block, block / rate, rate)
        self.begin(offset, samples)

    @property
    def noise(self):
        """Variance of one sample whose means have the noise of the ticks' means."""
        return max(self.tick_noise.variance, FLOOR) * self.length

    def begin(self, mean, samples):
        level, variance = (mean - self.offset) / self.scale, self.noise / max(samples, 1)
        self.walks.begin(level, variance)
        self.flicker.begin(level, variance)
        self.state()
        self.block = []
        self.tick_noise.observe(np.nan)

    def learn(self, tick):
        mean = (tick.mean - self.offset) / self.scale
        there = 2 * tick.present >= self.length
        self.tick_noise.observe(mean if there else np.nan)
        if there:
            self.ticks = min(self.ticks + 1.0, NOISE_MEMORY)
            self.sample_noise += (tick.variance / self.scale**2 - self.sample_noise) / self.ticks
        self.block.append((tick.present, mean))
        if len(self.block) == BLOCK:
            self.finish_block()

    def finish_block(self):
        if self.gathered is None:
            self.go_on(1.0)
        else:
            degrees, block = self.walks.degrees, self.gathered
            self.flicker.correct(block, degrees, self.walks.correct(block))
            self.state()
        self.block = []

    def wait(self):
        self.tick_noise.observe(np.nan)
        self.go_on((len(self.block) + 1) / BLOCK)
        self.block = []

    def go_on(self, blocks):
        self.walks.wait(blocks)
        if self.flicker.wait(blocks):
            self.state()

    def state(self):
        """What is stated of the drift from now on."""
        self.variance = self.flicker.stated(self.walks)[0]

    def bias_sigma_over(self, seconds):
        return self.stated(self.flicker.over(self.walks, seconds)[0])

    @property
    def bias_instability(self):
        return self.scale * np.sqrt(self.flicker.stated(self.walks)[1])

    @property
    def of_walks(self):
        return CAUTION * self.scale * np.sqrt(self.walks.drift(self.gathered)[1])

    def stated(self, variance):
        """Before the first block the walks alone are known, and they rate the drift too low."""
        if self.walks.degrees == DEGREES:
            return FRESH * self.of_walks
        return self.scale * np.sqrt(variance)

    @property
    def gathered(self):
        """Mean of the block's samples, the variance of its noise, and its length in blocks."""
        present = sum(count for count, _ in self.block)
        if present == 0:
            return None
        mean = sum(count * mean for count, mean in self.block if count) / present
        return mean, self.noise / present, len(self.block) / BLOCK

    def is_another(self, tick):
        ratio = tick.variance / self.scale**2 / self.sample_noise
        return ratio > ANOTHER or ratio < 1.0 / ANOTHER

    def listen_anew(self, tick):
        variance = max(tick.variance / self.scale**2, FLOOR)
        louder = variance / max(self.sample_noise, FLOOR)
        self.tick_noise.believe(max(self.tick_noise.variance, FLOOR) * louder, FIRST_TICKS)
        self.sample_noise, self.ticks = variance, 1.0

    def drift(self):
        """In the unit of the samples; ``most`` is the largest difference that is followed."""
        mean, _, P = self.walks.drift(self.gathered)
        return {
            "estimate": self.offset + self.scale * mean,
            "bias_sigma": self.stated(self.variance),
            "walk_sigma": self.of_walks,
            "gain": P / (P + self.noise),
            "most": SURPRISE * self.scale * np.sqrt(self.sample_noise),
        }

    def noises(self):
        """In the unit of the samples, of one sample each."""
        return {
            "measurement_noise": self.scale**2 * self.sample_noise,
            "process_noise": self.scale**2 * self.walks.process_noise / (self.length * BLOCK),
        }
