"""Words in columns' names: the kind of a sensor, its axis, stage and device.

`ROLES` is the dictionary. Capitals, digits and separators split a name into words. Runs of small
letters are split by the dictionary: ``gyroscopeuncalibrated_z`` has three words.
"""

from __future__ import annotations

import re
import unicodedata
from functools import lru_cache
from typing import Final, NamedTuple

_WORDS_BY_ROLE: Final = {
    "gyro": "gyr gyro gyros gyroscope gyroscopes gyrometer gyroskop giroscopio omega drehrate"
    " winkelgeschwindigkeit angvel angrate",
    "accel": "acc acce accs accel accels accelero accelerometer accelerometers acceleration"
    " accelerations beschleunigung beschleunigungssensor acelerometro aceleracion accelerometre",
    "mag": "compass mag magn magnet magnetic magneto magnetometer magnetfeld"
    " magnetometre magnetometro",
    "angular": "ang angular angulaire",
    "turning": "rotation rotational rot turn turning",
    "rate": "rate rates vel velocity velocities speed speeds vitesse velocidad",
    "turn": "roll pitch yaw",
    "linear": "linear lin",
    "free": "free user gravity grav gravitational increment inc integral integrated angle angles"
    " euler quat quaternion orientation ori rotvec vector",
    "value": "measurement value values data reading axis sensor",
    "label": "type name",
    "no": "temp temperature bias biases cov covariance sigma std stddev status state valid validity"
    " flag flags dt delta clip clipping clipped count counts counter id ids norm magnitude abs"
    " absolute odr range accuracy timestamp timestamps time integral error errors err samples rms"
    " variance var offset offsets scale weight excluded rest stuck saturated setpoint target cmd"
    " command desired noise health healthy num index seq sequence limit max min threshold heading"
    " declination strength frame period interval sensitivity gain trim version gps baro"
    " pressure jerk moving",
    "unfiltered": "unfilt unfiltered",
    "filtered": "filt filtered smoothed smooth lpf lowpass motion",
    "calibrated": "cal calib calibrated corrected compensated comp",
    "uncalibrated": "uncal uncalib uncalibrated uncorrected uncomp uncompensated",
    "raw": "raw adc lsb digits",
}  # fmt: skip
STAGES: Final = ("unfiltered", "calibrated", "", "uncalibrated", "raw", "filtered")
"""Stages of processing, in order of preference; '' if no stage is stated.

Raw values come after calibrated values because they have no unit, and before filtered values.
"""
ROLES: Final = {word: role for role, words in _WORDS_BY_ROLE.items() for word in words.split()}
_DICTIONARY: Final = frozenset(word for word in ROLES if len(word) > 2) | {
    "axis",
    "sensor",
    "field",
}
_FOREIGN_WORDS: Final = {
    **dict.fromkeys(
        ("ω", "Ω", "陀螺仪", "陀螺", "角速度", "ジャイロ", "자이로", "각속도"), " gyro "
    ),
    **dict.fromkeys(("гироскоп", "Гироскоп", "γυροσκόπιο"), " gyro "),
    **dict.fromkeys(("加速度", "加速计", "가속도", "акселерометр", "Акселерометр"), " accel "),
    **dict.fromkeys(("磁力计", "磁場", "磁场", "магнитометр", "Магнитометр"), " mag "),
    "Gy": " gyro ",
    "Ac": " accel ",
}
"""Foreign words for sensors, and the MPU-6050 tutorials' prefixes of an axis: ``GyX``."""
_FOREIGN: Final = re.compile(
    rf"(?<![A-Za-z])(?:Gy|Ac)(?=[XYZ](?![A-Za-z]))"
    rf"|{'|'.join(word for word in _FOREIGN_WORDS if not word.isascii())}"
)
_WORD: Final = re.compile(r"[A-Z]+(?![a-z])|[A-Z]?[a-zµ°]+|\d+")
_AXIS_LETTERS: Final = {"x": 0, "y": 1, "z": 2}
_ROTATION_AXES: Final = {"roll": 0, "pitch": 1, "yaw": 2}
_SENSOR_LETTERS: Final = {"w": "gyro", "g": "gyro", "a": "accel"}
"""Letters that mean a sensor if an axis follows: ``wx``, ``g_y``, ``a_RS_S_z``."""
_NUMBERED_LETTERS: Final = ("w", "g", "a")
"""Letters that mean a sensor if a number follows: ``g1``; but ``m1`` is a motor."""


class ParsedName(NamedTuple):
    """Meaning of the words in a column's name, without its unit.

    Parameters
    ----------
    kind
        ``"gyro"``, ``"accel"`` or ``"mag"``; ``""`` for an axis without a sensor; None if the
        column is no component of a sensor.
    axis
        0, 1, 2 for x, y, z; None if no axis is named. ``number`` is the last number in the name.
    stage
        One of `STAGES`, or ``"linear"`` for accelerations that may be without gravity.
    device
        All other words: the device, the part of the body, the number of a sensor.
    stem
        All words except the axis.
    """

    kind: str | None
    axis: int | None
    number: int | None
    stage: str
    device: str
    stem: str


def words_of(name: str) -> tuple[str, ...]:
    """Return the words of a name in lower case."""
    known = _FOREIGN.sub(lambda found: _FOREIGN_WORDS[found[0]], name)
    plain = unicodedata.normalize("NFKD", known).encode("ascii", "ignore").decode()
    return tuple(part for word in _WORD.findall(plain) for part in _split_word(word.lower()))


def _split_word(word: str) -> tuple[str, ...]:
    """Return the dictionary words in a run of letters, or the run itself."""
    if word in ROLES or len(word) < 2 or not word.isalpha():
        return (word,)
    if len(word) == 2 and word[1] in _AXIS_LETTERS and word[0] in _SENSOR_LETTERS:
        return (word[0], word[1])
    if len(word) == 2 and word[1] in _AXIS_LETTERS and word[0] == "m":
        return ("mag", word[1])  # m_x is a value in metres
    return _split_compound(word) or (word,)


@lru_cache(maxsize=4096)
def _split_compound(word: str) -> tuple[str, ...] | None:
    if word[0] in _AXIS_LETTERS and word[1:] in _DICTIONARY:
        return (word[0], word[1:])
    for end in range(len(word), 2, -1):
        if word[:end] not in _DICTIONARY:
            continue
        rest = word[end:]
        if not rest or rest in _AXIS_LETTERS:
            return (word[:end], rest) if rest else (word[:end],)
        tail = _split_compound(rest) if len(rest) > 2 else None
        if tail is not None:
            return (word[:end], *tail)
    return None


@lru_cache(maxsize=4096)
def parse_name(stem: str) -> ParsedName:
    """Return the meaning of a name without its unit, from its words."""
    words = list(words_of(stem))
    axis, number, other_words = _find_axis(words)
    roles = {ROLES.get(word) for word in other_words}
    kind, kind_words = _find_kind(words, other_words, roles, axis, number)
    stages = [stage for stage in STAGES if stage in roles]
    stage = "linear" if kind == "accel" and "linear" in roles else next(iter(stages), "")
    device = [
        word for word in other_words if word not in kind_words and ROLES.get(word) not in STAGES
    ]
    return ParsedName(kind, axis, number, stage, "_".join(device), "_".join(other_words))


def _find_axis(words: list[str]) -> tuple[int | None, int | None, list[str]]:
    """Return the axis in words, the number at their end, and the other words."""
    for letters in (_AXIS_LETTERS, _ROTATION_AXES):
        positions = [i for i, word in enumerate(words) if word in letters]
        if len(positions) == 1 or (positions and letters is _AXIS_LETTERS):
            position = positions[-1]
            return letters[words[position]], None, words[:position] + words[position + 1 :]
    if len(words) > 1 and words[-1].isdigit():
        return None, int(words[-1]), words[:-1]
    return None, None, words


def _find_kind(
    words: list[str],
    other_words: list[str],
    roles: set[str | None],
    axis: int | None,
    number: int | None,
) -> tuple[str | None, set[str]]:
    """Return the kind of a sensor, and the words that show it."""
    if roles & {"no", "free"} or ("label" in roles and axis is None):
        return None, set()
    kinds = [kind for kind in ("gyro", "accel", "mag") if kind in roles]
    turns = roles & {"angular", "turning"} or any(word in _ROTATION_AXES for word in words)
    if turns and "rate" in roles and not kinds:
        kinds = ["gyro"]
    if not kinds and other_words in (["rate"], ["rates"]):
        kinds = ["gyro"]
    if not kinds and {"specific", "force"} <= set(other_words):
        return "accel", {"specific", "force"}
    if not kinds and number is not None and other_words and other_words[-1] in _NUMBERED_LETTERS:
        return _SENSOR_LETTERS[other_words[-1]], {other_words[-1]}
    if not kinds and axis is not None and other_words:
        return _find_letter_kind(words, other_words)
    if not kinds and axis is not None and not any(word in _ROTATION_AXES for word in words):
        return "", set()
    if len(kinds) != 1 or (kinds == ["accel"] and "angular" in roles):
        return None, set()
    kind_roles = {"gyro", "accel", "mag", "angular", "turning", "rate", "turn", "linear"}
    kind_words = {w for w in other_words if ROLES.get(w) in kind_roles} | {
        "axis",
        "field",
        "sensor",
    }
    return kinds[0], kind_words


def _find_letter_kind(words: list[str], rest: list[str]) -> tuple[str | None, set[str]]:
    """Return the kind by the letter before an axis; frames may be between letter and axis."""
    if len(words) > 1 and words[-1].isdigit():
        words = words[:-1]  # without the sensor's number after the axis: gx1
    before = words[
        : max(i for i, word in enumerate(words) if word in {**_AXIS_LETTERS, **_ROTATION_AXES})
    ]
    frames = {"rs", "s", "m", "b", "i", "imu"}
    while len(before) > 1 and before[-1] in frames and before[-2] in {*_SENSOR_LETTERS, "rs", "s"}:
        before = before[:-1]
    if before and before[-1] in _SENSOR_LETTERS and words[-1] in _AXIS_LETTERS:
        return _SENSOR_LETTERS[before[-1]], {before[-1], *frames} - {"imu"}
    if rest and rest[-1] == "rate" and words[-1] in _AXIS_LETTERS and len(rest) == 1:
        return "gyro", {"rate"}
    is_plain = all(ROLES.get(word) == "value" for word in rest)
    return ("", set()) if is_plain else (None, set())
