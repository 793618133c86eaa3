"""`zerorate.navigate` with a barometer, a compass, a magnetometer and two antennas."""

import math

import numpy as np
import pyarrow.parquet as pq
import pytest

import zerorate as zr
from support.vehicles import simulate_vehicle
from zerorate.navigation import OUTPUTS
from zerorate.record.log import LogError
from zerorate.simulation import (
    antenna_baseline,
    barometer,
    compass_heading,
    magnetometer,
    with_aids,
)

SECONDS = 130.0
STATES = ("position", "velocity", "quaternion", "gyro_bias", "accel_bias", "sigma", "usable")


@pytest.fixture(scope="module")
def boat():
    """Return a boat with all aids but a magnetometer."""
    made = simulate_vehicle("boat", SECONDS, seed=4)
    return made, with_aids(made, pressure=barometer(made), heading=compass_heading(made, rate=5.0))


def rms(found, made, column):
    error = found.track.errors(made.truth_position, made.truth_velocity, made.truth_quaternion)
    late = error[found.track.time > 60.0]
    return float(np.sqrt(np.mean(late[:, column] ** 2)))


def same(one, other):
    return all(
        np.array_equal(getattr(one.track, name), getattr(other.track, name), equal_nan=True)
        for name in STATES
    )


def test_aids_are_found_by_name_and_help(boat):
    made, recording = boat
    without, found = (zr.navigate(recording, made.fixes, aids=how) for how in ("stated", "auto"))
    assert set(found.track.aids) == {"pressure", "heading"}
    assert not found.alarms
    assert rms(found, made, 8) < rms(without, made, 8)
    assert rms(found, made, 2) < 1.05 * rms(without, made, 2)
    assert any("barometer's height is" in note for note in found.notes)
    assert any("compass reads" in note for note in found.notes)
    table = found.table()
    assert all(f"{name}, " in table for name in OUTPUTS)
    assert "pressure" in table
    log = found.to_log()
    assert {f"{name}_usable" for name in OUTPUTS} <= set(log.extra)


def test_a_recording_without_aids_gives_the_same_bits(boat):
    made, recording = boat
    plain = zr.navigate(made.recording(), made.fixes)
    assert same(plain, zr.navigate(recording, made.fixes, aids="stated"))
    assert same(plain, zr.navigate(made.recording(), made.fixes, aids="stated"))


def test_arrays_columns_and_logs_are_one(boat):
    made, recording = boat
    pressure = barometer(made)
    by_name = zr.navigate(recording, made.fixes, pressure="pressure", aids="stated")
    by_array = zr.navigate(
        made.recording(), made.fixes, pressure=pressure, pressure_unit="Pa", aids="stated"
    )
    at = np.isfinite(pressure)
    aid = zr.navigation.Aid(made.time[at], pressure[at])
    by_aid = zr.navigate(made.recording(), made.fixes, pressure=aid)
    assert same(by_name, by_array)
    assert same(by_name, by_aid)


def test_the_command_says_the_same(boat, tmp_path, call):
    made, _ = boat
    columns = {"time_s": made.time}
    for name, values in (("gyro_{}_radps", made.gyro), ("accel_{}_mps2", made.accel)):
        columns |= {name.format(axis): values[:, i] for i, axis in enumerate("xyz")}
    columns["baro"] = barometer(made) / 100.0
    columns["compass_deg"] = np.degrees(0.5 * math.pi - compass_heading(made, rate=5.0))
    rows = np.column_stack([*columns.values()])
    log = tmp_path / "boat.csv"
    np.savetxt(log, rows, delimiter=",", header=",".join(columns), comments="", fmt="%.17g")
    fixes = made.fixes
    named = dict(zip(("latitude_deg", "longitude_deg", "height_m"), fixes.position.T, strict=True))
    ways = ("north", "east", "down")
    named |= {f"velocity_{w}_mps": v for w, v in zip(ways, fixes.velocity.T, strict=True)}
    rows = np.column_stack([fixes.time, *named.values()])
    gnss = tmp_path / "fixes.csv"
    np.savetxt(gnss, rows, delimiter=",", header=",".join(("time_s", *named)), comments="",
               fmt="%.17g")  # fmt: skip
    code, out, err = call("navigate", log, gnss, "--no-figure", "--limits", "heading=0.02", "-o",
                          tmp_path / "out")  # fmt: skip
    found = zr.navigate(log, gnss, limits={"heading": 0.02})
    assert code == 0, err
    assert found.table() in out
    assert "baro: 95" in " ".join(found.notes)
    assert any("counts anticlockwise from east" in note for note in found.notes)
    assert found.track.limits["heading"] == 0.02
    saved = pq.read_table(tmp_path / "out" / "boat-zerorate-navigate.parquet")
    assert np.array_equal(saved["heading_usable"].to_numpy(), found.track.usable[:, 4])


def test_a_robot_that_stands_has_the_heading_of_its_compass():
    made = simulate_vehicle("robot", 90.0, seed=5, rest=200.0)
    recording = with_aids(made, heading=compass_heading(made, rate=5.0, offset=0.02))
    with pytest.raises(LogError):
        zr.navigate(made.recording(), made.fixes)
    found = zr.navigate(recording, made.fixes)
    assert any("heading at the start by the compass" in note for note in found.notes)
    error = found.track.errors(made.truth_position, made.truth_velocity, made.truth_quaternion)
    assert abs(error[-1, 8]) < 3.0 * found.track.sigma[-1, 8]
    assert found.track.sigma[-1, 8] < 0.05


@pytest.mark.parametrize("seed", range(2))
@pytest.mark.parametrize("iron", [(0.0, 0.0, 0.0), (12.0, -8.0, 5.0)], ids=["clean", "iron"])
@pytest.mark.parametrize("magnet", [(), ((70.0, 90.0, (30.0, 20.0, 10.0)),)], ids=["", "magnet"])
def test_a_magnetometer_never_turns_the_track_wrong(seed, iron, magnet):
    """The heading is at most a tenth of its σ worse than without, and its σ holds."""
    made = simulate_vehicle("robot", SECONDS, seed=seed)
    field = magnetometer(made, 25.0, hard_iron=iron, magnets=magnet, seed=seed)
    recording = with_aids(made, mag=field)
    without, found = (zr.navigate(recording, made.fixes, mag=mag) for mag in (False, True))
    sigma = float(np.median(found.track.sigma[found.track.time > 60.0, 8]))
    assert rms(found, made, 8) < rms(without, made, 8) + 0.1 * sigma
    assert rms(found, made, 8) < 2.5 * sigma
    assert any("magnetometer" in note for note in found.notes)


def test_outages_have_the_aids(boat):
    made, recording = boat
    pressure = barometer(made)
    plain, aided = (
        zr.navigation.outages(made.recording(), made.fixes, seconds=20.0, aids=aids)
        for aids in (None, {"pressure": pressure})
    )
    assert plain[20.0].n == aided[20.0].n
    assert plain[20.0].rms() != aided[20.0].rms()
    found = zr.navigate(recording, made.fixes, outages=20.0)
    assert found.outages[20.0].n == plain[20.0].n
    with pytest.raises(TypeError):
        zr.navigation.outages(made.recording(), made.fixes, seconds=20.0, aids={"wind": pressure})


def test_a_magnetometer_is_not_used_unless_requested():
    made = simulate_vehicle("robot", SECONDS, seed=1)
    recording = with_aids(made, mag=magnetometer(made, 25.0))
    assert same(zr.navigate(recording, made.fixes), zr.navigate(made.recording(), made.fixes))
    with pytest.raises(LogError, match="there is no magnetometer; the recording has: gyro, accel"):
        zr.navigate(made.recording(), made.fixes, mag=True)


def test_two_antennas_need_their_baseline(boat):
    made, _ = boat
    arm = (0.2, 1.0, 0.0)
    recording = with_aids(made, baseline=antenna_baseline(made, arm))
    found = zr.navigate(recording, made.fixes)
    assert not found.track.aids
    assert "baseline=(1, 0, 0) says it" in found.alarms[0]
    found = zr.navigate(recording, made.fixes, baseline=arm)
    assert rms(found, made, 8) < math.radians(0.5)


@pytest.mark.parametrize(
    ("options", "message"),
    [
        ({"aids": "all"}, "aids must be 'auto' or 'stated', got 'all'"),
        ({"pressure_unit": "atm"}, "pressure_unit must be one of Pa, hPa"),
        ({"compass_unit": "gon"}, "compass_unit must be deg or rad, got 'gon'"),
        ({"pressure": "wind"}, "pressure must name a log of the recording, gyro, accel, pressure"),
        ({"pressure": np.ones(5)}, "pressure must have shape"),
        ({"limits": {"position": -1.0}}, "limits"),
        ({"limits": {"wind": 1.0}}, "limits"),
    ],
)
def test_wrong_arguments(boat, options, message):
    made, recording = boat
    with pytest.raises(ValueError, match=message):
        zr.navigate(recording, made.fixes, **options)
