"""Gain of fusing the accelerometers of an array, and its limits.

``python examples/array_accel_study.py FOLDER``, with the folder of the recordings, prints tables in
Markdown. The array has eight IMUs on a board, 13 mm from its centre. It is rotated by hand at up to
2,900 deg/s between rests in twenty poses. The tables are:

1. difference between the sensors: without lever arms, with lever arms from the rate, and fused;
   change by a missing sensor
2. noise at rest
3. angular acceleration from the rate, from the accelerometers, and from both
4. difference between the sensors after a fit of constant errors of each sensor
5. faults of one sensor, and fast motion without the rate
6. errors relative to the truth in simulated motion
"""

import sys
from collections.abc import Callable
from pathlib import Path

import numpy as np

import zerorate as zr
from recordings import BESIDE
from tables import table
from zerorate import _native
from zerorate.array.logs import array_log
from zerorate.types import Booleans, Floats

MIMU = "mimu4444_array8_62hz_exp1.parquet"
G = 9.80665
TURNED = np.array([[0.0, -1.0, 0.0], [-1.0, 0.0, 0.0], [0.0, 0.0, -1.0]])
ROTATIONS = np.stack([np.eye(3), TURNED] * 4)
SIDE, HALF = 9.45e-3, 1e-3
CORNERS = ((-SIDE, SIDE), (-SIDE, -SIDE), (SIDE, SIDE), (SIDE, -SIDE))
POSITIONS = np.array([(x, y, z) for x, y in CORNERS for z in (HALF, -HALF)])
END_OF_RANGE = 1997.9
"""End of the range, deg/s: 32767 / 16.4 is 1997.99, and this limit is just below it."""
AWAY = 40
"""Number of samples that are left out at both ends of a rest."""


def rms(values: Floats) -> float:
    """Return the root mean square of the values that are not NaN."""
    return float(np.sqrt(np.nanmean(np.square(values))))


def spread(force: Floats) -> float:
    """Return the RMS difference between the sensors (n, N, 3) and their mean."""
    return rms(force - force.mean(axis=1, keepdims=True))


def by_rate(omega: Floats, rate: float) -> Floats:
    """Return the lever-arm accelerations from the rate and its derivative."""
    change = np.gradient(omega, 1.0 / rate, axis=0)[:, np.newaxis]
    turn = omega[:, np.newaxis]
    return np.cross(change, POSITIONS) + np.cross(turn, np.cross(turn, POSITIONS))


class Board:
    """The array: rate of the body, rad/s, raw and calibrated forces, m/s^2, and rests."""

    def __init__(self, folder: Path) -> None:
        recording = zr.read_recording(folder / MIMU, only=["gyro", "accel"])
        log = array_log(recording)
        self.rate, self.time = log.rate, log.time
        trace = zr.GyroArray(
            log.rate, 8, rotations=ROTATIONS, limit=END_OF_RANGE, rest_limit=10.0, bias_limit=20.0
        ).trace(log.data)
        self.omega = np.radians(trace["rate"])
        rest = trace["at_rest"].all(axis=1)
        # The derivative is unknown next to a missing rate.
        known = np.isfinite(np.gradient(self.omega, axis=0) + self.omega).all(axis=1)
        self.moving: Booleans = ~rest & known
        self.moving[:5] = self.moving[-5:] = False
        self.rest = np.convolve(~rest, np.ones(2 * AWAY + 1), "same") < 0.5
        raw = [recording["accel" if k == 0 else f"accel_{k}"].data for k in range(8)]
        self.raw = self._turned(np.stack(raw, axis=1))
        self.calibrated = self._turned(self._calibrated(recording))

    @staticmethod
    def _turned(accel: Floats) -> Floats:
        return G * np.einsum("kij,nkj->nki", ROTATIONS, accel)

    @staticmethod
    def _calibrated(recording: zr.Recording) -> Floats:
        found = []
        for k in range(8):
            number = "" if k == 0 else f"_{k}"
            logs = {kind: recording[kind + number] for kind in ("gyro", "accel")}
            one = zr.Recording(logs)
            accel = zr.calibrate(one).apply(one)["accel"]
            found.append(zr.units.convert(accel.data, accel.unit, "g"))
        return np.stack(found, axis=1)

    def fused(self, force: Floats, levers: bool) -> zr.array.FusedAccelerometers:
        """Return the fused accelerometers, with or without lever arms."""
        places = POSITIONS if levers else None
        return zr.array.fuse_accelerometers(force, self.omega, self.rate, positions=places)

    def felt(self, fused: zr.array.FusedAccelerometers) -> Floats:
        """Return the lever-arm accelerations found by the fusion."""
        assert fused.angular_acceleration is not None
        turn = self.omega[:, np.newaxis]
        outward = np.cross(turn, np.cross(turn, POSITIONS))
        return np.cross(fused.angular_acceleration[:, np.newaxis], POSITIONS) + outward


def without_one(board: Board, force: Floats, levers: bool) -> float:
    """Return the RMS change in motion if one sensor is missing, over all eight sensors."""
    whole, changes = board.fused(force, levers).accel, []
    for k in range(8):
        rest = force.copy()
        rest[:, k] = np.nan
        changes.append((board.fused(rest, levers).accel - whole)[board.moving])
    return rms(np.array(changes))


def without_one_by_rate(board: Board, force: Floats) -> float:
    """Return the same change for the mean force after the rate's lever-arm accelerations."""
    force = force - by_rate(board.omega, board.rate)
    whole = force.mean(axis=1)
    others = [np.delete(force, k, axis=1).mean(axis=1) - whole for k in range(8)]
    return rms(np.array(others)[:, board.moving])


def between(board: Board) -> str:
    """Return the first table."""
    rows = []
    for name, force in (("raw", board.raw), ("calibrated", board.calibrated)):
        felt = board.felt(board.fused(force, levers=True))
        kinds = {
            "no lever arms": (force, without_one(board, force, levers=False)),
            "by the rate": (
                force - by_rate(board.omega, board.rate),
                without_one_by_rate(board, force),
            ),
            "fuse_accelerometers": (force - felt, without_one(board, force, levers=True)),
        }
        for kind, (left, change) in kinds.items():
            values = (spread(left[board.rest]), spread(left[board.moving]), change)
            rows.append((f"{name}, {kind}", *(f"{x:.3f}" for x in values)))
    head = ("sensor", "left at rest", "left in motion", "change without one, in motion")
    return table("Between the sensors, m/s^2 RMS", head, rows, markdown=True)


def deviation(board: Board, values: Floats, seconds: float) -> float:
    """Return the Allan deviation at rest, RMS over axes and sensors, mm/s^2."""
    columns = np.where(board.rest[:, np.newaxis], values.reshape(len(values), -1), np.nan)
    found = _native.allan_deviations(columns, [max(round(seconds * board.rate), 1)])[0]
    return 1e3 * rms(found)


def noise(board: Board) -> str:
    """Return the second table."""
    force = board.raw
    of = {
        "one sensor": force,
        "mean": force.mean(axis=1),
        **{
            f"weights {word}": zr.array.fuse_accelerometers(
                force, board.omega, board.rate, positions=POSITIONS, weights=word
            ).accel
            for word in ("auto", "white")
        },
    }
    rows = []
    for name, values in of.items():
        cells = []
        for seconds in (0.1, 1.0, 8.0):
            own, one = deviation(board, values, seconds), deviation(board, force, seconds)
            mean = deviation(board, of["mean"], seconds)
            cells.append(f"{own:.2f} ({mean / own:.2f}, {one / own:.2f})")
        rows.append((name, *cells))
    title = "Allan deviation at rest, mm/s^2 (mean over it, one sensor over it)"
    return table(title, ("sensor", "0.1 s", "1 s", "8 s"), rows, markdown=True)


def turning(board: Board) -> str:
    """Return the third table."""
    force = board.calibrated
    by_derivative = np.gradient(board.omega, 1.0 / board.rate, axis=0)
    alone = least_squares(force - by_rate_alone(board.omega))
    both = board.fused(force, levers=True).angular_acceleration
    rows = []
    for name, alpha in (("rate", by_derivative), ("accelerometers", alone), ("both", both)):
        left = force - by_rate_alone(board.omega) - np.cross(alpha[:, np.newaxis], POSITIONS)
        cells = (
            f"{alpha[board.rest].std():.2f}",
            f"{rms(alpha[board.moving]):.0f}",
            f"{rms((alpha - by_derivative)[board.moving]):.0f}",
            f"{spread(left[board.moving]):.2f}",
        )
        rows.append((f"by {name}", *cells))
    head = ("sensor", "at rest", "in motion", "off the rate's", "left in motion, m/s^2")
    return table("Angular acceleration, rad/s^2 RMS", head, rows, markdown=True)


def by_rate_alone(omega: Floats) -> Floats:
    """Return the centripetal accelerations, from the rate without its derivative."""
    turn = omega[:, np.newaxis]
    return np.cross(turn, np.cross(turn, POSITIONS))


def least_squares(force: Floats) -> Floats:
    """Return the angular acceleration from the accelerometers alone."""
    moment = np.cross(POSITIONS, force - force.mean(axis=1, keepdims=True)).sum(axis=1)
    inertia = np.sum(POSITIONS**2) * np.eye(3) - POSITIONS.T @ POSITIONS
    return moment @ np.linalg.inv(inertia)


def limits(board: Board) -> str:
    """Return the fourth table: RMS in motion after fits of more and more errors."""
    fused = board.fused(board.calibrated, levers=True)
    left = board.calibrated - board.felt(fused) - fused.accel[:, np.newaxis]
    w, accel = board.omega, fused.accel
    products = [w[:, i] * w[:, j] for i in range(3) for j in range(i, 3)]
    steps = {
        "offset": np.ones((len(w), 1)),
        "and scale, axes": accel,
        "and time (by the jerk)": np.gradient(accel, 1.0 / board.rate, axis=0),
        "and place": np.stack([*products, *fused.angular_acceleration.T], axis=1),
    }
    terms, rows = [], [("nothing", f"{rms(left[board.moving]):.3f}")]
    for name, columns in steps.items():
        terms.append(columns[board.moving])
        known, after = np.concatenate(terms, axis=1), []
        for k in range(8):
            values = left[board.moving, k]
            after.append(values - known @ np.linalg.lstsq(known, values, rcond=None)[0])
        rows.append((name, f"{rms(np.array(after)):.3f}"))
    title = "What is left in motion after fitting each sensor's errors, m/s^2 RMS"
    return table(title, ("model", "left"), rows, markdown=True)


def _stuck(x: Floats) -> None:
    x[5000:15000] = x[5000]


def _full_scale(x: Floats) -> None:
    x[5000:8750] = 16.0 * G


def _spikes(x: Floats) -> None:
    rng = np.random.default_rng(1)
    hit = rng.random(len(x)) < 0.01
    x[hit] += 50.0 * rng.choice([-1.0, 1.0], (int(hit.sum()), 3))


FAULTS: dict[str, Callable[[Floats], object]] = {
    "stuck": _stuck,
    "full scale": _full_scale,
    "1 % spikes of 50 m/s^2": _spikes,
    "wrong sign": lambda x: np.multiply(x, [-1.0, 1.0, 1.0], out=x),
    "x and y exchanged": lambda x: np.copyto(x, x[:, [1, 0, 2]]),
    "scale 1.3": lambda x: np.multiply(x, 1.3, out=x),
    "offset 3 m/s^2": lambda x: np.add(x, 3.0, out=x),
    "offset 1 m/s^2": lambda x: np.add(x, 1.0, out=x),
}


def faults(board: Board) -> str:
    """Return the fifth table: change of the fused acceleration by a fault of the third sensor."""
    rows = []
    for name, put in FAULTS.items():
        cells: list[str] = []
        for clean in (board.raw, board.calibrated):
            z = clean.copy()
            put(z[5000:, 2])
            fused = board.fused(z, levers=True)
            changes = (
                fused.accel - board.fused(clean, levers=True).accel,
                z.mean(axis=1) - clean.mean(axis=1),
            )
            for change in changes:
                cells.append(f"{rms(change[board.moving]):.3f} / {rms(change[board.rest]):.3f}")
            cells.append(str(int(np.delete(fused.excluded, 2, axis=1).sum())))
        rows.append((name, *cells))
    head = ("sensor", "raw, fused", "mean", "others out", "calibrated, fused", "mean", "others out")
    return table("One of eight is wrong, m/s^2 in motion / at rest", head, rows, markdown=True)


def without_rate(board: Board) -> str:
    """Return the errors without the rate above 700 deg/s, with seven sensors."""
    fast = board.moving & (np.linalg.norm(board.omega, axis=1) > np.radians(700.0))
    lost, force = board.omega.copy(), board.calibrated.copy()
    whole = board.fused(force, levers=True).accel
    lost[fast], force[:, 2] = np.nan, np.nan
    rows = []
    for name, omega, places in (
        ("rate and lever arms", board.omega, POSITIONS),
        ("lever arms alone", lost, POSITIONS),
        ("neither", lost, None),
    ):
        found = zr.array.fuse_accelerometers(force, omega, board.rate, positions=places)
        rows.append((name, f"{rms((found.accel - whole)[fast]):.3f}"))
    title = "Seven of eight above 700 deg/s, m/s^2 RMS from all eight"
    return table(title, ("model", "change"), rows, markdown=True)


def simulated(rate: float, rng: np.random.Generator) -> tuple[Floats, Floats, Floats]:
    """Return the rate (n, 3), the forces at the sensors (n, 8, 3), and the force at the origin.

    The rate is a sum of sines from 0.3 to 5 Hz with 400 deg/s RMS per axis. It starts with a rest.
    """
    time = np.arange(round(40.0 * rate)) / rate
    f, phase = rng.uniform(0.3, 5.0, (12, 3)), rng.uniform(0.0, 7.0, (12, 3))
    angle = 2.0 * np.pi * f * time[:, np.newaxis, np.newaxis] + phase
    size = np.radians(400.0) / np.sqrt(6.0)
    on = (1.0 / (1.0 + np.exp(-(time - 10.0) * 8.0)))[:, np.newaxis]
    grows = 8.0 * on * (1.0 - on)
    sine, cosine = np.sin(angle).sum(axis=1), (2.0 * np.pi * f * np.cos(angle)).sum(axis=1)
    omega, alpha = size * on * sine, size * (on * cosine + grows * sine)
    origin = 20.0 / np.sqrt(6.0) * on * np.sin(angle[:, ::-1] + 1.0).sum(axis=1)
    origin += [0.0, 0.0, G]
    turn = omega[:, np.newaxis]
    force = origin[:, np.newaxis] + np.cross(alpha[:, np.newaxis], POSITIONS)
    return omega, force + np.cross(turn, np.cross(turn, POSITIONS)), origin


ERRORS = {"noise alone": (0.0, 0.0, 0.0), "scale 1 %, 1 deg": (0.01, np.radians(1.0), 0.0)}
ERRORS["that, and offsets of 0.3 m/s^2"] = (0.01, np.radians(1.0), 0.3)


def truth(seeds: int = 4) -> str:
    """Return the last table."""
    rows = []
    for rate in (62.5, 500.0):
        for name, sizes in ERRORS.items():
            found = np.mean([errors(rate, sizes, seed) for seed in range(seeds)], axis=0)
            rows.append((f"{name}, {rate:g} Hz", *(f"{x:.3f}" for x in found)))
    head = ("sensor", "one", "all", "7 without levers", "7 with levers", "one wrong: mean", "fused")
    return table("Simulated: errors in motion, m/s^2 RMS", head, rows, markdown=True)


def errors(rate: float, sizes: tuple[float, float, float], seed: int) -> list[float]:
    """Return the errors of one sensor and of the fusion: complete, one missing, one wrong."""
    rng = np.random.default_rng(seed)
    omega, force, origin = simulated(rate, rng)
    scale, twist, offset = sizes
    matrices = np.eye(3) + twist * rng.standard_normal((8, 3, 3)) * (1.0 - np.eye(3))
    matrices += scale * np.eye(3) * rng.standard_normal((8, 3, 1))
    z = np.einsum("kij,nkj->nki", matrices, force) + offset * rng.standard_normal((8, 3))
    z += 3e-3 * np.sqrt(rate) * rng.standard_normal(z.shape)
    omega = omega + 1e-4 * np.sqrt(rate) * rng.standard_normal(omega.shape)
    moving = slice(round(12.0 * rate), None)

    def error(z: Floats, places: Floats | None) -> float:
        fused = zr.array.fuse_accelerometers(z, omega, rate, positions=places)
        return rms((fused.accel - origin)[moving])

    missing, wrong = z.copy(), z.copy()
    missing[:, 2] = np.nan
    wrong[:, 2, 0] *= -1.0
    one = rms((z - origin[:, np.newaxis])[moving])
    plain = rms((wrong.mean(axis=1) - origin)[moving])
    found = [one, error(z, POSITIONS), error(missing, None), error(missing, POSITIONS)]
    return [*found, plain, error(wrong, POSITIONS)]


def main() -> None:
    """Print the tables."""
    board = Board(Path(sys.argv[1]) if len(sys.argv) > 1 else BESIDE)
    for part in (between, noise, turning, limits, faults, without_rate):
        print(part(board), flush=True)
    print(truth())


if __name__ == "__main__":
    main()
