"""Record to the last bit what the package gives on the recordings, and compare two records.

    python outputs.py record FILE [--recordings DIR] [--only PART[,PART]]
    python outputs.py compare OLD NEW [--no-text]

A change that is to move nothing is made between two records: `record` before it, `record` after
it, `compare`. `record` writes a JSON file with a SHA-256 of every result and, so that a difference
can be judged, its shape, first and last number and the sum of its finite numbers, all exact.
Numbers and texts stand apart, since wording may change on purpose: `--no-text` leaves texts out.
A result that cannot be had is recorded as a fault, and the rest goes on.

Only the public interface is used, everything but `rate` by keyword and the method always named,
so neither defaults nor the order of arguments matter, nor where a module lies.

A NaN is one NaN whatever its bits; zeros keep their signs. Whole numbers are widened to 64 bits.
What takes time (speeds) is masked. Records are of one machine: elementary functions of the C
library and sums of NumPy may differ by a bit on another.
"""

import argparse
import hashlib
import json
import math
import os
import re
import subprocess
import sys
import tempfile
import time
from collections.abc import Callable, Iterable, Iterator, Mapping, Sequence
from contextlib import contextmanager
from functools import cache
from pathlib import Path
from typing import Any, Final

import numpy as np
import pyarrow as pa
import pyarrow.parquet as pq

import zerorate as zr

# --- What is recorded of a result ---------------------------------------------------------------


def plain(value: object) -> np.ndarray:
    """Return numbers as float64, int64 or bool with one kind of NaN; None is NaN."""
    array = np.asarray(value)
    if array.dtype.kind == "c":
        array = np.stack([array.real, array.imag], axis=-1)
    if array.dtype.kind == "O":
        array = np.asarray(value, dtype=np.float64)
    if array.dtype.kind in "iu":
        return np.array(array, dtype=np.int64, order="C")
    if array.dtype.kind == "b":
        return np.array(array, order="C")
    array = np.array(array, dtype=np.float64, order="C")
    array[np.isnan(array)] = np.nan
    return array


def is_text(value: object) -> bool:
    """Return whether a value is a text or a sequence of texts."""
    if isinstance(value, str):
        return True
    listed = isinstance(value, list | tuple) and len(value) > 0
    return listed and all(isinstance(each, str) for each in value)


def entry_of_text(value: str | Sequence[str]) -> dict[str, Any]:
    """Return the entry of a text, or of texts as lines."""
    text = value if isinstance(value, str) else "\n".join(value)
    return {"sha256": hashlib.sha256(text.encode()).hexdigest(), "text": text.split("\n")}


def entry_of(value: object) -> dict[str, Any]:
    """Return the entry of one result."""
    if is_text(value):
        return entry_of_text(value)
    array = plain(value)
    entry = {
        "sha256": hashlib.sha256(array.tobytes()).hexdigest(),
        "kind": array.dtype.name,
        "shape": list(array.shape),
    }
    flat = array.reshape(-1)
    finite = flat[np.isfinite(flat)]
    if flat.size:
        entry |= {"first": repr(flat[0].item()), "last": repr(flat[-1].item())}
    entry |= {"sum": repr(math.fsum(finite)), "not_finite": int(flat.size - finite.size)}
    return entry


class Book:
    """Entries by name: numbers, texts, and what went wrong."""

    def __init__(self) -> None:
        self.numbers: dict[str, dict[str, Any]] = {}
        self.text: dict[str, dict[str, Any]] = {}
        self.faults: dict[str, str] = {}

    def put(self, name: str, value: object) -> None:
        """Record a result."""
        self._add(self.numbers, name, entry_of(value))

    def say(self, name: str, text: str | Sequence[str]) -> None:
        """Record a text that may change on purpose."""
        self._add(self.text, name, entry_of_text(text))

    def read(self, name: str, source: object, attributes: str) -> None:
        """Record attributes of an object, named in one string."""
        for attribute in attributes.split():
            with self.trying(f"{name}.{attribute}"):
                self.put(f"{name}.{attribute}", getattr(source, attribute))

    @contextmanager
    def trying(self, name: str) -> Iterator[None]:
        """Record what goes wrong inside, and go on."""
        try:
            yield
        except Exception as fault:
            self.faults[name] = f"{type(fault).__name__}: {fault}"

    def as_dict(self) -> dict[str, Any]:
        """Return all groups."""
        return {"numbers": self.numbers, "text": self.text, "faults": self.faults}

    @staticmethod
    def _add(group: dict[str, dict[str, Any]], name: str, entry: dict[str, Any]) -> None:
        if name in group:
            raise ValueError(f"two results are called {name}")
        group[name] = entry


# --- The recordings -----------------------------------------------------------------------------

FILES: Final = {
    "adis": ("adis16405_static_100hz_run1.parquet", 100.0),
    "still": ("mpu6050_static_100hz.parquet", 100.0),
    "encoder": ("mpu6050_encoder_yaw_slow_100hz.parquet", 100.0),
    "broad": ("broad_05_undisturbed_slow_rotation_with_breaks_B.parquet", 2000.0 / 7.0),
    "array": ("mimu4444_array8_62hz_exp1.parquet", 62.5),
    "drive": ("drive_imu_100hz.parquet", 100.0),
}

# Name of the record: file, its columns.
GYROS: Final = {
    "adis": ("adis", "gyro_x_dps gyro_y_dps gyro_z_dps"),
    "still": ("still", "gyro_x_dps gyro_y_dps gyro_z_dps"),
    "fixed": ("encoder", "fixed_gyro_x_dps fixed_gyro_y_dps fixed_gyro_z_dps"),
    "shaft": ("encoder", "shaft_gyro_x_dps shaft_gyro_y_dps shaft_gyro_z_dps"),
    "broad": ("broad", "gyro_x_radps gyro_y_radps gyro_z_radps"),
    "array": ("array", "imu1_gyro_x_dps imu4_gyro_y_dps imu8_gyro_z_dps"),
    "drive": ("drive", "gyro_x_radps gyro_y_radps gyro_z_radps"),
}

EIGHT: Final = " ".join(f"imu{k}_gyro_x_dps" for k in range(1, 9))


class Recordings:
    """The recordings of a folder, each read once."""

    def __init__(self, folder: Path) -> None:
        self.folder = folder
        self.table = cache(self._table)

    def path(self, name: str) -> Path:
        """Return where a file lies."""
        return self.folder / FILES[name][0]

    def rate(self, name: str) -> float:
        """Return the samples per second of a file."""
        return FILES[name][1]

    def columns(self, name: str, columns: str) -> np.ndarray:
        """Return columns of a file side by side, shape (n, k)."""
        table = self.table(name)
        taken = [table[column].to_numpy().astype(np.float64) for column in columns.split()]
        return np.column_stack(taken)

    def gyro(self, name: str) -> tuple[np.ndarray, float]:
        """Return three gyro axes, shape (n, 3), and their rate."""
        file, columns = GYROS[name]
        return self.columns(file, columns), self.rate(file)

    def axis(self, name: str, which: int, start: int, end: int) -> np.ndarray:
        """Return a piece of one gyro axis."""
        z, _ = self.gyro(name)
        return np.ascontiguousarray(z[start:end, which])

    def cut(self, name: str, columns: str, start: int, end: int, path: Path) -> None:
        """Write a piece of a file, without its metadata."""
        table = self.table(name).select(columns.split()).slice(start, end - start)
        pq.write_table(table.replace_schema_metadata(None), path)

    def _table(self, name: str) -> pa.Table:
        return pq.read_table(self.path(name))


def with_gaps(z: np.ndarray) -> np.ndarray:
    """Return a copy with short and long gaps, axis by axis and in all axes."""
    holed = z.copy()
    holed[700:703] = np.nan
    holed[2000:2250] = np.nan
    holed[0::97, 0] = np.nan
    holed[5000:5600, -1] = np.inf
    holed[40:60, -1] = np.nan
    return holed


# --- Filters ------------------------------------------------------------------------------------

PUBLISHED: Final = ("kf", "akf", "fading")
METHODS: Final = (*PUBLISHED, "auto")
ORDERS: Final = ((1, 1), (2, 1), (3, 3), (1, 0))
READINGS: Final = (
    "estimate bias bias_sigma at_rest status ready angle_random_walk rate_random_walk innovation "
    "innovation_variance measurement_noise process_noise gain coefficients covariance "
    "samples_seen guard_count"
)
TRACED: Final = (
    "estimate innovation innovation_variance gain measurement_noise process_noise coefficients "
    "covariance bias bias_sigma at_rest missing guarded"
)
VARIANTS: Final[dict[str, dict[str, Any]]] = {
    "fading 0.9": {"fading": 0.9},
    "fading 1": {"fading": 1.0},
    "forgetting": {"forgetting_factor": 0.999, "adapt_for": None},
    "adapt 5 s": {"adapt_for": 5.0},
    "process noise": {"process_noise": 1e-4},
    "memory": {"process_noise_memory": 500.0},
    "hadamard": {"noise": "hadamard"},
    "startup": {"startup": 3.0},
    "scale": {"scale": 0.2},
}


def drift_filter(rate: float, method: str, **options: Any) -> zr.DriftFilter:
    """Return a filter that answers its estimate and, if published, learns in motion too."""
    motion = "hold" if method == "auto" else "ignore"
    return zr.DriftFilter(rate, **{"motion": motion, "output": "estimate", **options},
                          method=method)  # fmt: skip


def filtered(
    book: Book, name: str, z: np.ndarray, rate: float, method: str, threads: int = 1, **options: Any
) -> None:
    """Record what a filter answers to a record and what it knows at the end."""
    with book.trying(name):
        channels = None if z.ndim == 1 else z.shape[1]
        drift = drift_filter(rate, method, channels=channels, **options)
        book.put(f"{name} answers", drift.process(z, threads=threads))
        book.read(name, drift, READINGS)


def all_recordings(book: Book, files: Recordings) -> None:
    """Record every method on every recording, whole."""
    for record in GYROS:
        z, rate = files.gyro(record)
        for method in METHODS:
            name = f"{record} {method}"
            filtered(book, name, z, rate, method)
            filtered(book, f"{name} held", z, rate, method, motion="hold", output="compensated")
            for axis in range(3):
                one = np.ascontiguousarray(z[:100_000, axis])
                filtered(book, f"{name} axis {axis}", one, rate, method)


def options_of_filters(book: Book, files: Recordings) -> None:
    """Record orders, settings, gaps and threads on the static MPU-6050."""
    z, rate = files.gyro("still")
    for method in PUBLISHED:
        for order in ORDERS:
            filtered(book, f"still {method} {order}", z, rate, method, order=order)
        for motion in ("hold", "ignore"):
            name = f"still {method} {motion} hadamard"
            filtered(book, name, z, rate, method, motion=motion, noise="hadamard")
    for variant, options in VARIANTS.items():
        filtered(book, f"still fading {variant}", z, rate, "fading", **options)
    filtered(book, "still auto startup", z, rate, "auto", startup=3.0)
    filtered(book, "still auto ignore", z, rate, "auto", motion="ignore")
    holed = with_gaps(z)
    for method in METHODS:
        filtered(book, f"still {method} gaps", holed, rate, method)
        filtered(book, f"still {method} gaps compensated", holed, rate, method,
                 output="compensated")  # fmt: skip


def side_by_side(book: Book, files: Recordings) -> None:
    """Record eight channels at once, on one thread and two."""
    z, rate = files.columns("array", EIGHT), files.rate("array")
    for method in METHODS:
        for threads in (1, 2):
            filtered(book, f"eight {method} {threads} threads", z, rate, method, threads)
        filtered(book, f"eight {method} gaps", with_gaps(z), rate, method, 2)
        filtered(book, f"eight {method} held", z, rate, method, 2, motion="hold",
                 output="compensated")  # fmt: skip


def traces(book: Book, files: Recordings) -> None:
    """Record all that a filter knew after each sample, over 20 s."""
    for record in ("still", "broad", "array"):
        z, rate = files.gyro(record)
        start = z.shape[0] // 2 if record == "array" else int(30.0 * rate)
        piece = z[start : start + int(20.0 * rate)].copy()
        piece[900:950, 1] = np.nan
        for method in METHODS:
            name = f"trace {record} {method}"
            with book.trying(name):
                book.read(name, drift_filter(rate, method, channels=3).trace(piece), TRACED)
            with book.trying(f"{name} axis"):
                alone = drift_filter(rate, method).trace(np.ascontiguousarray(piece[:, 0]))
                book.read(f"{name} axis", alone, TRACED)


def step_by_step(book: Book, files: Recordings) -> None:
    """Record updates one by one, a copy, a checkpoint, a new start, and a reset."""
    z, rate = files.gyro("still")
    for method in METHODS:
        name = f"steps {method}"
        with book.trying(name):
            one = drift_filter(rate, method)
            book.put(name, [one.update(float(x)) for x in z[:3000, 0]])
            three = drift_filter(rate, method, channels=3)
            book.put(f"{name} three", [three.update(row) for row in z[:3000]])
            other = zr.DriftFilter.from_bytes(three.copy().to_bytes())
            book.put(f"{name} restored", other.process(z[3000:6000]))
            if method == "auto":
                other.power_on()
                book.put(f"{name} powered on", other.process(z[:3000]))
            other.reset()
            book.put(f"{name} reset", other.process(z[:3000]))


# --- Estimators ---------------------------------------------------------------------------------


def one_and_three(z: np.ndarray) -> Iterator[tuple[str, int | None, np.ndarray]]:
    """Yield one axis alone, and all side by side."""
    yield "one", None, np.ascontiguousarray(z[:, 0])
    yield "three", 3, z


def least_squares(book: Book, files: Recordings) -> None:
    """Record recursive least squares."""
    z = with_gaps(files.gyro("still")[0])
    settings = [{"order": order} for order in ORDERS]
    settings += [{"order": (2, 1), "forgetting_factor": 0.999, "startup": 50},
                 {"order": (2, 1), "scale": 0.1, "startup": 200}]  # fmt: skip
    for i, options in enumerate(settings):
        for width, channels, data in one_and_three(z):
            name = f"least squares {i} {width}"
            with book.trying(name):
                model = zr.identification.RecursiveLeastSquares(channels=channels, **options)
                book.put(name, model.process(data, threads=1))
                book.read(name, model, "coefficients covariance samples_seen ready")


def noises(book: Book, files: Recordings) -> None:
    """Record the fading Allan variance."""
    z = with_gaps(files.gyro("fixed")[0][:60_000])
    for noise in ("allan", "hadamard"):
        for fading in (0.9, 0.97, 1.0):
            for width, channels, data in one_and_three(z):
                name = f"noise {noise} {fading} {width}"
                with book.trying(name):
                    model = zr.noise.AllanNoise(
                        fading=fading, noise=noise, floor=0.0, channels=channels
                    )
                    book.put(name, model.process(data, threads=1))
                    book.read(name, model, "variance")


def streaming(book: Book, files: Recordings) -> None:
    """Record the streaming Allan deviations."""
    tables = "taus deviation hadamard_deviation terms hadamard_term_count samples_seen"
    for record in ("still", "drive"):
        z, rate = files.gyro(record)
        for gaps, data in (("", z), (" gaps", with_gaps(z))):
            for width, channels, part in one_and_three(data):
                name = f"streaming {record} {width}{gaps}"
                with book.trying(name):
                    live = zr.StreamingAllan(rate, octaves=12, channels=channels)
                    live.process(part, threads=1)
                    book.read(name, live, tables)


def rests(book: Book, files: Recordings) -> None:
    """Record where the detector sees rest."""
    for record in GYROS:
        z, rate = files.gyro(record)
        for width, channels, data in one_and_three(z):
            name = f"rest {record} {width}"
            with book.trying(name):
                detector = zr.RestDetector(rate, channels=channels)
                book.put(name, detector.process(data, threads=1))
                book.read(name, detector, "at_rest")


# --- Noise --------------------------------------------------------------------------------------

FAST: Final = ("adev", "oadev", "mdev", "tdev", "hdev", "ohdev", "totdev", "pdev")
SLOW: Final = ("mtotdev", "ttotdev", "htotdev", "theo1")
FITTED: Final = ("adev", "oadev", "mdev", "tdev", "hdev", "ohdev", "totdev", "mtotdev", "ttotdev",
                 "htotdev")  # fmt: skip
CURVE: Final = "taus deviation rate_deviation lower upper edf exponent terms factors duration"
TERMS: Final = "angle_random_walk bias_instability rate_random_walk rate_ramp quantization"


def coefficient(book: Book, name: str, found: zr.noise.Coefficient) -> None:
    """Record a coefficient with its error and bound."""
    numbers = [float(found), found.sigma, found.upper_bound, float(found.identifiable)]
    book.put(name, numbers)


def noise_model(book: Book, name: str, model: zr.NoiseModel) -> None:
    """Record all terms of a noise model, and how good the fit was if it is one."""
    for term in TERMS.split():
        coefficient(book, f"{name} {term}", getattr(model, term))
    for i, markov in enumerate(model.markov):
        coefficient(book, f"{name} markov {i} amplitude", markov.amplitude)
        coefficient(book, f"{name} markov {i} time", markov.time)
    for i, line in enumerate(model.sinusoid):
        coefficient(book, f"{name} sinusoid {i} amplitude", line.amplitude)
        coefficient(book, f"{name} sinusoid {i} frequency", line.frequency)
    if isinstance(model, zr.noise.FittedModel):
        book.read(name, model, "chi_squared degrees_of_freedom misfit method")
    book.say(f"{name} table", str(model))


def fits(book: Book, name: str, result: zr.noise.AllanResult, **options: Any) -> None:
    """Record the models fitted to each axis of a curve."""
    with book.trying(name):
        found = result.fit(**options)
        for axis, model in enumerate(found if isinstance(found, tuple) else (found,)):
            noise_model(book, f"{name} {axis}", model)


def deviations(book: Book, files: Recordings) -> None:
    """Record every kind of deviation, and the fit of those that have a model."""
    z, rate = files.gyro("still")
    for kind in (*FAST, *SLOW):
        data = z if kind in FAST else np.ascontiguousarray(z[:6000, 1])
        unit = {"unit": "deg/s", "threads": 1}
        with book.trying(f"allan {kind}"):
            result = zr.allan(data, rate=rate, kind=kind, taus="octave", **unit)
            book.read(f"allan {kind}", result, CURVE)
            book.say(f"allan {kind} notes", result.notes)
            if kind in FITTED:
                fits(book, f"allan {kind} fit", result, method="curve")
            decade = zr.allan(data, rate=rate, kind=kind, taus="decade", confidence=0.95, **unit)
            book.read(f"allan {kind} decade", decade, CURVE)


def odd_deviations(book: Book, files: Recordings) -> None:
    """Record averaging times, gaps, noise types and fits that are not the usual ones."""
    z, rate = files.gyro("still")
    holed = with_gaps(z)
    cases: dict[str, tuple[np.ndarray, dict[str, Any]]] = {
        "all": (z[:3000, 0], {"taus": "all"}),
        "seconds": (z[:, 2], {"taus": [0.1, 0.25, 1.0, 10.0, 33.3]}),
        "gaps": (holed, {"taus": "octave"}),
        "bridged": (holed, {"taus": "octave", "bridge": 10}),
        "white": (z, {"taus": "octave", "exponent": 0, "kind": "totdev"}),
        "two threads": (z, {"taus": "octave", "threads": 2}),
    }
    for case, (data, options) in cases.items():
        with book.trying(f"allan {case}"):
            result = zr.allan(data, rate=rate, **{"kind": "oadev", "unit": "deg/s", **options})
            book.read(f"allan {case}", result, CURVE)
            book.say(f"allan {case} notes", result.notes)
            fits(book, f"allan {case} fit", result, method="curve")


def models_of_curves(book: Book, files: Recordings) -> None:
    """Record the kinds of fit, and the second opinion by the spectrum."""
    for record in ("adis", "fixed"):
        z, rate = files.gyro(record)
        result = zr.allan(z, rate=rate, kind="oadev", taus="octave", unit="deg/s", threads=1)
        name = f"fit {record}"
        book.read(name, result, CURVE)
        fits(book, f"{name} curve", result, method="curve")
        fits(book, f"{name} polynomial", result, method="polynomial")
        fits(book, f"{name} markov", result, markov=1)
        fits(book, f"{name} times", result, markov=(10.0,), sinusoid=(0.5,))
        two = ("angle_random_walk", "rate_random_walk")
        fits(book, f"{name} two terms", result, terms=two)
        for axis in range(3):
            with book.trying(f"whittle {record} {axis}"):
                found = zr.noise.whittle(
                    np.ascontiguousarray(z[:100_000, axis]), rate, unit="deg/s"
                )
                noise_model(book, f"whittle {record} {axis}", found)


def dynamic(book: Book, files: Recordings) -> None:
    """Record deviations over a sliding window."""
    z, rate = files.gyro("adis")
    for kind, window in (("oadev", 600.0), ("hdev", 60.0), ("totdev", 100.0)):
        with book.trying(f"dynamic {kind}"):
            piece = with_gaps(z[:200_000, :2])[:, 0].copy()
            found = zr.noise.dynamic_allan(piece, rate, window=window, kind=kind, threads=1)
            book.read(f"dynamic {kind}", found, "times taus deviation window")


def simulated(book: Book, files: Recordings) -> None:
    """Record simulated signals, and the curves of models."""
    taus = np.geomspace(0.01, 1000.0, 40)
    rich = zr.NoiseModel(
        angle_random_walk=1e-4, bias_instability=4e-5, rate_random_walk=1e-6, rate_ramp=1e-9,
        quantization=1e-6, markov=(zr.noise.Markov(1e-5, 30.0),),
        sinusoid=(zr.noise.Sinusoid(1e-4, 2.0),),
    )  # fmt: skip
    devices = {name: zr.simulation.device(name) for name in zr.simulation.DEVICES}
    sensors = {"rich": rich, **devices}
    for name, sensor in sensors.items():
        with book.trying(f"simulated {name}"):
            z, drift = zr.simulate(sensor, rate=100.0, duration=60.0, seed=5, axes=3)
            book.put(f"simulated {name}", z)
            book.put(f"simulated {name} drift", drift)
            model = sensor if isinstance(sensor, zr.NoiseModel) else sensor.noise
            noise_model(book, f"simulated {name} model", model)
            book.put(f"simulated {name} allan", model.allan_deviation(taus))
            book.put(f"simulated {name} hadamard", model.hadamard_deviation(taus))
            book.read(f"simulated {name} sigmas", model.discrete_sigmas(200.0), "white walk_step")
            book.put(f"simulated {name} in units", float(model.in_units("deg/h")))


def exports(book: Book, files: Recordings) -> None:
    """Record models as the configuration of estimators."""
    z, rate = files.gyro("still")
    found = zr.allan(z, rate=rate, kind="oadev", taus="octave", unit="deg/s", threads=1).fit()
    accels = files.columns("still", "accel_x_g accel_y_g accel_z_g")
    accel = zr.allan(accels, rate=rate, kind="oadev", taus="octave", unit="g", threads=1).fit()
    gyro, other = zr.noise.worst_axis(found), zr.noise.worst_axis(accel)
    noise_model(book, "export worst gyro", gyro)
    noise_model(book, "export worst accelerometer", other)
    for form in ("kalibr", "orbslam3", "vins", "px4"):
        export = getattr(gyro, f"to_{form}")
        configuration(book, f"export {form}", lambda made=export: made(rate=rate))
        both = {"rate": rate, "accelerometer": other, "inflate": 3.0}
        configuration(book, f"export {form} both", lambda made=export, both=both: made(**both))
    configuration(book, "export vins continuous", lambda: gyro.to_vins())
    with book.trying("export json"):
        json_values(book, "export json", json.loads(gyro.to_json()))
        noise_model(book, "export json again", zr.noise.FittedModel.from_json(gyro.to_json()))


def configuration(book: Book, name: str, made: Callable[[], str]) -> None:
    """Record the settings of a configuration file as numbers, and its text."""
    with book.trying(name):
        text = made()
        bare = "\n".join(line.split("#")[0] for line in text.split("\n"))
        for key, number in re.findall(r"^\s*([\w.\s]+?)[:=\s]\s*([-+.\deE]+)\s*$", bare, re.M):
            book.put(f"{name} {' '.join(key.split())}", float(number))
        book.say(name, text)


# --- Identification -----------------------------------------------------------------------------

MODEL: Final = (
    "phi theta constant sigma2 covariance n log_likelihood condition has_constant converged "
    "record_mean record_deviation mean_sigma order aic ar_roots ma_roots invertible stationary "
    "mean parameter_count standard_errors method"
)
TEST: Final = "statistic p_value lower upper accepted n p_bound"
CRITERIA: Final = ("fpe", "aic", "aicc", "bic", "hq")
FORMS: Final = ("harvey", "controllable", "observable", "fu-han", "fu-han-literal")


def arma_model(book: Book, name: str, model: zr.identification.ArmaModel, z: np.ndarray) -> None:
    """Record an ARMA model and what follows from it."""
    book.read(name, model, MODEL)
    book.say(f"{name} notes", model.notes)
    steps: dict[str, Callable[[], object]] = {
        "residuals": lambda: model.residuals(z),
        "psi": lambda: model.psi_weights(50),
        "spectrum": lambda: model.spectrum(np.linspace(0.01, 50.0, 64), 100.0),
        "modes": lambda: [(m.time_constant, m.frequency, m.damping) for m in model.modes(100.0)],
        "again": lambda: zr.identification.ArmaModel.from_json(model.to_json()).covariance,
    }
    if model.stationary:
        steps["autocovariance"] = lambda: model.autocovariance(50)
        steps["autocorrelation"] = lambda: model.autocorrelation(50)
    for what, made in steps.items():
        with book.trying(f"{name} {what}"):
            book.put(f"{name} {what}", made())


def autoregressions(book: Book, files: Recordings) -> None:
    """Record AR and ARMA models of pieces."""
    pieces = {"adis": files.axis("adis", 2, 0, 20_000), "still": files.axis("still", 1, 0, 20_000)}
    for record, z in pieces.items():
        for p, method in ((1, "least-squares"), (4, "burg"), (3, "yule-walker"),
                          (12, "least-squares")):  # fmt: skip
            name = f"ar {record} {p} {method}"
            with book.trying(name):
                arma_model(book, name, zr.identification.fit_ar(z, p, method=method), z)
        for p, q in ((1, 1), (2, 1), (2, 2), (0, 1)):
            name = f"arma {record} {p} {q}"
            with book.trying(name):
                arma_model(book, name, zr.identification.fit_arma(z, p, q, method="css"), z)
        for holes, short in (("", z[:4000]), (" gaps", with_gaps(z[:4000, None])[:, 0])):
            name = f"arma exact {record}{holes}"
            with book.trying(name):
                found = zr.identification.fit_arma(short, 2, 1, method="exact")
                arma_model(book, name, found, short)


def orders(book: Book, files: Recordings) -> None:
    """Record the choice of orders by each criterion, and the grid behind it."""
    z = files.axis("adis", 1, 0, 10_000)
    for criterion in CRITERIA:
        for kind in ("ar", "arma"):
            name = f"order {kind} {criterion}"
            with book.trying(name):
                found = zr.identification.select_order(
                    z, kind=kind, criterion=criterion, margin=10.0
                )
                book.read(name, found, "n orders sigma2 n_coefficients scores minimum clear order")
                book.read(name, found, " ".join(CRITERIA))
                if kind == "arma":
                    book.put(f"{name} coefficients", np.concatenate(found.coefficients))
    with book.trying("order grid"):
        grid = zr.identification.arma_grid(z, 3, 3)
        book.read("order grid", grid, "sigma2 n converged evaluations")
        book.put("order grid coefficients", np.concatenate(grid.coefficients))


def tests(book: Book, files: Recordings) -> None:
    """Record the tests of a record and of residuals."""
    study = zr.identification
    made: dict[str, Callable[[np.ndarray], Any]] = {
        "adf": lambda z: study.adf(z),
        "adf 5": lambda z: study.adf(z, lags=5),
        "kpss": lambda z: study.kpss(z, trend="constant"),
        "kpss linear": lambda z: study.kpss(z, trend="linear"),
        "jarque bera": study.jarque_bera,
        "anderson darling": study.anderson_darling,
        "ljung box": lambda z: study.ljung_box(z, lags=20, fitted=0),
        "ljung box fitted": lambda z: study.ljung_box(z, lags=30, fitted=3),
        "arrangements": lambda z: study.reverse_arrangements(z, segments=100, of="mean"),
        "arrangements of variances":
            lambda z: study.reverse_arrangements(z, segments=60, of="variance"),
    }  # fmt: skip
    for record, axis in (("still", 0), ("adis", 2), ("fixed", 1)):
        z = files.axis(record, axis, 0, 30_000)
        for test, run in made.items():
            for gaps, data in (("", z), (" gaps", with_gaps(z[:, None])[:, 0])):
                name = f"test {record} {test}{gaps}"
                with book.trying(name):
                    found = run(data)
                    book.read(name, found, TEST)
                    if "arrangements" in test:
                        book.read(name, found, "reversals ties segments left_out z_score")
                    book.say(f"{name} note", found.note)
        correlations(book, record, z)


def correlations(book: Book, record: str, z: np.ndarray) -> None:
    """Record correlograms, whiteness, and spans in motion."""
    with book.trying(f"correlogram {record}"):
        found = zr.identification.autocorrelation(z, 60)
        book.read(f"correlogram {record}", found, "lags acf pacf bound n")
    with book.trying(f"whiteness {record}"):
        white = zr.identification.whiteness(z, lags=20, fitted=2)
        book.read(f"whiteness {record}", white, "outside predictable white")
        book.read(f"whiteness {record} correlogram", white.correlogram, "acf pacf bound")
        book.read(f"whiteness {record} ljung box", white.ljung_box, TEST)


def preparation(book: Book, files: Recordings) -> None:
    """Record what preparing makes of records, and where they moved."""
    study = zr.identification
    whole = files.axis("fixed", 1, 0, 30_000)
    z, holed = with_gaps(whole[:, None])[:, 0], whole.copy()
    holed[10_000:10_500] = np.nan
    made: dict[str, Callable[[], object]] = {
        "decimate": lambda: study.decimate(holed, 10),
        "mean off": lambda: study.detrend(z, kind="mean"),
        "line off": lambda: study.detrend(z, kind="linear"),
        "average": lambda: study.moving_average(z, 5),
        "segments": lambda: study.segments(z, 50),
        "hampel": lambda: study.hampel(z, width=11, threshold=3.0).data,
        "hampel outliers": lambda: study.hampel(z, width=11, threshold=3.0).outliers,
        "far": lambda: study.far_from_average(z, width=11, threshold=3.0).data,
        "far outliers": lambda: study.far_from_average(z, width=11, threshold=3.0).outliers,
    }
    for what, run in made.items():
        with book.trying(f"prepared {what}"):
            book.put(f"prepared {what}", run())
    with book.trying("prepared all"):
        steps = {"smooth": 3, "outliers": "hampel", "window": 11, "threshold": 4.0,
                 "trend": "linear", "decimate": 5}  # fmt: skip
        prepared = study.prepare(holed, 100.0, **steps)
        book.read("prepared all", prepared, "data rate")
        book.put("prepared all counts", [change.count for change in prepared.changes])
        book.say("prepared all changes", [change.what for change in prepared.changes])
    for record in ("broad", "drive", "still"):
        data, rate = files.gyro(record)
        with book.trying(f"moving {record}"):
            spans = study.moving_spans(np.ascontiguousarray(data[:, 2]), rate)
            book.put(f"moving {record}", [(span.start, span.end) for span in spans])


def forms_and_filters(book: Book, files: Recordings) -> None:
    """Record state-space forms of models, and filters that begin with one."""
    z, drift = zr.simulate(zr.NoiseModel(angle_random_walk=1e-4, rate_random_walk=2e-5),
                           rate=100.0, duration=300.0, seed=3)  # fmt: skip
    model = zr.identification.fit_arma(z, 1, 1, method="css")
    arma_model(book, "started model", model, z)
    for method in PUBLISHED:
        name = f"started {method}"
        with book.trying(name):
            started = model.to_filter(100.0, method=method)
            book.put(f"{name} answers", started.process(z))
            book.read(name, started, READINGS)
    with book.trying("started two"):
        two = zr.identification.to_filter([model, model], 100.0, method="fading", adapt_for=60.0)
        book.put("started two answers", two.process(np.column_stack([z, drift])))
    signal = files.axis("adis", 0, 0, 20_000)
    for p, q in ((1, 1), (2, 1)):
        arma = zr.identification.fit_arma(signal, p, q, method="css")
        for form in FORMS:
            with book.trying(f"form {form} {p} {q}"):
                state_space(book, f"form {form} {p} {q}", arma.to_state_space(form))


def state_space(book: Book, name: str, system: zr.identification.StateSpace) -> None:
    """Record a state-space form."""
    book.read(name, system, "F G H sigma2 R offset constant start size")
    book.put(f"{name} impulse", system.impulse_response(30))
    book.put(f"{name} autocovariance", system.autocovariance(30))
    book.put(f"{name} transfer", system.transfer(np.linspace(0.1, 50.0, 20), 100.0))


def identified(book: Book, files: Recordings) -> None:
    """Record the whole way from a record to a model."""
    cases: dict[str, tuple[np.ndarray, dict[str, Any]]] = {
        "still": (files.axis("still", 1, 0, 20_000), {}),
        "adis": (files.axis("adis", 2, 0, 15_000), {"criterion": "bic", "segments": 50}),
        "slow": (files.axis("adis", 2, 0, 200_000), {"decimate": 100, "order": (1, 1)}),
        "exact": (files.axis("still", 2, 0, 3000), {"method": "exact", "max_p": 1, "max_q": 1}),
        "moving": (files.axis("drive", 2, 0, 30_000), {"outliers": "hampel", "trend": "linear"}),
    }
    for case, (z, options) in cases.items():
        with book.trying(f"identified {case}"):
            found = zr.identification.identify(z, 100.0, name="axis", unit="deg/s", **options)
            json_values(book, f"identified {case}", found.to_dict())
            book.put(f"identified {case} residuals", found.residuals)
            book.read(f"identified {case}", found, "rate slow_ratio")
            book.say(f"identified {case} verdict", found.verdict)


# --- Measures -----------------------------------------------------------------------------------


def measures_at_rest(book: Book, files: Recordings) -> None:
    """Record measures of filters at rest."""
    z, rate = files.gyro("still")
    z, measure = z.copy(), zr.metrics
    z[20_000:20_100, 1], z[::20_000, 2] = np.nan, np.nan
    drift = drift_filter(rate, "fading", channels=3).process(z)
    auto = drift_filter(rate, "auto", channels=3).process(z)
    model = zr.NoiseModel(angle_random_walk=1e-3, rate_random_walk=2e-4)
    signal, truth = zr.simulate(model, rate=100.0, duration=120.0, seed=2)
    trace = drift_filter(100.0, "auto").trace(signal)
    optimum = measure.best_ema(signal, 100.0, truth=truth, start=10.0)
    ema = measure.best_ema(z, rate, 10.0)
    made: dict[str, Callable[[], object]] = {
        "running mean": lambda: measure.running_mean(z),
        "best ema estimate": lambda: ema.estimate,
        "best ema gain": lambda: ema.gain,
        "best ema error": lambda: ema.error,
        "best ema of truth": lambda: [optimum.gain, optimum.error],
        "reduction": lambda: measure.reduction(z, drift),
        "mean shift": lambda: measure.mean_shift(z, auto),
        "coasting 10": lambda: measure.coasting_error(z, auto, rate, 10.0),
        "coasting 60": lambda: measure.coasting_error(z, drift, rate, 60.0),
        "allan ratio": lambda: measure.allan_ratio(z, drift, rate, 0.1).ratio,
        "allan ratio taus": lambda: measure.allan_ratio(z, drift, rate, 0.1).taus,
        "low-pass": lambda: measure.equal_delay_lowpass(z, rate, 0.05),
        "nis": lambda: measure.nis(trace.innovation, trace.innovation_variance),
        "nis at rest":
            lambda: measure.nis(trace.innovation, trace.innovation_variance, where=trace.at_rest),
        "coverage": lambda: measure.coverage(trace.bias - truth, trace.bias_sigma),
        "rmse": lambda: measure.rmse(truth, trace.bias),
        "regret": lambda: measure.regret(trace.bias, truth, optimum.estimate),
        "settling": lambda: measure.settling_time(trace.bias, truth, 1e-3, 100.0),
    }  # fmt: skip
    for what, run in made.items():
        with book.trying(f"measure {what}"):
            book.put(f"measure {what}", run())


def measures_in_motion(book: Book, files: Recordings) -> None:
    """Record measures of filters in motion."""
    z, rate = files.gyro("broad")
    quaternions = files.columns("broad", "ref_quat_w ref_quat_x ref_quat_y ref_quat_z")
    for method in METHODS:
        with book.trying(f"measure motion {method}"):
            rates = drift_filter(
                rate, method, channels=3, motion="hold", output="compensated"
            ).process(z)
            smoothed = drift_filter(rate, method, channels=3).process(z)
            motion = rates if method == "auto" else smoothed
            growth = zr.metrics.orientation_error_growth(
                rates, quaternions, rate, horizons=(1.0, 10.0), every=2.0
            )
            book.put(f"measure orientation {method}", growth)
            book.put(f"measure delay {method}", zr.metrics.delay(z, motion, rate, max_delay=0.2))
            error = zr.metrics.motion_error(z, motion, rate, max_delay=0.2, raw=z)
            book.read(f"measure motion {method}", error, "rmse delay rmse_undelayed rmse_lowpass")


# --- Logs and the command line ------------------------------------------------------------------


def logs(book: Book, files: Recordings) -> None:
    """Record what is read of each recording, and what is read again after writing."""
    with tempfile.TemporaryDirectory() as folder:
        for record in FILES:
            with book.trying(f"log {record}"):
                timed = record in ("encoder", "array", "drive")
                log = zr.read_log(files.path(record), rate=None if timed else files.rate(record))
                book.read(f"log {record}", log, "time rate data names unit missing_count duration")
                book.say(f"log {record} meta", json.dumps(log.meta, default=str, indent=1)
                         .replace(str(files.folder), "DATA"))  # fmt: skip
        short = zr.read_log(files.path("drive"))
        short = zr.read_log({"time": short.time[:500], "gyro_radps": short.data[:500, :3]})
        for suffix in ("csv", "tsv", "npz", "parquet"):
            with book.trying(f"log as {suffix}"):
                path = Path(folder) / f"short.{suffix}"
                zr.write_log(short, path)
                book.read(f"log as {suffix}", zr.read_log(path), "time rate data names unit")


# Columns and keys that hold versions, hashes of settings and times taken.
PASSING: Final = (
    "zerorate", "seconds", "fingerprint", "schema", "version", "speed", "output_bytes",
)  # fmt: skip


def json_values(book: Book, name: str, document: object) -> None:
    """Record a JSON document: what has the same place in each element of a list together."""
    places: dict[str, list[Any]] = {}
    for place, value in leaves(document, ""):
        places.setdefault(place, []).append(value)
    for place, values in places.items():
        if place.split(".")[-1] in PASSING:
            continue
        if any(isinstance(value, str) for value in values):
            book.say(f"{name}:{place}", [str(value) for value in values])
        else:
            book.put(f"{name}:{place}", np.array(values, dtype=np.float64))


def leaves(value: object, place: str) -> Iterator[tuple[str, Any]]:
    """Yield the leaves of a JSON document with their places, lists without an index."""
    if isinstance(value, Mapping):
        for key, inner in value.items():
            yield from leaves(inner, f"{place}.{key}" if place else str(key))
    elif isinstance(value, list | tuple):
        for inner in value:
            yield from leaves(inner, f"{place}[]")
    else:
        yield place, value


def table_values(book: Book, name: str, columns: Mapping[str, Sequence[Any]]) -> None:
    """Record the columns of a table, their names and order too."""
    book.put(f"{name} names", list(columns))
    for column, values in columns.items():
        if column not in PASSING:
            book.put(f"{name}:{column}", values)


def csv_columns(text: str) -> dict[str, list[Any]]:
    """Return the columns of a comma-separated table with a header, comments left out."""
    rows = [line.split(",") for line in text.splitlines() if line and not line.startswith("#")]
    return {name: cells(column) for name, *column in zip(*rows, strict=True)}


def cells(column: Iterable[str]) -> list[Any]:
    """Return cells as numbers if all of them are, an empty one as NaN."""
    texts = list(column)
    try:
        return [float(text) if text else math.nan for text in texts]
    except ValueError:
        return texts


def parquet_columns(path: Path) -> dict[str, Any]:
    """Return the columns of a Parquet file, a missing text as an empty one, lists as one text."""
    table, columns = pq.read_table(path), {}
    for name in table.column_names:
        column = table[name]
        if pa.types.is_list(column.type):
            columns[name] = ["; ".join(each or ()) for each in column.to_pylist()]
        elif pa.types.is_string(column.type) or pa.types.is_large_string(column.type):
            columns[name] = [each or "" for each in column.to_pylist()]
        else:
            columns[name] = column.to_numpy()
    return columns


def file_values(book: Book, name: str, path: Path) -> None:
    """Record the values of a file that a command wrote."""
    with book.trying(name):
        if path.suffix == ".parquet":
            table_values(book, name, parquet_columns(path))
        elif path.suffix == ".csv":
            table_values(book, name, csv_columns(path.read_text()))
        elif path.suffix == ".json":
            json_values(book, name, json.loads(path.read_text()))
        elif path.suffix == ".npz":
            with np.load(path) as arrays:
                table_values(book, name, {key: arrays[key].tolist() for key in sorted(arrays)})
        elif path.suffix in (".yaml", ".params"):
            configuration(book, name, path.read_text)
        else:
            raise ValueError(f"nothing is known of {path.name}")


def masked(text: str) -> str:
    """Return what was printed without speeds and seconds taken."""
    text = re.sub(r" +\S+ M$", " (speed)", text, flags=re.M)
    return re.sub(r"done in \S+ s", "done in (seconds)", text)


class Shell:
    """Runs commands in a folder of their own, and records what they print and write."""

    SKIPPED: Final = (".png", ".html")

    def __init__(self, book: Book, folder: Path) -> None:
        self.book, self.folder = book, folder

    def run(self, name: str, *arguments: object, fed: str | None = None) -> str:
        """Run `python -m zerorate` with arguments, record what is printed, and return it."""
        command = [sys.executable, "-m", "zerorate", *(str(each) for each in arguments)]
        surroundings = {**os.environ, "COLUMNS": "120", "NO_COLOR": "1", "MPLBACKEND": "agg"}
        done = subprocess.run(command, cwd=self.folder, env=surroundings, input=fed,
                              capture_output=True, text=True, check=False, timeout=300)  # fmt: skip
        if done.returncode:
            raise RuntimeError(f"exit code {done.returncode}: {done.stderr[-500:]}")
        if fed is None:
            self.book.say(f"{name} printed", masked(done.stdout))
        return done.stdout

    def files(self, name: str, *arguments: object, fed: str | None = None) -> None:
        """Run a command that writes into a folder, and record all files there."""
        with self.book.trying(name):
            out = self.folder / re.sub(r"\W+", "-", name)
            out.mkdir()
            self.run(name, *arguments, "-o", out.name, fed=fed)
            for path in sorted(out.rglob("*")):
                if path.is_file() and path.suffix not in self.SKIPPED:
                    file_values(self.book, f"{name} {path.name}", path)


def pieces(files: Recordings, folder: Path) -> None:
    """Write the pieces of recordings that commands are given."""
    gyros, accels = "gyro_x_dps gyro_y_dps gyro_z_dps", "accel_x_g accel_y_g accel_z_g"
    files.cut("still", f"{gyros} {accels}", 0, 20_000, folder / "still.parquet")
    files.cut("drive", "time_s gyro_x_radps gyro_y_radps gyro_z_radps", 0, 30_000,
              folder / "drive.parquet")  # fmt: skip
    files.cut("encoder", "time_s encoder_deg shaft_gyro_z_dps", 0, 20_000,
              folder / "shaft.parquet")  # fmt: skip
    broad = "gyro_x_radps gyro_y_radps gyro_z_radps ref_quat_w ref_quat_x ref_quat_y ref_quat_z"
    files.cut("broad", broad, 0, 40_000, folder / "broad.parquet")


def replays(shell: Shell) -> None:
    """Record `replay`, as a stream, in memory and with a figure."""
    stated, bare = ("--rate", 100), ("--no-figure",)
    for method, kind in (("auto", "compensated"), ("auto", "estimate"), ("kf", "estimate"),
                         ("akf", "estimate"), ("fading", "compensated")):  # fmt: skip
        chosen = ("--method", method, "--output-kind", kind)
        for form in ("parquet", "csv") if kind == "compensated" or method == "kf" else ("parquet",):
            shell.files(f"replay {method} {kind} {form}", "replay", "still.parquet", *stated,
                        *chosen, *bare, "--format", form)  # fmt: skip
    auto = ("--method", "auto", "--output-kind", "compensated")
    shell.files("replay still compared", "replay", "still.parquet", *stated, *auto, "--no-figure")
    shell.files("replay drive", "replay", "drive.parquet", *auto, "--no-figure")
    shell.files("replay drive figure", "replay", "drive.parquet", *auto)
    shell.files("replay drive npz", "replay", "drive.parquet", *auto, *bare, "--format", "npz")
    shell.files("replay hold", "replay", "drive.parquet", "--method", "fading", "--motion", "hold",
                "--output-kind", "estimate", "--order", "1,1", "--fading", 0.9, "--noise",
                "hadamard", *bare)  # fmt: skip


def studies(shell: Shell) -> None:
    """Record `allan`, `identify`, `simulate`, `compare` and `batch`."""
    stated = ("--rate", 100)
    shell.files("command allan", "allan", "still.parquet", *stated, "--no-figure", "--format",
                "csv", "--export", "kalibr,vins,orbslam3,px4,json")  # fmt: skip
    shell.files("command allan json", "allan", "still.parquet", *stated, "--no-figure", "--format",
                "json", "--kind", "ohdev", "--taus", "decade", "--markov", 1, "--columns",
                "gyro_x_dps,accel_z_g")  # fmt: skip
    shell.files("command identify", "identify", "still.parquet", *stated, "--no-figure")
    shell.files("command identify order", "identify", "still.parquet", *stated, "--no-figure",
                "--columns", "gyro_y_dps", "--order", "2,1", "--outliers", "hampel")  # fmt: skip
    shell.files("command batch", "batch", "drive.parquet", "--method", "auto", "--workers", 1)
    for form in ("parquet", "csv"):
        with shell.book.trying(f"command simulate {form}"):
            shell.run(f"command simulate {form}", "simulate", "MPU-6050", "--duration", 60,
                      "--rate", 100, "--axes", 3, "--seed", 7, "-o", f"gyro.{form}")  # fmt: skip
            for path in (f"gyro.{form}", f"gyro-truth.{form}"):
                file_values(shell.book, f"command simulate {path}", shell.folder / path)


def comparisons(shell: Shell) -> None:
    """Record `compare` at rest, on a shaft and by hand."""
    quaternion = "ref_quat_w,ref_quat_x,ref_quat_y,ref_quat_z"
    cases = {
        "rest": ("still.parquet", "--rate", 100, "--columns", "gyro_x_dps,gyro_y_dps"),
        "shaft": ("shaft.parquet", "--columns", "shaft_gyro_z_dps", "--reference", "encoder_deg"),
        "hand": ("broad.parquet", "--rate", 2000.0 / 7.0, "--quaternion", quaternion),
    }
    for case, arguments in cases.items():
        name = f"command compare {case}"
        with shell.book.trying(name):
            # Filters of attitude are timed, so no two runs print the same.
            methods = (
                "--methods",
                "raw,mean,ema,kf,akf,fading,fading+hold,auto",
                "--attitude",
                "none",
            )
            shell.run(name, "compare", *arguments, *methods, "--per-axis", "--json", f"{case}.json")
            file_values(shell.book, name, shell.folder / f"{case}.json")


def streams(shell: Shell, files: Recordings) -> None:
    """Record `stream`, a line in, a line out, with a garbled line and lost samples."""
    z, _ = files.gyro("still")
    lines = [",".join(map(repr, row)) for row in z[:4000].tolist()]
    lines[500], lines[501] = "0.5,,nan", "@#"
    numbered = [f"{i},{line}" for i, line in enumerate(lines) if not 1000 <= i < 1020]
    del numbered[501]
    plain_text, numbers = "\n".join(("wx,wy,wz", *lines, "")), "\n".join(("n,wx,wy,wz", *numbered))
    for method in METHODS:
        for kind in ("estimate", "compensated"):
            name = f"stream {method} {kind}"
            with shell.book.trying(name):
                answers = shell.run(name, "stream", "--rate", 100, "--method", method,
                                    "--output-kind", kind, "--with", "bias,bias_sigma,at_rest",
                                    fed=plain_text)  # fmt: skip
                table_values(shell.book, name, csv_columns(answers))
    with shell.book.trying("stream numbered"):
        answers = shell.run("stream numbered", "stream", "--rate", 100, "--method", "auto",
                            "--output-kind", "compensated", "--sequence", "n",
                            fed=numbers + "\n")  # fmt: skip
        table_values(shell.book, "stream numbered", csv_columns(answers))


def commands(book: Book, files: Recordings) -> None:
    """Record what commands write and print."""
    with tempfile.TemporaryDirectory() as folder:
        shell = Shell(book, Path(folder))
        pieces(files, shell.folder)
        replays(shell)
        studies(shell)
        comparisons(shell)
        streams(shell, files)


# --- The two commands ---------------------------------------------------------------------------

PARTS: Final = (
    all_recordings, options_of_filters, side_by_side, traces, step_by_step, least_squares, noises,
    streaming, rests, deviations, odd_deviations, models_of_curves, dynamic, simulated, exports,
    autoregressions, orders, tests, preparation, forms_and_filters, identified, measures_at_rest,
    measures_in_motion, logs, commands,
)  # fmt: skip


def record(path: Path, recordings: Path, only: Sequence[str]) -> int:
    """Write a record of everything, and say how long each part took."""
    book, files = Book(), Recordings(recordings)
    for part in PARTS:
        if only and part.__name__ not in only:
            continue
        began = time.perf_counter()
        with book.trying(part.__name__):
            part(book, files)
        print(f"{part.__name__:<20} {time.perf_counter() - began:6.1f} s", file=sys.stderr)
    path.write_text(json.dumps(book.as_dict(), indent=1, ensure_ascii=False) + "\n")
    print(f"{len(book.numbers)} results and {len(book.text)} texts in {path}")
    for name, fault in book.faults.items():
        print(f"fault: {name}: {fault}")
    return 1 if book.faults else 0


def differences(old: dict[str, Any], new: dict[str, Any], text: bool) -> list[tuple[str, ...]]:
    """Return a row for everything that differs: name, what, before, after."""
    rows: list[tuple[str, ...]] = []
    for group in ("faults", "numbers", "text") if text else ("faults", "numbers"):
        names = {**old[group], **new[group]}
        for name in names:
            before, after = old[group].get(name), new[group].get(name)
            if before != after:
                rows.extend(explained(name, before, after))
    return rows


def explained(name: str, before: Any, after: Any) -> list[tuple[str, ...]]:
    """Return the rows that say how two entries differ."""
    if before is None or after is None:
        return [(name, "gone" if after is None else "new", brief(before), brief(after))]
    if isinstance(before, str) or isinstance(after, str):
        return [(name, "fault", brief(before), brief(after))]
    if "text" in before and "text" in after:
        return [(name, *first_difference(before["text"], after["text"]))]
    keys = ("kind", "shape", "first", "last", "sum", "not_finite", "text")
    rows = [
        (name, key, str(before.get(key)), str(after.get(key)))
        for key in keys
        if before.get(key) != after.get(key)
    ]
    return rows or [(name, "within", brief(before), brief(after))]


def first_difference(before: Sequence[str], after: Sequence[str]) -> tuple[str, str, str]:
    """Return the number of the first line that differs, and both lines."""
    length = max(len(before), len(after))
    padded = [[*lines, *["(no line)"] * (length - len(lines))] for lines in (before, after)]
    pairs = list(zip(*padded, strict=True))
    i = next(i for i, (one, other) in enumerate(pairs) if one != other)
    return f"line {i + 1}", *pairs[i]


def brief(entry: Any) -> str:
    """Return an entry in a few words."""
    if entry is None:
        return "-"
    if isinstance(entry, str):
        return entry
    if "text" in entry:
        return entry["text"][0]
    return f"{entry['kind']} {tuple(entry['shape'])} {entry['sha256'][:8]}"


def table(rows: Sequence[tuple[str, ...]], widest: int = 60) -> str:
    """Return rows as an aligned table."""
    cut = [[cell if len(cell) <= widest else cell[: widest - 1] + "…" for cell in row]
           for row in (("result", "what", "before", "after"), *rows)]  # fmt: skip
    widths = [max(len(row[i]) for row in cut) for i in range(4)]
    lines = ("  ".join(f"{cell:<{w}}" for cell, w in zip(row, widths, strict=True)) for row in cut)
    return "\n".join(line.rstrip() for line in lines)


def compare(old: Path, new: Path, text: bool) -> int:
    """Print what differs between two records."""
    before, after = (json.loads(path.read_text()) for path in (old, new))
    rows = differences(before, after, text)
    if rows:
        print(table(rows))
        print(f"\n{len({row[0] for row in rows})} results differ")
        return 1
    what = f"{len(after['numbers'])} results" + (f" and {len(after['text'])} texts" if text else "")
    print(f"nothing differs: {what}")
    return 0


def main() -> int:
    """Run the command that is asked for."""
    parser = argparse.ArgumentParser(description=(__doc__ or "").split("\n")[0])
    asked = parser.add_subparsers(dest="command", required=True)
    recorder = asked.add_parser("record", help="write what the package gives")
    recorder.add_argument("file", type=Path)
    beside = Path(__file__).resolve().parents
    default = beside[min(3, len(beside) - 1)] / "shared" / "data"
    recorder.add_argument("--recordings", type=Path, default=default)
    recorder.add_argument("--only", default="", help="names of parts with commas between")
    comparer = asked.add_parser("compare", help="print what differs, exit 1 if anything does")
    comparer.add_argument("old", type=Path)
    comparer.add_argument("new", type=Path)
    comparer.add_argument("--no-text", action="store_true", help="leave texts out")
    given = parser.parse_args()
    if given.command == "compare":
        return compare(given.old, given.new, not given.no_text)
    return record(given.file, given.recordings, given.only.split(",") if given.only else [])


if __name__ == "__main__":
    sys.exit(main())
