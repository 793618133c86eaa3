"""A bank of navigation filters: its filters, the weights that clones give, and what it shows."""

import math

import numpy as np
import pytest

import zerorate as zr
from support.drives import MODELS
from zerorate.navigation import NavigationBank
from zerorate.navigation.events import Events
from zerorate.record.samples import Samples

FACTORS = ((1.0, 1.0), (3.0, 1.0), (1.0, 5.0), (3.0, 5.0))
RECEIVERS = {
    "2 m": {},
    "2 cm": {"fixes_rate": 4.0, "position_sigma": 0.02, "velocity_sigma": 0.02},
    "positions": {"velocity_sigma": None},
}
COAST_S = (2.0, 5.0, 10.0)
STUDENT = 8.0
FADING_S = 300.0


def scaled(gyro, accel):
    """Return the noise of the simulator's sensors, times a factor each."""
    factors = {"gyro": gyro, "accel": accel}
    return {
        name: zr.NoiseModel(
            angle_random_walk=model.angle_random_walk * factors[name],
            rate_random_walk=model.rate_random_walk,
            quantity=model.quantity,
        )
        for name, model in MODELS.items()
    }


def driven(receiver, seed=3, duration=150.0):
    options = dict(RECEIVERS[receiver])
    velocities = options.pop("velocity_sigma", 0.1)
    drive = zr.simulate_drive(
        50.0, duration, seed=seed, velocity_sigma=velocities or 0.1, **options
    )
    fixes = drive.fixes if velocities else zr.Fixes(drive.fixes.time, drive.fixes.position)
    start = zr.align(drive.recording(), latitude=48.0, heading="course", accel_bias_sigma=0.05)
    samples = Samples.of(drive.recording(), mag=False, what="navigation")
    return samples, Events.of(fixes).rows, start


class Clones:
    """Real copies of a filter that coast, and the likelihood of their errors."""

    def __init__(self, nav):
        self.nav, self.clone, self.blocks = nav, None, []

    def take_sample(self, *sample):
        for one in filter(None, (self.nav, self.clone)):
            one.update(*sample)

    def take_fix(self, samples, k, row):
        self.compare(samples, k, row)
        if self.nav.update_gnss(row[0], row[1:4], row[4:7], row[7:10], row[10:13]) != "used":
            return
        over = self.clone is None or all(
            n == 3 or self.seconds(row) > COAST_S[n] + 1.5 for n in self.next
        )
        if over and self.nav.sigma[8] < 0.15:
            self.clone, self.began, self.next = self.nav.copy(), row[0], [0, 0]

    def seconds(self, row):
        return row[0] - self.began + 1e-6

    def compare(self, samples, k, row):
        for kind in range(2):
            if self.clone is None or not np.isfinite(row[1 + 3 * kind]) or self.next[kind] == 3:
                continue
            due = COAST_S[self.next[kind]]
            if self.seconds(row) < due:
                continue
            own = row.copy()
            own[4 - 3 * kind : 7 - 3 * kind] = np.nan
            self.next[kind] = 3 if self.seconds(row) > due + 1.5 else self.next[kind] + 1
            # A copy that has lost a minute knows less of its receiver: its gate is open.
            known, _ = self.clone.copy().process_arrays(
                [row[0] + 1e-5], samples.gyro[k : k + 1], samples.accel[k : k + 1], own[np.newaxis]
            )
            columns = slice(3 * kind, 3 * kind + 2)
            z, sigma = known["innovation"][0, columns], known["innovation_sigma"][0, columns]
            nis = ((z / sigma) ** 2).sum()
            tail = (STUDENT + 2.0) * math.log1p(nis / (STUDENT - 2.0))
            self.blocks.append((row[0], -np.log(sigma).sum() - 0.5 * tail))

    def log_weight(self, factors, time):
        at, likelihood = np.array(self.blocks).T
        theta = 2.0 * np.log(factors)
        return 0.5 * (np.exp((at - time) / FADING_S) * likelihood).sum() - (theta**2).sum() / 8.0


@pytest.mark.parametrize("receiver", RECEIVERS)
def test_it_shows_the_filter_whose_clones_are_likeliest_to_the_bit(receiver):
    samples, rows, start = driven(receiver)
    # Powers of two, whose products are exact; a tenth of the true noise, so that it changes.
    told = [scaled(gyro * 2.0**-17 / 1e-4, accel * 2.0**-13 / 1e-3) for gyro, accel in FACTORS]
    bank = NavigationBank(start, adapt="fixed", **told[0])
    ones = [Clones(zr.NavigationFilter(start, adapt="fixed", **noise)) for noise in told]
    shown, fixes = set(), iter(rows)
    row = next(fixes)
    for k, sample in enumerate(zip(samples.time, samples.gyro, samples.accel, strict=True)):
        bank.update(*sample)
        for one in ones:
            one.take_sample(*sample)
        while row is not None and row[0] <= sample[0]:
            bank.update_gnss(row[0], row[1:4], row[4:7], row[7:10], row[10:13])
            for one in ones:
                one.take_fix(samples, k, row)
            row = next(fixes, None)
        own = ones[FACTORS.index(tuple(bank.noise_factors.tolist()))].nav
        shown.add(FACTORS.index(tuple(bank.noise_factors.tolist())))
        for name in ("position", "velocity", "quaternion", "sigma", "covariance", "nis"):
            np.testing.assert_array_equal(getattr(bank, name), getattr(own, name))
        assert bank.status == own.status
    if receiver == "2 cm":
        assert len(shown) > 1
    expected = np.array(
        [one.log_weight(factors, bank.time) for one, factors in zip(ones, FACTORS, strict=True)]
    )
    assert min(len(one.blocks) for one in ones) > 25
    known = bank.weights > 1e-9
    found = np.log(bank.weights[known] / bank.weights.max())
    expected -= expected.max()
    # To first order: copies linearise where they are.
    np.testing.assert_allclose(found, expected[known], atol=0.1 * np.abs(expected).max() + 0.1)
    assert bank.weights.sum() == pytest.approx(1.0)


def test_a_bank_makes_the_noise_right_that_is_stated_too_small():
    drive = zr.simulate_drive(duration=300.0, seed=1, **RECEIVERS["2 cm"])
    imu = drive.recording()
    start = zr.align(imu, latitude=48.0, heading="course", accel_bias_sigma=0.05)
    ratios = {}
    for kind in (zr.NavigationFilter, NavigationBank):
        for factor in (0.3, 1.0):
            nav = kind(start, **scaled(factor, factor))
            found = zr.navigation.outages(imu, drive.fixes, seconds=10.0, between=5.0, nav=nav)
            ratios[kind, factor] = found[10.0].error_over_sigma()
    assert ratios[zr.NavigationFilter, 0.3] > 1.6
    assert ratios[NavigationBank, 0.3] < 1.3
    # The stated noise is right, and stays.
    assert ratios[NavigationBank, 1.0] == ratios[zr.NavigationFilter, 1.0]


def test_a_bank_keeps_nothing_for_a_smoother():
    samples, rows, start = driven("2 m", duration=60.0)
    drive = zr.simulate_drive(50.0, 60.0, seed=3)
    bank = NavigationBank(start)
    with pytest.raises(ValueError, match="keep must be 'track'"):
        bank.process(drive.recording(), drive.fixes, keep="all")
    with pytest.raises(ValueError, match="record must be False"):
        bank.process_arrays(samples.time, samples.gyro, samples.accel, rows, record=True)
    with pytest.raises(ValueError, match="only the track was kept"):
        bank.process(drive.recording(), drive.fixes).smooth()


def test_a_wrong_parameter_is_refused_as_of_a_filter():
    _, _, start = driven("2 m", duration=60.0)
    with pytest.raises(ValueError, match="gate must be a positive number"):
        NavigationBank(start, gate=-1.0)
    loud = zr.NoiseModel(angle_random_walk=50.0, rate_random_walk=1e-5)
    with pytest.raises(ValueError, match="gyro noise must be from 0 to 100"):
        NavigationBank(start, gyro=loud)
