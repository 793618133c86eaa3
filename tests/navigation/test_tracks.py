"""Tracks as GeoJSON and GPX: read back, across the date line, with gaps and without a date."""

import json
import re
import subprocess
import sys
import types
import xml.etree.ElementTree as ET

import numpy as np
import pytest

import zerorate as zr

N = 7
TIME = np.arange(N) * 0.25
PLACE = np.column_stack(
    [np.linspace(-33.9, -33.8, N), np.linspace(151.2, 151.3, N), np.linspace(-5.0, 80.0, N)]
)
GPX = "{http://www.topografix.com/GPX/1/1}"


def track(position=PLACE, **more):
    return types.SimpleNamespace(time=TIME[: len(position)], position=np.array(position), **more)


def feature(path):
    whole = json.loads(path.read_text())
    assert whole["type"] == "FeatureCollection"
    (only,) = whole["features"]
    assert only["type"] == "Feature"
    return only


def points(path):
    segments = ET.parse(path).getroot().findall(f"{GPX}trk/{GPX}trkseg")
    return [segment.findall(f"{GPX}trkpt") for segment in segments]


class TestGeoJson:
    def write(self, tmp_path, *args, **more):
        zr.navigation.write_geojson(tmp_path / "a.geojson", *args, **more)
        return feature(tmp_path / "a.geojson")

    def test_read_back(self, tmp_path):
        got = self.write(tmp_path, track())
        assert got["geometry"]["type"] == "LineString"
        np.testing.assert_array_equal(got["geometry"]["coordinates"], PLACE[:, [1, 0, 2]])
        assert got["properties"] == {"name": "track"}

    def test_times_where_the_epoch_is_known(self, tmp_path):
        fixes = zr.Fixes(TIME, PLACE, epoch=1_714_521_600.0, source="a <b>")
        properties = self.write(tmp_path, fixes)["properties"]
        assert properties["name"] == "a <b>"
        assert properties["coordTimes"][1] == "2024-05-01T00:00:00.250Z"
        assert len(properties["coordTimes"]) == N

    @pytest.mark.parametrize("sign", [1.0, -1.0])
    def test_the_date_line(self, tmp_path, sign):
        place = [[10.0, sign * 179.0, 0.0], [10.0, sign * 179.8, 4.0], [11.0, -sign * 179.2, 14.0]]
        got = self.write(tmp_path, track(place), epoch=0.0)
        assert got["geometry"]["type"] == "MultiLineString"
        first, second = got["geometry"]["coordinates"]
        assert [len(first), len(second)] == [3, 2]
        np.testing.assert_allclose(first[-1], [sign * 180.0, 10.2, 6.0], rtol=1e-12)
        np.testing.assert_allclose(second[0], [-sign * 180.0, 10.2, 6.0], rtol=1e-12)
        times = got["properties"]["coordTimes"]
        assert [len(part) for part in times] == [3, 2]
        assert times[0][-1] == times[1][0] == "1970-01-01T00:00:00.300Z"

    def test_on_the_date_line(self, tmp_path):
        place = [[1.0, 180.0, 0.0], [2.0, -180.0, 0.0], [3.0, -179.9, 0.0]]
        for part in self.write(tmp_path, track(place))["geometry"]["coordinates"]:
            assert len(part) >= 2
            assert np.ptp(np.array(part)[:, 0]) < 1.0

    def test_longitudes_beyond_a_turn(self, tmp_path):
        place = PLACE + np.array([0.0, 360.0, 0.0])
        got = self.write(tmp_path, track(place))["geometry"]["coordinates"]
        np.testing.assert_allclose(np.array(got)[:, 0], PLACE[:, 1], atol=1e-12)

    def test_gaps_and_missing_heights(self, tmp_path):
        place = PLACE.copy()
        place[2, 0] = np.nan
        place[4, 2] = np.nan
        place[5, 1] = np.nan
        got = self.write(tmp_path, track(place))["geometry"]["coordinates"]
        # The last one stands alone, and a line needs two positions.
        assert [len(part) for part in got] == [2, 2, 2]
        assert [len(one) for one in got[1]] == [3, 2]
        assert got[2][0] == got[2][1]

    def test_one_position(self, tmp_path):
        got = self.write(tmp_path, track(PLACE[:1]))["geometry"]
        assert got == {"type": "LineString", "coordinates": [PLACE[0, [1, 0, 2]].tolist()] * 2}


class TestGpx:
    def write(self, tmp_path, *args, **more):
        zr.navigation.write_gpx(tmp_path / "a.gpx", *args, **more)
        return points(tmp_path / "a.gpx")

    def test_read_back(self, tmp_path):
        (segment,) = self.write(tmp_path, track())
        got = [[float(p.get("lat")), float(p.get("lon")), float(p[0].text)] for p in segment]
        np.testing.assert_array_equal(got, PLACE)
        assert all(len(point) == 1 for point in segment)
        root = ET.parse(tmp_path / "a.gpx").getroot()
        assert (root.tag, root.get("version")) == (f"{GPX}gpx", "1.1")

    def test_times_where_the_epoch_is_known(self, tmp_path):
        (segment,) = self.write(tmp_path, track(), epoch=1_714_521_599.9996)
        assert segment[0].find(f"{GPX}time").text == "2024-05-01T00:00:00.000Z"
        fixes = zr.Fixes(TIME, PLACE, epoch=-18.0)
        zr.navigation.write_gpx(tmp_path / "b.gpx", fixes)
        (segment,) = points(tmp_path / "b.gpx")
        assert segment[0].find(f"{GPX}time").text == "1969-12-31T23:59:42.000Z"

    def test_gaps_are_segments(self, tmp_path):
        place = PLACE.copy()
        place[3] = np.nan
        place[5, 2] = np.nan
        first, second = self.write(tmp_path, track(place))
        assert (len(first), len(second)) == (3, 3)
        assert len(second[1]) == 0

    def test_names_and_the_last_meridian(self, tmp_path):
        place = [[0.0, 180.0, 1.0]]
        ((point,),) = self.write(tmp_path, track(place), name="a & <b>\x07")
        assert float(point.get("lon")) == -180.0
        assert ET.parse(tmp_path / "a.gpx").find(f"{GPX}trk/{GPX}name").text == "a & <b>\\x07"


@pytest.mark.parametrize("write", [zr.navigation.write_geojson, zr.navigation.write_gpx])
@pytest.mark.parametrize("epoch", [None, 1e9])
def test_the_same_in_pieces_and_without_pyarrow(tmp_path, monkeypatch, write, epoch):
    place = PLACE.copy()
    place[4, 2] = np.nan
    place[6, 1] -= 330.0
    write(tmp_path / "whole", track(place), epoch=epoch)
    monkeypatch.setattr("zerorate.navigation.tracks._PIECE_ROWS", 2)
    write(tmp_path / "pieces", track(place), epoch=epoch)
    monkeypatch.setitem(sys.modules, "pyarrow", None)
    write(tmp_path / "without", track(place), epoch=epoch)
    whole, *others = ((tmp_path / name).read_text() for name in ("whole", "pieces", "without"))
    for text in others:
        # A whole number may end in ".0".
        assert re.sub(r"\.0\b", "", text) == re.sub(r"\.0\b", "", whole)


def test_pandas_is_not_imported(tmp_path):
    """It takes longer than all that is written."""
    code = """
import sys, zerorate as zr
fixes = zr.Fixes([0.0], [[45.0, 7.0, 10.0]], epoch=1.7e9)
zr.navigation.write_geojson(sys.argv[1] + "/a", fixes)
zr.navigation.write_gpx(sys.argv[1] + "/b", fixes)
assert "pyarrow" in sys.modules and "pandas" not in sys.modules
"""
    subprocess.run([sys.executable, "-c", code, str(tmp_path)], check=True)


@pytest.mark.parametrize("write", [zr.navigation.write_geojson, zr.navigation.write_gpx])
class TestRefusals:
    def test_tracks_that_are_none(self, tmp_path, write):
        path = tmp_path / "a"
        with pytest.raises(TypeError, match="must have time and position, int has not"):
            write(path, 3)
        with pytest.raises(ValueError, match=r"got \(7,\) and \(6, 3\)"):
            write(path, types.SimpleNamespace(time=TIME, position=PLACE[1:]))
        with pytest.raises(ValueError, match="no row of the track"):
            write(path, track(np.full((3, 3), np.nan)))
        with pytest.raises(ValueError, match="latitudes must be within 90 deg"):
            write(path, track(PLACE * 1e7))
        with pytest.raises(ValueError, match="times must be finite"):
            write(path, track(), epoch=np.inf)
        assert list(tmp_path.iterdir()) == []

    def test_existing_files_stay(self, tmp_path, write):
        path = tmp_path / "a"
        path.write_text("mine")
        with pytest.raises(FileExistsError):
            write(path, track())
        assert path.read_text() == "mine"
        write(path, track(), force=True)
        assert path.read_text() != "mine"
