"""Files of receivers as people have them: their units by name or size, speed and course, GPX."""

import numpy as np
import pytest

import zerorate as zr
from zerorate.io import read_fixes

FIXES = zr.simulate_drive(duration=40.0, seed=5).fixes
PLACE, V, T = FIXES.position, FIXES.velocity, FIXES.time
MS, E7 = np.rint(1e3 * T).astype(int), np.rint(1e7 * PLACE[:, :2]).astype(np.int64)
MM, ONE = np.rint(1e3 * PLACE[:, 2]).astype(int), np.ones(len(T), int)
SPEED = np.hypot(V[:, 0], V[:, 1])
COURSE = np.degrees(np.arctan2(V[:, 1], V[:, 0])) % 360.0


def rows(*columns):
    return "".join(",".join(map(str, row)) + "\n" for row in zip(*columns, strict=True))


def fly(head, label):
    stamps = [f"2024-05-01T12:00:{s:06.3f}Z" for s in T - T[0]]
    body = rows(*([[label] * len(T)] if label else []), stamps, *PLACE.T, *V.T, 1.5 * ONE)
    return head + body


COL = "$FLYS,1\n$VAR,FIRMWARE_VER,v2023\n$COL,GNSS,time,lat,lon,hMSL,velN,velE,velD,hAcc\n"
TABLES = {
    "pvt": "time_s,lat,lon,height\n" + rows(T, *E7.T, MM),
    "raw": "time_s,lat_1e7,lon_1e7,alt_mm\n" + rows(T, *E7.T, MM),
    "ubx": "iTOW,lat,lon,height,velN,velE,velD,hAcc,vAcc,sAcc\n"
    + rows(MS + 345_600_000, *E7.T, MM, *np.rint(1e3 * V).astype(int).T, *[1500 * ONE] * 3),
    "mavlink": "time_ms,lat,lon,alt_mm,vn,ve,vd\n"
    + rows(MS, *E7.T, MM, *np.rint(1e2 * V).astype(int).T),
    "androsensor": "Time since start in ms ,LOCATION Latitude : ,LOCATION Longitude : ,"
    "LOCATION Altitude ( m),LOCATION Speed ( Kmh),LOCATION Accuracy ( m),LOCATION ORIENTATION (°)\n"
    + rows(MS, *PLACE.T, 3.6 * SPEED, 1.5 * ONE, COURSE),
    "phone": "time,latitude,longitude,altitude,speed,bearing,horizontalAccuracy,verticalAccuracy\n"
    + rows(MS + 1_714_560_000_000, *PLACE.T, SPEED, COURSE, 1.5 * ONE, 1.5 * ONE),
    "phyphox": '"Time (s)","Latitude (°)","Longitude (°)","Height (m)","Velocity (m/s)",'
    '"Direction (°)","Horizontal Accuracy (m)"\n' + rows(T, *PLACE.T, SPEED, COURSE, 1.5 * ONE),
    "knots": "t_s,lat,lon,alt,sog_kn,cog\n" + rows(T, *PLACE.T, SPEED * 3600 / 1852, COURSE),
    "flysight 2": fly(COL + "$UNIT,GNSS,,deg,deg,m,m/s,m/s,m/s,m\n$DATA\n", "$GNSS"),
    "flysight": fly(
        "time,lat,lon,hMSL,velN,velE,velD,hAcc\n,(deg),(deg),(m),(m/s),(m/s),(m/s),(m)\n", ""
    ),
}


@pytest.mark.parametrize("name", TABLES)
def test_receivers(tmp_path, name):
    path = tmp_path / "fixes.csv"
    path.write_text(TABLES[name])
    found = read_fixes(path)
    np.testing.assert_allclose(found.position[:, :2], PLACE[:, :2], rtol=0, atol=1e-7)
    np.testing.assert_allclose(found.position[:, 2], PLACE[:, 2], rtol=0, atol=1e-3)
    np.testing.assert_allclose(found.time - found.time[0], T - T[0], rtol=0, atol=1e-3)
    if name not in ("pvt", "raw"):
        np.testing.assert_allclose(found.velocity[:, :2], V[:, :2], rtol=0, atol=0.006)
    if name not in ("pvt", "raw", "mavlink", "knots"):
        np.testing.assert_allclose(found.position_sigma[:, 0], 1.5)
    for word, names in (("1e-7 deg", ("pvt", "raw", "ubx")), ("course", ("phone", "knots"))):
        assert any(word in note for note in found.notes) or name not in names


def test_what_write_gpx_writes_is_read(tmp_path):
    zr.navigation.write_gpx(tmp_path / "track.gpx", FIXES, epoch=1.7e9)
    found = read_fixes(tmp_path / "track.gpx")
    np.testing.assert_allclose(found.position, PLACE, rtol=0, atol=1e-6)
    np.testing.assert_allclose(found.time - found.time[0], T - T[0], rtol=0, atol=1e-3)
    assert found.epoch == 0.0
