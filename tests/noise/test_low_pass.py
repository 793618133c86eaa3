"""Noise behind a low-pass: found, named, and read below its corner."""

import json
import math

import numpy as np
import pytest
from scipy.signal import butter, lfilter

import zerorate as zr
from zerorate.noise import Coefficient, LowPass, NoiseModel
from zerorate.noise.low_pass import process_of
from zerorate.noise.processes import WHITE
from zerorate.noise.spectrum import Spectrum, find_low_pass
from zerorate.tasks.characterise import export_texts

RATE = 200.0
WHITE_NOISE = 1e-4


def record(seed, duration=120.0, corner=20.0, order=2, **drift):
    """Return noise of 1e-4 rad/s/root Hz and drift, both behind a filter."""
    noise = NoiseModel(angle_random_walk=WHITE_NOISE, **drift)
    z, _ = zr.simulate(noise, rate=RATE, duration=duration + 5.0, seed=seed)
    if order == "mean":
        width = round(0.4429 * RATE / corner)
        z = np.convolve(z, np.ones(width) / width, "valid")
    elif order:
        z = lfilter(*butter(order, 2.0 * corner / RATE), z)
    return z[int(4.0 * RATE) : int((4.0 + duration) * RATE)]


@pytest.mark.parametrize(
    ("corner", "order"), [(5.0, 1), (5.0, 2), (20.0, 1), (20.0, 2), (22.145, "mean"), (50.0, 2)]
)
def test_noise_and_corner_are_found(corner, order):
    pulls = []
    for seed in range(3):
        fit = zr.noise.whittle(record(seed, corner=corner, order=order), RATE, unit="rad/s")
        white, found = fit.angle_random_walk, fit.low_pass
        pulls.append((white - WHITE_NOISE) / white.sigma)
        assert white == pytest.approx(WHITE_NOISE, rel=0.1)
        assert abs(found.corner - corner) < 4.0 * found.corner.sigma + 0.03 * corner
        assert found.order == (math.inf if order == "mean" else pytest.approx(order, rel=0.25))
    assert np.sqrt(np.mean(np.square(pulls))) < 2.5


@pytest.mark.parametrize("drift", [{}, {"bias_instability": 5e-5, "rate_random_walk": 5e-6}])
def test_no_filter_is_named_where_there_is_none(drift):
    for seed in range(8):
        spectrum = Spectrum.of(record(10 + seed, order=0, **drift), RATE)
        found = find_low_pass(spectrum, RATE)
        assert found is None or not found.named


@pytest.mark.parametrize(("corner", "order"), [(5.0, 1), (20.0, 2)])
def test_curve_and_spectrum_agree_and_advise_no_markov_term(corner, order):
    data = {"gyro_x_radps": record(5, 300.0, corner, order)}
    found = zr.characterise(data, rate=RATE)
    (axis,) = found.gyro.axes
    assert axis.model.method == "oadev"
    assert axis.model.angle_random_walk == pytest.approx(WHITE_NOISE, rel=0.06)
    assert not axis.model.bias_instability.identifiable
    assert abs(axis.model.angle_random_walk - axis.second.angle_random_walk) < 0.05 * WHITE_NOISE
    notes = " ".join(map(str, found.notes))
    assert "low-passed at" in notes
    assert "markov" not in notes
    assert "# low-passed at" in found.gyro.worst.to_vins()


def test_drift_on_a_white_floor_is_no_filter():
    """A Markov bias has the spectrum of a low-pass with white noise past it."""
    markov = zr.noise.Markov(amplitude=2e-4, time=2.0)
    z, _ = zr.simulate(
        NoiseModel(angle_random_walk=WHITE_NOISE, markov=(markov,)), RATE, 600.0, seed=3
    )
    fit = zr.noise.whittle(z, RATE, unit="rad/s")
    assert fit.low_pass is None
    assert fit.angle_random_walk == pytest.approx(WHITE_NOISE, rel=0.03)


def test_the_variance_of_a_sample_is_what_passes():
    for corner, order in [(5.0, 1), (20.0, 2), (22.145, "mean")]:
        z = record(7, 300.0, corner, order)
        low_pass = LowPass(corner, math.inf if order == "mean" else order)
        model = NoiseModel(angle_random_walk=WHITE_NOISE, low_pass=low_pass)
        assert model.discrete_sigmas(RATE).white == pytest.approx(z.std(), rel=0.05)


def test_white_noise_that_nothing_filters_has_the_process_of_white_noise():
    spectrum = Spectrum.of(record(1, corner=20.0, order=1), RATE)
    process = process_of(find_low_pass(spectrum, RATE))
    k = np.array([0.0, 2000.0, 1e6])
    # Far beyond the memory of the filter only a constant is left of it.
    assert process.phase(k)[2] - process.phase(k)[1] == pytest.approx(
        WHITE.phase(k)[2] - WHITE.phase(k)[1], rel=1e-9
    )
    far = np.arange(-1.0, 2.0) + 5e5
    second = process.summed(far) @ [1.0, -2.0, 1.0]
    assert -second == pytest.approx(process.phase(far[1:2])[0], rel=1e-3)


@pytest.mark.parametrize("order", [1.0, 1.7, math.inf])
def test_json_keeps_the_filter(order):
    model = NoiseModel(
        angle_random_walk=1e-4, low_pass=LowPass(Coefficient(20.0, sigma=0.1), order), up_to=7.0
    )
    assert NoiseModel.from_json(model.to_json()) == model


def test_words():
    assert str(LowPass(Coefficient(20.02, sigma=0.1), 2.0)) == (
        "low-passed at 20.02 ± 0.10 Hz, second order"
    )
    assert str(LowPass(5.0, math.inf)) == "low-passed at 5 Hz, moving average"


@pytest.mark.parametrize(("corner", "order"), [(0.0, 1.0), (-1.0, 1.0), (5.0, 0.0)])
def test_a_filter_that_is_none_is_refused(corner, order):
    with pytest.raises(ValueError, match="must "):
        LowPass(corner, order)


@pytest.mark.parametrize("options", [{"markov": 1}, {"second_opinion": False}])
def test_no_option_leaves_the_filter_out(options):
    found = zr.characterise({"gyro_x_radps": record(6, corner=20.0)}, rate=RATE, **options)
    (axis,) = found.gyro.axes
    assert axis.model.low_pass.corner == pytest.approx(20.0, rel=0.05)
    assert axis.model.angle_random_walk == pytest.approx(WHITE_NOISE, rel=0.06)
    assert (axis.second is None) == ("second_opinion" in options)
    assert len(axis.model.markov) == options.get("markov", 0)


@pytest.mark.parametrize("export", ["json", "kalibr", "ros"])
def test_exports_carry_the_notes(export):
    steps = np.rint(record(7) / 1e-3) * 1e-3
    found = zr.characterise({"gyro_x_radps": steps}, rate=RATE)
    notes = [note for note in found.notes if "gyro_x_radps" in note]
    assert len(notes) == 2  # rounding, low-pass
    texts, refused = export_texts(found, export, doubtful=True)
    assert not refused
    text = texts[export]
    written = "\n".join(json.loads(text)["notes"]) if export == "json" else text
    for note in notes:
        assert note.removeprefix("gyro_x_radps: ") in written


def test_the_covariance_of_a_message_is_that_of_a_sample():
    model = NoiseModel(angle_random_walk=WHITE_NOISE, low_pass=LowPass(5.0, 1.0))
    text = model.to_ros(rate=RATE)
    line = next(row for row in text.splitlines() if row.startswith("angular_velocity"))
    variance = float(line.split("[")[1].split(",")[0])
    assert variance == pytest.approx(model.discrete_sigmas(RATE).white ** 2, rel=1e-5)
    assert variance < 0.1 * WHITE_NOISE**2 * RATE


def test_identify_names_the_filter_and_replay_the_steps():
    z = record(8)
    found = zr.identify({"gyro_x_radps": z}, rate=RATE, max_order=3)
    assert any("low-passed at" in note for note in found.notes)
    coarse = np.rint(np.random.default_rng(1).normal(0.0, 0.3, 12_000))
    for task in (zr.identify, zr.replay):
        notes = task({"gyro_x_dps": coarse}, rate=100.0).notes
        assert any("steps of 1 deg/s, wider than the noise" in note for note in notes), task
        plain = np.random.default_rng(1).normal(0.0, 0.3, 12_000)
        assert not any("steps" in n for n in task({"gyro_x_dps": plain}, rate=100.0).notes)
