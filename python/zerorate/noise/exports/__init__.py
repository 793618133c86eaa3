"""Noise models as the configuration files of estimators, one file a format."""

from zerorate.noise.exports.json_text import from_json, to_json
from zerorate.noise.exports.kalibr import to_kalibr
from zerorate.noise.exports.orbslam3 import to_orbslam3
from zerorate.noise.exports.px4 import to_px4
from zerorate.noise.exports.vins import to_vins

__all__ = ["from_json", "to_json", "to_kalibr", "to_orbslam3", "to_px4", "to_vins"]
