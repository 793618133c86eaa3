"""Fixes from files of receivers and from tables: values, units, time, and what is damaged."""

import contextlib
import json
import sys

import numpy as np
import pytest

import zerorate as zr
from support.formats import damaged
from support.receivers import (
    SOLUTION_COLUMNS,
    SOLUTION_HEAD,
    bag_csv,
    echo_csv,
    gga,
    gst,
    json_lines,
    message,
    nmea,
    rmc,
    sentence,
    solution_row,
    vtg,
)
from support.recordings import RECORDINGS, column, needs_recordings
from zerorate.record import LogError

KNOT = 1852.0 / 3600.0
MAY_1 = 1_714_521_600.0
"""1 May 2024, the Unix time of its midnight."""


def epoch(clock, latitude=48.1173, longitude=11.5167, **more):
    return [
        rmc(clock, latitude, longitude, **more),
        gga(clock, latitude, longitude),
        gst(clock),
    ]


class TestNmea:
    def test_values_and_units(self, tmp_path):
        lines = [*epoch("120000.00"), *epoch("120000.20", 48.1174)]
        fixes = zr.read_fixes(nmea(tmp_path / "a.nmea", lines))
        np.testing.assert_array_equal(fixes.time, MAY_1 + 43_200.0 + np.array([0.0, 0.2]))
        # Seven decimals of a minute.
        np.testing.assert_allclose(fixes.position[:, 0], [48.1173, 48.1174], atol=1e-9)
        np.testing.assert_allclose(fixes.position[:, 1:], [[11.5167, 147.5]] * 2, atol=1e-9)
        np.testing.assert_allclose(fixes.velocity[:, :2], [[0.0, 10.0 * KNOT]] * 2, atol=1e-15)
        assert np.isnan(fixes.velocity[:, 2]).all()
        np.testing.assert_array_equal(fixes.position_sigma, [[0.02, 0.01, 0.03]] * 2)
        assert (fixes.quality.tolist(), fixes.satellites.tolist()) == ([4, 4], [12, 12])
        assert (fixes.epoch, fixes.velocity_sigma, fixes.notes) == (0.0, None, ())

    @pytest.mark.parametrize(("latitude", "longitude"), [(-33.85, 151.2), (-0.5, -0.25), (9, -179)])
    def test_all_hemispheres(self, tmp_path, latitude, longitude):
        fixes = zr.read_fixes(nmea(tmp_path / "a.txt", epoch("000000.00", latitude, longitude)))
        np.testing.assert_allclose(fixes.position[0, :2], [latitude, longitude], atol=1e-9)

    @pytest.mark.parametrize("dated", [True, False])
    def test_midnight(self, tmp_path, dated):
        clocks = ["235959.50", "235959.75", "000000.00", "000000.25"]
        lines = [gga(clock, 1.0, 2.0) for clock in clocks]
        if dated:  # after the first fix only, and not again
            lines.insert(2, rmc("235959.75", 1.0, 2.0, date="311224"))
        fixes = zr.read_fixes(nmea(tmp_path / "a.nmea", lines))
        np.testing.assert_array_equal(np.diff(fixes.time), [0.25] * 3)
        new_year = 1_735_689_600.0
        assert fixes.time[2] == (new_year if dated else 86_400.0)
        assert fixes.epoch == (0.0 if dated else None)
        assert any("has the date" in note for note in fixes.notes) is not dated

    def test_the_date_changes_with_the_day(self, tmp_path):
        lines = [*epoch("235959.90", date="280224"), *epoch("000000.10", date="290224")]
        fixes = zr.read_fixes(nmea(tmp_path / "a.nmea", lines))
        assert np.diff(fixes.time) == pytest.approx(0.2, abs=1e-6)

    def test_wrong_checksums_and_garbage_are_counted(self, tmp_path):
        bad = gga("120001.00", 1.0, 2.0).replace("*", "1*")
        lines = [
            *epoch("120000.00"),
            bad,
            bad,
            "noise $",
            "$GNGGA,1200",
            "$GNXYZ,\xff\x00$GPXXX,1*00",
        ]
        fixes = zr.read_fixes(nmea(tmp_path / "a.log", [*lines, *epoch("120002.00")]))
        assert len(fixes) == 2
        assert fixes.notes[0].startswith("left out: 3 sentences with a wrong checksum")

    def test_a_moment_without_fix_is_left_out(self, tmp_path):
        void = [rmc("120001.00", 0.0, 0.0, status="V"), gga("120001.00", 0.0, 0.0, quality=0)]
        blank = sentence("GNGGA,120002.00,,,,,0,00,99.9,,M,,M,,")
        fixes = zr.read_fixes(nmea(tmp_path / "a.nmea", [*void, blank, *epoch("120003.00")]))
        assert len(fixes) == 1
        assert fixes.notes == ("left out: 2 moments without a fix",)

    def test_no_fix_at_all(self, tmp_path):
        bad = gga("120001.00", 1.0, 2.0).replace("*", "1*")
        with pytest.raises(LogError, match=r"a\.nmea: there is no fix: 1 sentence with a wrong"):
            zr.read_fixes(nmea(tmp_path / "a.nmea", [bad]))

    def test_speed_and_course_of_their_own(self, tmp_path):
        lines = [gga("120000.00", 1.0, 2.0), vtg(), gga("120001.00", 1.0, 2.0), vtg("", "0.0")]
        lines += [gga("120002.00", 1.0, 2.0), vtg("", "0.3")]
        fixes = zr.read_fixes(nmea(tmp_path / "a.nmea", lines))
        np.testing.assert_allclose(fixes.velocity[0, :2], [-10.0, 0.0], atol=1e-14)
        np.testing.assert_array_equal(fixes.velocity[1, :2], [0.0, 0.0])
        # Too slow for a course, and yet not still.
        assert np.isnan(fixes.velocity[2]).all()

    def test_without_a_geoid_the_height_is_that_above_the_sea(self, tmp_path):
        fixes = zr.read_fixes(nmea(tmp_path / "a.nmea", [gga("120000.00", 1.0, 2.0, geoid="")]))
        assert fixes.position[0, 2] == 100.0
        assert "above mean sea level" in fixes.notes[0]

    def test_stamped_lines(self, tmp_path):
        lines = [f"2024-05-01 12:00:00.123 {line}" for line in epoch("120000.00")]
        assert len(zr.read_fixes(nmea(tmp_path / "a.csv", lines))) == 1

    def test_the_package_is_absent(self, tmp_path, monkeypatch):
        monkeypatch.setitem(sys.modules, "pynmeagps", None)
        with pytest.raises(ImportError, match=r"an NMEA file needs pynmeagps.*\[nmea\]"):
            zr.read_fixes(nmea(tmp_path / "a.nmea", epoch("120000.00")))

    def test_cut_at_any_place(self, tmp_path):
        whole = "\r\n".join([*epoch("120000.00"), *epoch("120001.00"), ""]).encode()
        for length in range(len(whole)):
            path = tmp_path / "a.nmea"
            path.write_bytes(whole[:length])
            try:
                assert len(zr.read_fixes(path)) in (1, 2)
            except LogError:
                # The first sentence is not over yet.
                assert length < len(rmc("120000.00", 48.1173, 11.5167))

    def test_receivers_that_write_no_checksum(self, tmp_path):
        lines = [line.partition("*")[0] for line in epoch("120000.00")]
        assert len(zr.read_fixes(nmea(tmp_path / "a.nmea", lines))) == 1


class TestRtklib:
    def write(self, path, *rows, head=SOLUTION_HEAD + SOLUTION_COLUMNS):
        path.write_text(head + "".join(rows))
        return path

    def test_values_and_units(self, tmp_path):
        rows = [solution_row("12:00:00.000"), solution_row("12:00:00.200", 1)]
        fixes = zr.read_fixes(self.write(tmp_path / "a.pos", *rows))
        np.testing.assert_array_equal(fixes.time, MAY_1 + 43_200.0 + np.array([0.0, 0.2]))
        np.testing.assert_array_equal(fixes.position[1], [40.099100001, -105.146100001, 1500.1234])
        np.testing.assert_array_equal(fixes.velocity[0], [1.5, -2.5, -0.25])
        np.testing.assert_array_equal(fixes.position_sigma[0], [0.01, 0.009, 0.025])
        np.testing.assert_array_equal(fixes.velocity_sigma[0], [0.05, 0.04, 0.09])
        assert (fixes.quality[0], fixes.satellites[0]) == (1, 12)
        assert fixes.epoch == -18.0
        assert fixes.notes == ("times are of GPS, which is ahead of UTC by the leap seconds",)

    def test_utc_and_weeks(self, tmp_path):
        utc = self.write(
            tmp_path / "utc.pos",
            solution_row("12:00:00.000"),
            head=SOLUTION_COLUMNS.replace("GPST", "UTC "),
        )
        assert zr.read_fixes(utc).epoch == 0.0
        # 1 May 2024 is the fourth day of week 2312.
        row = solution_row("12:00:00.000").replace("2024/05/01 12:00:00.000", "2312 302400.000")
        weeks = zr.read_fixes(self.write(tmp_path / "week.txt", row))
        assert weeks.time[0] == MAY_1 + 43_200.0

    def test_commas_and_no_header(self, tmp_path):
        row = ",".join(solution_row("12:00:00.000").split()[:15]) + "\n"
        fixes = zr.read_fixes(
            self.write(tmp_path / "a.pos", row, row.replace(":00.", ":01."), head="")
        )
        assert (len(fixes), fixes.position_sigma[0, 1], fixes.velocity) == (2, 0.009, None)
        assert "there is no header" in fixes.notes[0]

    @pytest.mark.parametrize(
        ("columns", "message"),
        [
            ("e-baseline(m)  n-baseline(m)  u-baseline(m)", "baselines between two receivers"),
            ("x-ecef(m) y-ecef(m) z-ecef(m)", "earth-centred coordinates"),
            ("latitude(d'\") longitude(d'\") height(m)", "degrees, minutes and seconds"),
            ("height(m) latitude(deg) longitude(deg)", "does not begin with a latitude"),
        ],
    )
    def test_other_solutions_are_refused(self, tmp_path, columns, message):
        head = f"%  GPST                  {columns}   Q  ns\n"
        path = self.write(tmp_path / "a.pos", solution_row("12:00:00.000"), head=head)
        with pytest.raises(LogError, match=message):
            zr.read_fixes(path)

    def test_damage(self, tmp_path):
        rows = [solution_row("12:00:00.000"), solution_row("12:00:00.200", 1)]
        cut = self.write(tmp_path / "cut.pos", rows[0], rows[1][:60])
        assert len(zr.read_fixes(cut)) == 1
        with pytest.raises(LogError, match="line 7 has 5 cells, expected 24"):
            zr.read_fixes(self.write(tmp_path / "a.pos", rows[0], rows[1][:60] + "\n", rows[0]))
        with pytest.raises(LogError, match="line 6 holds a cell that is no number"):
            zr.read_fixes(self.write(tmp_path / "b.pos", rows[0].replace("1500.", "x")))
        with pytest.raises(LogError, match="holds no fix"):
            zr.read_fixes(self.write(tmp_path / "c.pos"))
        with pytest.raises(LogError, match="a time is no date"):
            zr.read_fixes(self.write(tmp_path / "d.pos", rows[0].replace("12:00:00", "12:61:00")))


class TestMessages:
    @pytest.mark.parametrize("write", [json_lines, bag_csv, echo_csv], ids=lambda f: f.__name__)
    def test_values_and_units(self, tmp_path, write):
        suffix = "jsonl" if write is json_lines else "csv"
        fixes = zr.read_fixes(write(tmp_path / f"a.{suffix}", [message(i) for i in range(12)]))
        # Seconds since 1970 have steps of 2e-7 s.
        np.testing.assert_allclose(fixes.time, 1_714_564_800 + 0.2 * np.arange(12), atol=3e-7)
        np.testing.assert_allclose(fixes.position[:, 0], -33.9 + 1e-6 * np.arange(12), rtol=1e-15)
        np.testing.assert_array_equal(fixes.position[3, 1:], [151.2, 33.0])
        # Covariances are in east, north and up.
        np.testing.assert_array_equal(fixes.position_sigma, [[3.0, 2.0, 4.0]] * 12)
        assert (fixes.epoch, fixes.velocity, fixes.satellites) == (0.0, None, None)

    def test_no_fix_and_unknown_covariances(self, tmp_path):
        messages = [message(0, status=-1), message(1, kind=0), message(2)]
        fixes = zr.read_fixes(json_lines(tmp_path / "a.json", messages))
        assert len(fixes) == 2
        assert np.isnan(fixes.position_sigma[0]).all()
        assert fixes.notes == ("left out: 1 row without a fix",)

    def test_lists_and_objects(self, tmp_path):
        path, messages = tmp_path / "a.json", [message(i) for i in range(3)]
        for whole in (messages, {"topic": "/fix", "messages": messages}):
            path.write_text(json.dumps(whole))
            assert len(zr.read_fixes(path)) == 3
        path.write_text(json.dumps(messages[0]))
        assert len(zr.read_fixes(path)) == 1

    def test_ros_2(self, tmp_path):
        one = message(0)
        one["header"]["stamp"] = {"sec": 1_714_564_800, "nanosec": 500_000_000}
        assert zr.read_fixes(json_lines(tmp_path / "a.json", [one])).time[0] == 1_714_564_800.5

    def test_damage(self, tmp_path):
        lines = "".join(json.dumps(message(i)) + "\n" for i in range(3))
        path = tmp_path / "a.jsonl"
        path.write_text(lines[:-40])
        fixes = zr.read_fixes(path)
        assert (len(fixes), fixes.notes) == (2, ("line 3 is cut off, and left out",))
        path.write_text("{}\n" + lines.replace('"latitude"', '"lat'))
        with pytest.raises(LogError, match="line 2 is no JSON object"):
            zr.read_fixes(path)
        for text in ("[1, 2]", "{}", "[" * 100_000):
            path.write_text(text)
            with pytest.raises(LogError, match=r"a\.jsonl: "):
                zr.read_fixes(path)


def table(**more):
    return {
        "time_s": [0.0, 0.25, 0.5],
        "latitude_deg": [45.0, 45.1, 45.2],
        "longitude_deg": [-7.0, -7.1, -7.2],
        "height_m": [1.0, 2.0, 3.0],
    } | more


class TestTables:
    def test_every_column(self):
        fixes = zr.read_fixes(
            table(
                velocity_north_mps=[1.0, 1.0, 1.0],
                velocity_east_mps=[2.0, 2.0, 2.0],
                velocity_up_mps=[3.0, 3.0, 3.0],
                position_sigma_north_m=[0.1, 0.1, np.nan],
                position_sigma_east_m=[0.2, 0.2, 0.0],
                position_sigma_up_m=[0.3, 0.3, 0.3],
                velocity_sigma_mps=[0.4, 0.4, 0.4],
                fix=[1, 1, 5],
                satellites=[9, 9, np.nan],
            )
        )
        np.testing.assert_array_equal(fixes.velocity, [[1.0, 2.0, -3.0]] * 3)
        np.testing.assert_array_equal(fixes.position_sigma[0], [0.1, 0.2, 0.3])
        np.testing.assert_array_equal(fixes.position_sigma[2], [np.nan, np.nan, 0.3])
        np.testing.assert_array_equal(fixes.velocity_sigma, np.full((3, 3), 0.4))
        assert (fixes.quality.tolist(), fixes.satellites.tolist()) == ([1, 1, 5], [9, 9, -1])
        assert fixes.notes == ("standard deviations of zero count as unknown",)
        assert fixes.epoch is None

    def test_short_names_and_radians(self):
        fixes = zr.read_fixes(
            {"t": [0.0, 1.0], "Lat": [1.0, 2.0], "Lon": [3.0, 4.0], "Alt": [5.0, 6.0],
             "vn": [1.0, 1.0], "ve": [0.0, 0.0], "vd": [2.0, 2.0], "std_n": [1.0, 1.0]}
        )  # fmt: skip
        np.testing.assert_array_equal(fixes.position[1], [2.0, 4.0, 6.0])
        np.testing.assert_array_equal(fixes.velocity[0], [1.0, 0.0, 2.0])
        np.testing.assert_array_equal(fixes.position_sigma[0], [1.0, np.nan, np.nan])
        radians = zr.read_fixes({"t": [0.0, 1.0], "lat_rad": [0.5, 0.5], "lon_rad": [-1.0, -1.0]})
        np.testing.assert_array_equal(radians.position[0, :2], np.degrees([0.5, -1.0]))
        assert np.isnan(radians.position[:, 2]).all()
        assert "no column is a height" in radians.notes[0]

    def test_sigmas_are_not_taken_for_what_they_are_of(self):
        fixes = zr.read_fixes(
            {"t": [0.0, 1.0], "sigma_lat": [9.0, 9.0], "sigma_velocity_north_mps": [0.1, 0.2],
             "std_alt": [8.0, 8.0], "lat": [1.0, 1.0], "lon": [2.0, 2.0], "alt": [3.0, 3.0]}
        )  # fmt: skip
        np.testing.assert_array_equal(fixes.position[0], [1.0, 2.0, 3.0])
        assert fixes.velocity is None
        np.testing.assert_array_equal(fixes.velocity_sigma[:, 0], [0.1, 0.2])

    def test_rows_without_a_place_or_out_of_order(self):
        rows = {
            "time_s": np.concatenate([np.arange(30.0), [28.0, 29.0, 30.0]]),
            "lat": np.r_[0.0, np.nan, np.full(31, 45.0)],
            "lon": np.r_[0.0, 7.0, np.full(31, 7.0)],
        }
        fixes = zr.read_fixes(rows)
        np.testing.assert_array_equal(fixes.time, np.arange(2.0, 31.0))
        assert fixes.notes[1:] == (
            "left out: 2 rows without a fix",
            "left out: 2 rows that do not come later than those before",
        )
        with pytest.raises(LogError, match="1 row of 3 do not come later"):
            zr.read_fixes(table(time_s=[0.0, 2.0, 1.0]))

    @pytest.mark.parametrize(
        ("changes", "message"),
        [
            ({"latitude_deg": [450_000_000.0] * 3}, "fix 0 is latitude 450000000.0"),
            ({"latitude_deg": [np.nan] * 3}, "there is no fix: no row has a position"),
            ({"time_s": [0.0, np.nan, 1.0]}, "time column 'time_s'"),
        ],
    )
    def test_refusals(self, changes, message):
        with pytest.raises(LogError, match=message):
            zr.read_fixes(table(**changes))

    def test_missing_columns_are_named(self):
        rows = table()
        for name in ("latitude", "longitude"):
            fewer = {key: value for key, value in rows.items() if key != f"{name}_deg"}
            with pytest.raises(LogError, match=f"no column is a {name}, such as {name}_deg"):
                zr.read_fixes(fewer)
        del rows["time_s"]
        with pytest.raises(LogError, match="no column is the time"):
            zr.read_fixes(rows)

    def test_files_of_any_name(self, tmp_path):
        lines = ["time_s,lat,lon,alt,fix", "0.0,-45.5,170.25,10.0,3D", "0.5,-45.5,170.25,11.0,3D"]
        for name in ("a.csv", "a.log", "a"):
            path = tmp_path / name
            path.write_text("\n".join(lines))
            fixes = zr.read_fixes(path)
            np.testing.assert_array_equal(fixes.position[1], [-45.5, 170.25, 11.0])
            assert "not read: " in fixes.notes[0]
            assert fixes.quality is None

    def test_dates_as_text(self):
        fixes = zr.read_fixes(table(time_s=[f"2024-05-01T00:00:0{i}Z" for i in range(3)]))
        np.testing.assert_array_equal(fixes.time, MAY_1 + np.arange(3.0))
        assert fixes.epoch == 0.0


class TestFiles:
    def test_the_format_may_be_told(self, tmp_path):
        path = nmea(tmp_path / "a.dat", epoch("120000.00"))
        assert len(zr.read_fixes(path, "nmea")) == 1
        with pytest.raises(LogError, match=r"a\.dat: "):
            zr.read_fixes(path, "table")
        with pytest.raises(LogError, match=r"a\.dat: "):
            zr.read_fixes(path, "rtklib")
        with pytest.raises(ValueError, match="format must be one of 'nmea', 'rtklib'"):
            zr.read_fixes(path, "gpx")
        messages = bag_csv(tmp_path / "b.csv", [message(0), message(1)])
        assert len(zr.read_fixes(messages, "navsatfix")) == 2
        with pytest.raises(LogError, match="no line has an NMEA sentence"):
            zr.read_fixes(messages, "nmea")

    @pytest.mark.parametrize("name", ["a.nmea", "a.pos", "a.csv", "a.json", "a.parquet"])
    def test_empty_and_foreign_files(self, tmp_path, name):
        path = tmp_path / name
        path.write_bytes(b"")
        with pytest.raises(LogError, match="the file is empty"):
            zr.read_fixes(path)
        rng = np.random.default_rng(3)
        for raw in (b"\n", b"hello\nworld\n", rng.bytes(3000), b"\x00" * 100):
            path.write_bytes(raw)
            with pytest.raises(LogError, match=name.replace(".", r"\.")):
                zr.read_fixes(path)

    @pytest.mark.parametrize("kind", ["nmea", "pos", "jsonl", "csv"])
    def test_damage_is_told_in_one_sentence(self, tmp_path, kind):
        path = tmp_path / f"a.{kind}"
        match kind:
            case "nmea":
                nmea(path, [line for i in range(5) for line in epoch(f"12000{i}.00")])
            case "pos":
                rows = [solution_row(f"12:00:0{i}.000", i) for i in range(5)]
                path.write_text(SOLUTION_HEAD + SOLUTION_COLUMNS + "".join(rows))
            case "jsonl":
                json_lines(path, [message(i) for i in range(5)])
            case _:
                bag_csv(path, [message(i) for i in range(5)])
        whole, rng = path.read_bytes(), np.random.default_rng(8)
        for _ in range(150):
            path.write_bytes(damaged(whole, rng))
            with contextlib.suppress(LogError):
                assert 1 <= len(zr.read_fixes(path)) <= 10

    def test_missing_files(self, tmp_path):
        with pytest.raises(FileNotFoundError):
            zr.read_fixes(tmp_path / "none.nmea")
        with pytest.raises(IsADirectoryError):
            zr.read_fixes(tmp_path)


@needs_recordings
class TestDrive:
    def test_fixes(self):
        fixes = zr.read_fixes(RECORDINGS / "drive_gnss_4hz.parquet")
        assert len(fixes) == 2197
        assert np.mean(fixes.quality == 1) == pytest.approx(0.996, abs=5e-4)
        assert fixes.velocity.shape == fixes.velocity_sigma.shape == (2197, 3)
        # What the receiver drives is what its velocities add up to, within their noise.
        from zerorate.geometry.earth import local_ned

        way = local_ned(fixes.position[-1], fixes.position[0])
        mean = 0.5 * (fixes.velocity[1:] + fixes.velocity[:-1])
        driven = np.sum(mean * np.diff(fixes.time)[:, None], axis=0)
        np.testing.assert_allclose(driven, way, atol=8.0)

    def test_fixes_of_an_autopilot(self):
        fixes = zr.read_fixes(RECORDINGS / "px4_sample_log_small.ulg")
        assert (len(fixes), fixes.epoch) == (32, None)
        np.testing.assert_allclose(fixes.position[0], [63.4170622, 10.4082151, 66.814])
        assert "heights are above mean sea level, as their column says" in fixes.notes
        assert np.isfinite(fixes.velocity).all()

    def test_the_imu_has_its_units_and_its_clock(self):
        recording = zr.read_recording(RECORDINGS / "drive_imu_100hz.parquet")
        assert (recording.gyro.unit, recording.accel.unit) == ("rad/s", "m/s^2")
        assert recording.gyro.data.shape == recording.accel.data.shape == (54_858, 3)
        size = np.linalg.norm(recording.accel.data, axis=1)
        # Raw: its accelerometer has a bias of some 0.2 m/s^2 along gravity.
        assert np.median(size) == pytest.approx(9.8, abs=0.3)
        stamps = column("drive_imu_100hz", "time_s")
        # Stamps are whole milliseconds, and the rate of the log has six digits over 549 s.
        assert np.abs(recording.gyro.time - stamps).max() < 1e-3 + 549 * 5e-6


def test_a_table_of_whole_seconds_is_no_solution(tmp_path):
    rows = (f"{t},47.9952,10.9987,498.8,-11.2,1.7,-0.2\n" for t in range(90, 120))
    path = tmp_path / "fixes.csv"
    path.write_text("time_s,lat,lon,alt,vn,ve,vd\n" + "".join(rows))
    fixes = zr.read_fixes(path)
    assert len(fixes) == 30
    assert fixes.velocity[0].tolist() == [-11.2, 1.7, -0.2]


def test_a_latitude_and_a_longitude_are_of_one_receiver():
    rows = {"time_s": [0.0, 1.0], "truth_latitude_deg": [45.0, 46.0]}
    with pytest.raises(LogError, match="no column is a latitude"):
        zr.read_fixes({**rows, "longitude_deg": [7.0, 8.0]})
    with pytest.raises(LogError, match="no longitude belongs to 'a_lat': there is b_lon"):
        zr.read_fixes({"time_s": [0.0, 1.0], "a_lat": [1.0, 2.0], "b_lon": [7.0, 8.0]})
    both = {"a_lat": [1.0, 2.0], "b_lat": [3.0, 4.0], "b_lon": [7.0, 8.0], **rows}
    assert zr.read_fixes(both).position[:, 0].tolist() == [3.0, 4.0]


def test_a_velocity_in_another_unit_is_left_out_with_a_note():
    rows = {"time_s": [0.0, 1.0], "lat": [45.0, 45.0], "lon": [7.0, 7.0], "alt": [0.0, 0.0]}
    fixes = zr.read_fixes({**rows, "velocity_north_kmh": [36.0, 36.0]})
    assert fixes.velocity is None
    assert "velocity_north_kmh: left out, for velocities are read in m/s" in fixes.notes


def test_a_date_that_leaps_by_years_is_refused(tmp_path):
    lines = [rmc(f"1200{i:02d}.00", 48.0, 11.0, date=d) for i, d in enumerate(["010524"] * 3)]
    later = [rmc(f"1200{i:02d}.00", 48.0, 11.0, date="150904") for i in (3, 4)]
    path = nmea(tmp_path / "leap.nmea", [*lines, *later])
    with pytest.raises(zr.LogError, match="date leaps from 2024-05-01 to 2004-09-15: cut the file"):
        zr.read_fixes(path)
