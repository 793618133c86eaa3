"""All position methods for a standing and a driving receiver: the evidence table and a figure.

python examples/position_study.py [FOLDER]

The truth is an RTK drive, with three minutes of standing added at both ends. The simulated receiver
has one fix per second with these errors:

- white noise of 0.7 m
- slow error of 2.5 m with a correlation time of 120 s
- Doppler noise of 0.1 m/s
- four spells with signals weaker by 12 dB and four times the white noise
"""

import argparse
import sys
from collections.abc import Callable
from dataclasses import dataclass
from pathlib import Path
from typing import TYPE_CHECKING, Final

import numpy as np
import numpy.typing as npt
import pyarrow.parquet as pq

import zerorate as zr
from recordings import BESIDE
from tables import table
from zerorate.show import save_figure
from zerorate.show.style import (
    BLACK,
    BLUE,
    FONT_PT,
    GREY_TEXT,
    ORANGE,
    VERMILION,
    new_figure,
    style_panels,
)

if TYPE_CHECKING:
    from matplotlib.axes import Axes

Floats = npt.NDArray[np.float64]
Flags = npt.NDArray[np.bool_]
Method = Callable[["Fixes"], Floats]

DRIVE = "drive_gnss_4hz.parquet"
FIGURES = Path(__file__).parents[1] / "docs" / "figures"
SEEDS = 20
STANDING = 180
"""Additional standing at both ends of the drive, s."""

WHITE, SLOW, FORGOTTEN, DOPPLER = 0.7, 2.5, 120.0, 0.1
STRONG, WEAK, SPELL = 45.0, 33.0, 25
SPELLS = (60, 160, 450, 800)
"""Starts of the spells with weak signals, s: three while standing, one while driving."""

RESTS, MOVES = 0.3, 3.0
"""Speed below which it stands, and speed above which it drives, m/s."""

# Radius of a sphere that fits the 4 km of the drive to a centimetre.
NORTH, EAST = 6.365e6, 6.387e6


@dataclass(frozen=True)
class Drive:
    """Position once a second, m east and north, velocity, m/s, and mask of rest."""

    place: Floats
    velocity: Floats

    @property
    def speed(self) -> Floats:
        """Speed in each second, m/s."""
        return np.hypot(*self.velocity.T)

    @property
    def rest(self) -> Flags:
        """Mask of seconds in which it stands."""
        return self.speed < RESTS


@dataclass(frozen=True)
class Fixes:
    """Outputs of a receiver, (n, seeds, ...), and of a wheel."""

    position: Floats
    speed: Floats
    cn0: Floats
    rest: Flags


def driven(folder: Path) -> Drive:
    """Return the drive with its standing, once a second."""
    if not (folder / DRIVE).exists():
        print(f"no recording {DRIVE} in {folder}; give the folder it is in", file=sys.stderr)
        raise SystemExit(1)
    names = ["latitude_deg", "longitude_deg", "velocity_east_mps", "velocity_north_mps"]
    read = pq.read_table(folder / DRIVE, columns=names)
    latitude, longitude, *velocity = (read[name].to_numpy()[::4] for name in names)
    north = NORTH * np.radians(latitude - latitude[0])
    east = EAST * np.cos(np.radians(latitude[0])) * np.radians(longitude - longitude[0])
    ends = ((STANDING, STANDING), (0, 0))
    place = np.pad(np.stack([east, north], axis=1), ends, mode="edge")
    return Drive(place, np.pad(np.stack(velocity, axis=1), ends))


def received(drive: Drive, seeds: int) -> Fixes:
    """Return the outputs of receivers with random errors."""
    n = len(drive.place)
    cn0 = np.full(n, STRONG)
    for first in SPELLS:
        cn0[first : first + SPELL] = WEAK
    white = WHITE * 10.0 ** ((STRONG - cn0) / 20.0)
    kept = np.exp(-1.0 / FORGOTTEN)
    position, speed = np.empty((2, n, seeds, 2))
    for seed in range(seeds):
        rng = np.random.default_rng(seed)
        error = np.empty((n, 2))
        error[0] = SLOW * rng.standard_normal(2)
        fresh = SLOW * np.sqrt(1.0 - kept**2) * rng.standard_normal((n, 2))
        for k in range(1, n):
            error[k] = kept * error[k - 1] + fresh[k]
        position[:, seed] = drive.place + error + white[:, None] * rng.standard_normal((n, 2))
        speed[:, seed] = drive.velocity + DOPPLER * rng.standard_normal((n, 2))
    several = [np.repeat(told[:, None], seeds, axis=1) for told in (cn0, drive.rest)]
    return Fixes(position, speed, several[0], several[1])


def by(method: str, *aids: str, **constants: float) -> Method:
    """Return a function that runs a method of the filter with some of its inputs."""

    def run(fixes: Fixes) -> Floats:
        channels = fixes.position.shape[1]
        f = zr.PositionFilter(1.0, method=method, channels=channels, **constants)  # type: ignore[call-overload]
        path: Floats = f.process(fixes.position, **{name: getattr(fixes, name) for name in aids})
        return path

    return run


def all_of_papers(fixes: Fixes) -> Floats:
    """Return the result of heading check and signal strength together."""
    kept = by("heading")(fixes)
    return by("strength", "cn0")(Fixes(kept, fixes.speed, fixes.cn0, fixes.rest))


METHODS: Final[dict[str, Method]] = {
    "raw": lambda fixes: fixes.position,
    "moving average of 10": by("moving_average"),
    "Kalman, q 0.5": by("kalman"),
    "Kalman, q 0.05": by("kalman", process_noise=0.05),
    "heading check": by("heading"),
    "signal strength": by("strength", "cn0"),
    "heading, then strength": all_of_papers,
    "aided by nothing": by("aided"),
    "aided, without rest": by("aided", "speed", "cn0"),
    "aided, without strength": by("aided", "speed", "rest"),
    "aided": by("aided", "speed", "cn0", "rest"),
}


def measures(path: Floats, drive: Drive) -> tuple[float, float, float]:
    """Return the error at rest, m, the path drawn at rest, m/min, and the error in motion, m."""
    miss = np.sum((path - drive.place[:, None]) ** 2, axis=-1)
    steps = np.hypot(*np.moveaxis(np.diff(path, axis=0), -1, 0))
    standing = drive.rest[1:] & drive.rest[:-1]
    rest, moving = (
        float(np.sqrt(miss[where].mean())) for where in (drive.rest, drive.speed > MOVES)
    )
    return rest, 60.0 * float(steps[standing].mean()), moving


def rows(drive: Drive, fixes: Fixes) -> list[tuple[str, ...]]:
    """Return one row per method."""
    found = []
    for name, method in METHODS.items():
        rest, drawn, moving = measures(method(fixes), drive)
        found.append((name, f"{rest:.2f}", f"{drawn:.1f}", f"{moving:.2f}"))
    return found


def draw(drive: Drive, fixes: Fixes) -> None:
    """Draw the output of one receiver while it stands, and its error over the whole drive."""
    figure = new_figure(180.0, 84.0)
    path, error = (
        figure.add_axes((0.07, 0.12, 0.40, 0.78)),
        figure.add_axes((0.56, 0.12, 0.42, 0.78)),
    )
    looks = (("raw", GREY_TEXT, 0.4), ("Kalman, q 0.5", ORANGE, 0.6), ("aided", BLUE, 1.4))
    for name, colour, width in looks:
        found = METHODS[name](fixes)[:, 0] - drive.place
        path.plot(*found[:STANDING].T, color=colour, lw=width, label=name)
        error.plot(np.hypot(*found.T), color=colour, lw=width, label=name)
    path.plot(0.0, 0.0, "x", color=VERMILION, ms=7, mew=1.6, label="where it is")
    draw_spells(error)
    path.set_aspect("equal", adjustable="datalim")
    path.set_xlabel("east [m]")
    path.set_ylabel("north [m]")
    path.set_title("three minutes of standing")
    error.set_xlabel("time [s]")
    error.set_ylabel("distance from where it is [m]")
    error.set_title("standing, driving, standing")
    error.set_ylim(0.0, 14.0)
    style_panels([path, error])
    path.legend(fontsize=FONT_PT, frameon=False, loc="best")
    save_figure(figure, FIGURES / "position_standing.png")


def draw_spells(axes: "Axes") -> None:
    """Mark the spells with weak signals."""
    for first in SPELLS:
        axes.axvspan(first, first + SPELL, color=BLACK, alpha=0.08, lw=0.0)
    axes.text(SPELLS[2] + SPELL / 2, 13.4, "weak signals", fontsize=FONT_PT, ha="center", va="top")


def main() -> None:
    """Print the table, and draw the figure if requested."""
    options = argparse.ArgumentParser(description=(__doc__ or "").split("\n")[0])
    options.add_argument("folder", nargs="?", type=Path, default=BESIDE, help="of the recordings")
    options.add_argument("--seeds", type=int, default=SEEDS, help="receivers (default: 20)")
    options.add_argument("--figure", action="store_true", help="draw it into docs/figures")
    options.add_argument("--markdown", action="store_true", help="a table for the page")
    chosen = options.parse_args()
    drive = driven(chosen.folder)
    fixes = received(drive, chosen.seeds)
    head = ("filter", "error at rest, m", "path drawn at rest, m/min", "error under way, m")
    title = f"A receiver that stands and drives, {chosen.seeds} seeds"
    print(table(title, head, rows(drive, fixes), chosen.markdown))
    if chosen.figure:
        draw(drive, fixes)


if __name__ == "__main__":
    main()
