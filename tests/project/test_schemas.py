"""The JSON that reports, checks and batches write is what their published schemas say."""

import json

import jsonschema
import pytest

import zerorate as zr
from zerorate.noise.characterise import models_json
from zerorate.schemas import FORMATS, load_schema
from zerorate.tasks.assistant import describe_samples


def recording(kind, seconds=40.0):
    if kind == "drive":
        return zr.simulate_drive(50.0, seconds, seed=2).recording()
    return zr.simulate_motion(kind, duration=seconds, seed=2).recording()


def check(name, text):
    jsonschema.Draft202012Validator(load_schema(name)).validate(json.loads(text))


@pytest.mark.parametrize("name", FORMATS)
def test_a_schema_is_one(name):
    jsonschema.Draft202012Validator.check_schema(load_schema(name))


@pytest.mark.parametrize("kind", ["hand", "drive"])
def test_reports_and_checks(kind):
    source = recording(kind)
    check("report", zr.report(source).to_json())
    check("check", zr.check(source).to_json())


@pytest.mark.parametrize("command", ["replay", "allan", "report", "check"])
def test_the_records_of_a_batch(command, tmp_path):
    source = recording("hand")
    source["gyro"].to_pandas().merge(source["accel"].to_pandas()).to_parquet(tmp_path / "a.parquet")
    assert not zr.batch(tmp_path, tmp_path / "out", command=command, workers=1).failed
    written = sorted((tmp_path / "out").rglob("*.json"))
    records = [path for path in written if not path.stem.endswith(("-models", "-findings"))]
    assert records
    for path in {*written} - {*records}:
        if command == "check":
            check("check", path.read_text(encoding="utf-8"))
    for path in records:
        check("batch", path.read_text(encoding="utf-8"))


def test_noise_models():
    noise = zr.NoiseModel(angle_random_walk=0.01, rate_random_walk=3e-4)
    samples, _ = zr.simulate(noise, rate=100.0, duration=600.0, seed=1)
    for made in (zr.characterise(samples, rate=100.0), zr.characterise(recording("hand")["gyro"])):
        check("models", models_json(made.sensors))


def test_samples_of_attitudes_and_tracks():
    check("samples", describe_samples("attitude", zr.estimate_attitude(recording("hand"))))
    drive = zr.simulate_drive(50.0, 60.0, seed=2).recording()
    check("samples", describe_samples("navigate", zr.navigate(drive)))


def test_a_changed_report_does_not_pass():
    content = json.loads(zr.report(recording("hand")).to_json())
    for change in ({"version": 2}, {"findings": [{}]}, {"more": 1}):
        with pytest.raises(jsonschema.ValidationError):
            check("report", json.dumps({**content, **change}))


def test_an_unknown_format_is_refused():
    with pytest.raises(ValueError, match="must be one of report, check, batch, models, samples"):
        load_schema("track")
