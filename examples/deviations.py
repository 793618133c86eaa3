"""Errors divided by their stated standard deviations, by stream and platform.

    python examples/deviations.py [--streams] [RECORDING ...]

Each row has the RMS of error over sigma (valid from 0.8 to 1.2) and the share of errors within two
sigma (valid from 0.93). With --streams only the streams other than drift filters are shown.
RECORDINGS are logs at rest at 100 Hz: the bias predicts the next means of the samples.
"""

import argparse
import itertools

import numpy as np
from scipy.signal import butter, lfilter

import zerorate as zr
from deviations_streams import ROWS
from zerorate.simulation.devices import device
from zerorate.simulation.models import MODELS, simulate_record

RATE = 100.0
FILTERED_RATE = 200.0
LONG = 300.0
RECORDS = 12
STREAM_RECORDS = 8
DURATION = 900.0
FIRST = 120.0
EVERY = 30.0
SPANS = (1.0, 10.0, 60.0)
HELD = (0.0, 1.0, 10.0, 60.0)
DEVICES = ("MPU-6050", "ADIS16405", "MTi-100")
# White noise, flicker and random walk in units of deg/s, and the rate.
MIXES = (
    (0.02, 0.002, 0.0, 100.0),
    (0.002, 0.02, 0.0, 100.0),
    (0.01, 0.005, 1e-4, 25.0),
    (0.01, 0.01, 1e-3, 25.0),
    (0.005, 0.002, 3e-4, 1000.0),
)


def drift_errors(signal, truth, rate=RATE, first=FIRST, every=EVERY, held=HELD):
    """Return errors of the next mean bias over sigma, by hold time in motion, s, and span, s."""
    f = zr.DriftFilter(rate, channels=signal.shape[1], output="estimate")
    total = np.vstack([np.zeros(signal.shape[1]), np.cumsum(truth, axis=0)])
    found = {(h, span): [] for h in held for span in SPANS}
    for time in np.arange(first, len(signal) / rate - max(held) - max(SPANS), every):
        end = round(time * rate)
        f.process(signal[f.samples_seen : end])
        for h in held:
            now, later = f.copy(), end + round(h * rate)
            now.process(signal[end:later], moving=np.ones(later - end, dtype=bool))
            for span in SPANS:
                n = round(span * rate)
                error = now.bias - (total[later + n] - total[later]) / n
                found[h, span].append(error / now.bias_sigma_over(span))
    return {key: np.ravel(values) for key, values in found.items()}


def recorded_errors(signal, rate, first=60.0):
    """Return errors of the bias as a prediction of the next means; sigma includes white noise."""
    f = zr.DriftFilter(rate, channels=signal.shape[1], output="estimate")
    total = np.vstack([np.zeros(signal.shape[1]), np.cumsum(signal, axis=0)])
    found = {(0.0, span): [] for span in SPANS}
    for time in np.arange(first, len(signal) / rate - max(SPANS), max(SPANS) / 6.0):
        end = round(time * rate)
        f.process(signal[f.samples_seen : end])
        for span in SPANS:
            n = round(span * rate)
            error = f.bias - (total[end + n] - total[end]) / n
            sigma = np.hypot(f.bias_sigma_over(span), f.angle_random_walk / np.sqrt(span))
            found[0.0, span].append(error / sigma)
    return {key: np.ravel(values) for key, values in found.items()}


def models():
    """Yield name, rate, signal and truth of each simulated gyro."""
    n = round(DURATION * RATE)
    for model in MODELS:
        pairs = [simulate_record(model, RATE, n, seed) for seed in range(RECORDS)]
        yield model.name, RATE, *(np.stack(series, axis=1) for series in zip(*pairs, strict=True))


def devices():
    """Yield name, rate, signal and truth of gyros from data sheets."""
    for name in DEVICES:
        gyro = device(name)
        yield name, RATE, *zr.simulate(gyro, RATE, DURATION, seed=1, axes=RECORDS)


def mixes():
    """Yield name, rate, signal and truth of mixed noise at other rates."""
    for white, flicker, walk, rate in MIXES:
        noise = zr.NoiseModel(
            angle_random_walk=white, bias_instability=flicker, rate_random_walk=walk
        )
        name = f"N {white:g}, B {flicker:g}, K {walk:g} at {rate:g} Hz"
        yield name, rate, *zr.simulate(noise, rate, DURATION, seed=2, axes=RECORDS)


def noise_errors(count=40, duration=120.0):
    """Return errors of N over sigma, from the spectrum of white noise with flicker."""
    noise = zr.NoiseModel(angle_random_walk=0.01, bias_instability=0.002)
    z, _ = zr.simulate(noise, RATE, duration, seed=3, axes=count)
    fits = [zr.noise.whittle(column, RATE).angle_random_walk for column in z.T]
    return np.array([(fit - 0.01) / fit.sigma for fit in fits])


def filtered_record(seed, duration, corner, order):
    """Return filtered white noise, flicker and random walk, at 200 Hz."""
    noise = zr.NoiseModel(
        angle_random_walk=0.01, bias_instability=0.003, rate_random_walk=5e-5, quantity="unknown"
    )
    z, _ = zr.simulate(noise, FILTERED_RATE, duration + 20.0, seed=seed)
    if order == "mean":
        width = round(0.4429 * FILTERED_RATE / corner)
        z = np.convolve(z, np.ones(width) / width, "valid")
    else:
        z = lfilter(*butter(order, 2.0 * corner / FILTERED_RATE), z)
    first = round(15.0 * FILTERED_RATE)
    return z[first : first + round(duration * FILTERED_RATE)]


def filtered_rows(durations=(60.0, 600.0), corners=(5.0, 20.0), orders=(1, 2, "mean")):
    """Yield bias and scatter of N for filtered records, and its errors over sigma."""
    for duration, corner, order in itertools.product(durations, corners, orders):
        count = 48 if duration < LONG else RECORDS
        records = (filtered_record(s, duration, corner, order) for s in range(count))
        fits = [zr.noise.whittle(z, FILTERED_RATE) for z in records]
        white = np.array([fit.angle_random_walk for fit in fits]) / 0.01
        errors = np.array([(f.angle_random_walk - 0.01) / f.angle_random_walk.sigma for f in fits])
        named = sum(fit.low_pass is not None for fit in fits)
        spread = f"{100.0 * (white.mean() - 1.0):+.1f} ± {100.0 * white.std():.1f} %"
        yield (
            f"{duration:g} s, {corner:g} Hz, {order}",
            (spread, measures(errors), f"{named}/{count}"),
        )


def stepped_rows(ratios=(0.1, 0.15, 0.2, 0.25, 0.3, 0.4), count=4):
    """Yield N of rounded samples over the truth, by standard deviation over step."""
    for ratio in ratios:
        values, errors, bounds = [], [], []
        for level, drift, seed in itertools.product((0.0, 0.25, 0.45), (0.0, 0.3), range(count)):
            rng = np.random.default_rng(seed)
            z = np.rint(level + ratio * rng.standard_normal(30_000) + np.linspace(0, drift, 30_000))
            (axis,) = zr.characterise({"gyro_x_radps": z}, rate=RATE).gyro.axes
            if axis.model is None:
                continue
            white, truth = axis.model.angle_random_walk, ratio / np.sqrt(RATE)
            bounds.append(white.upper_bound >= truth)
            if white.identifiable:
                values.append(white / truth)
                errors.append((white - truth) / white.sigma)
        spread = f"{np.mean(values):.3f} ± {np.std(values):.3f}" if values else "-"
        held = measures(np.array(errors)) if errors else "-"
        cells = (f"{len(values)}/{6 * count}", spread, held, f"{np.mean(bounds):.2f}")
        yield f"{ratio:g}", cells


def measures(errors):
    """Return the RMS, and the share within two."""
    return f"{np.sqrt(np.mean(errors**2)):.2f} {np.mean(np.abs(errors) <= 2.0):.2f}"


def print_table(head, rows):
    """Print a table in Markdown."""
    print("| " + " | ".join(head) + " |")
    print("| --- |" + " --- |" * (len(head) - 1))
    for name, cells in rows:
        print("| " + " | ".join((name, *cells)) + " |", flush=True)
    print()


def drift_rows(platforms):
    """Yield a row for each simulated gyro."""
    for name, rate, signal, truth in platforms:
        found = drift_errors(signal, truth, rate)
        rest = [measures(found[0.0, span]) for span in SPANS]
        yield name, (*rest, *(measures(found[h, 10.0]) for h in HELD[1:]))


def recording_rows(paths):
    """Yield a row for each axis of a recording at rest."""
    for path in paths:
        log = zr.read_log(path, rate=RATE)
        for i, name in enumerate(log.names):
            found = recorded_errors(log.data[:, i : i + 1], log.rate)
            yield f"{path.rsplit('/', 1)[-1]}, {name}", [measures(e) for e in found.values()]


def stream_rows():
    """Yield a row for each stream and platform, with two numbers for each quantity."""
    for name, make in ROWS.items():
        found = make(STREAM_RECORDS).items()
        cells = (f"{quantity} {measures(np.concatenate(e, axis=None))}" for quantity, e in found)
        yield name, ["; ".join(cells)]


def main():
    """Print all tables."""
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("recordings", nargs="*")
    parser.add_argument("--streams", action="store_true")
    arguments = parser.parse_args()
    print_table(["stream, platform", "error over sigma"], stream_rows())
    if arguments.streams:
        return
    spans = [f"next {span:g} s" for span in SPANS]
    head = ["gyro", *spans, *(f"held {h:g} s, next 10 s" for h in HELD[1:])]
    for platforms in (models(), devices(), mixes()):
        print_table(head, drift_rows(platforms))
    if arguments.recordings:
        print_table(["recording at rest", *spans], recording_rows(arguments.recordings))
    print("N of the spectrum:", measures(noise_errors()), end="\n\n")
    print_table(["record, corner, order", "N", "error over sigma", "named"], filtered_rows())
    head = ["σ/step", "identifiable", "N over truth", "error over sigma", "bound holds"]
    print_table(head, stepped_rows())


if __name__ == "__main__":
    main()
