"""Names of columns taken apart into words: the kind of a sensor, its axis, stage and device.

`ROLES` is the dictionary. A word is what capitals, digits and separators set apart, and what the
dictionary finds in a run of small letters: ``gyroscopeuncalibrated_z`` has three words.
"""

from __future__ import annotations

import re
import unicodedata
from functools import lru_cache
from typing import Final, NamedTuple

_OF: Final = {
    "gyro": "gyr gyro gyros gyroscope gyroscopes gyrometer gyroskop giroscopio omega drehrate"
    " winkelgeschwindigkeit angvel angrate",
    "accel": "acc accs accel accels accelero accelerometer accelerometers acceleration"
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
"""What was done to values, the best first where a file has several: '' where nothing is said.

Raw values stand behind calibrated ones, which have a unit, and before filtered ones.
"""
ROLES: Final = {word: role for role, words in _OF.items() for word in words.split()}
_PARTS: Final = frozenset(word for word in ROLES if len(word) > 2) | {"axis", "sensor", "field"}
_WORD: Final = re.compile(r"[A-Z]+(?![a-z])|[A-Z]?[a-zµ°]+|\d+")
_LETTERS: Final = {"x": 0, "y": 1, "z": 2}
_TURNS: Final = {"roll": 0, "pitch": 1, "yaw": 2}
_SHORT: Final = {"w": "gyro", "g": "gyro", "a": "accel"}
"""Letters that are a sensor's before that of an axis: ``wx``, ``g_y``, ``a_RS_S_z``."""
_COUNTED: Final = ("w", "g", "a")
"""Those that are one before a number, too: ``g1``; ``m1`` is a motor."""


class Parsed(NamedTuple):
    """What the words of a column's name say, without its unit.

    Parameters
    ----------
    kind
        ``"gyro"``, ``"accel"``, ``"mag"``, ``""`` for an axis of a sensor that is not named, None
        for what is no component of a sensor.
    axis
        0, 1, 2 for x, y, z, and None where none is told; ``counted`` the last number.
    stage
        One of `STAGES`, or ``"linear"`` for accelerations that may be without gravity.
    device
        The words that are left: the device, the part of the body, the number of a sensor.
    stem
        All words but the axis.
    """

    kind: str | None
    axis: int | None
    counted: int | None
    stage: str
    device: str
    stem: str


def words_of(name: str) -> tuple[str, ...]:
    """Return the words of a name in small letters."""
    plain = unicodedata.normalize("NFKD", name).encode("ascii", "ignore").decode()
    return tuple(part for word in _WORD.findall(plain) for part in _parts(word.lower()))


def _parts(word: str) -> tuple[str, ...]:
    """Return the words of the dictionary that a run of letters is made of, or the run itself."""
    if word in ROLES or len(word) < 2 or not word.isalpha():
        return (word,)
    if len(word) == 2 and word[1] in _LETTERS and word[0] in _SHORT:
        return (word[0], word[1])
    if len(word) == 2 and word[1] in _LETTERS and word[0] == "m":
        return ("mag", word[1])  # where m_x is something in metres
    return _taken_apart(word) or (word,)


@lru_cache(maxsize=4096)
def _taken_apart(word: str) -> tuple[str, ...] | None:
    if word[0] in _LETTERS and word[1:] in _PARTS:
        return (word[0], word[1:])
    for end in range(len(word), 2, -1):
        if word[:end] not in _PARTS:
            continue
        rest = word[end:]
        if not rest or rest in _LETTERS:
            return (word[:end], rest) if rest else (word[:end],)
        others = _taken_apart(rest) if len(rest) > 2 else None
        if others is not None:
            return (word[:end], *others)
    return None


@lru_cache(maxsize=4096)
def parsed_name(stem: str) -> Parsed:
    """Return what the words of a name without its unit say."""
    words = list(words_of(stem))
    axis, counted, rest = _axis(words)
    roles = {ROLES.get(word) for word in rest}
    kind, used = _kind(words, rest, roles, axis, counted)
    stages = [stage for stage in STAGES if stage in roles]
    stage = "linear" if kind == "accel" and "linear" in roles else next(iter(stages), "")
    device = [word for word in rest if word not in used and ROLES.get(word) not in STAGES]
    return Parsed(kind, axis, counted, stage, "_".join(device), "_".join(rest))


def _axis(words: list[str]) -> tuple[int | None, int | None, list[str]]:
    """Return the axis that words tell, a number at their end, and the other words."""
    for letters in (_LETTERS, _TURNS):
        places = [i for i, word in enumerate(words) if word in letters]
        if len(places) == 1 or (places and letters is _LETTERS):
            at = places[-1]
            return letters[words[at]], None, words[:at] + words[at + 1 :]
    if len(words) > 1 and words[-1].isdigit():
        return None, int(words[-1]), words[:-1]
    return None, None, words


def _kind(
    words: list[str],
    rest: list[str],
    roles: set[str | None],
    axis: int | None,
    counted: int | None,
) -> tuple[str | None, set[str]]:
    """Return the kind of a sensor and the words that tell it."""
    if roles & {"no", "free"} or ("label" in roles and axis is None):
        return None, set()
    kinds = [kind for kind in ("gyro", "accel", "mag") if kind in roles]
    turns = roles & {"angular", "turning"} or any(word in _TURNS for word in words)
    if turns and "rate" in roles and not kinds:
        kinds = ["gyro"]
    if not kinds and rest in (["rate"], ["rates"]):
        kinds = ["gyro"]
    if not kinds and {"specific", "force"} <= set(rest):
        return "accel", {"specific", "force"}
    if not kinds and counted is not None and rest and rest[-1] in _COUNTED:
        return _SHORT[rest[-1]], {rest[-1]}
    if not kinds and axis is not None and rest:
        return _short(words, rest)
    if not kinds and axis is not None and not any(word in _TURNS for word in words):
        return "", set()
    if len(kinds) != 1 or (kinds == ["accel"] and "angular" in roles):
        return None, set()
    told = {"gyro", "accel", "mag", "angular", "turning", "rate", "turn", "linear"}
    telling = {w for w in rest if ROLES.get(w) in told} | {"axis", "field", "sensor"}
    return kinds[0], telling


def _short(words: list[str], rest: list[str]) -> tuple[str | None, set[str]]:
    """Return the kind that a letter before an axis tells, maybe with frames between them."""
    before = words[: max(i for i, word in enumerate(words) if word in {**_LETTERS, **_TURNS})]
    frames = {"rs", "s", "m", "b", "i", "imu"}
    while len(before) > 1 and before[-1] in frames and before[-2] in {*_SHORT, "rs", "s"}:
        before = before[:-1]
    if before and before[-1] in _SHORT and words[-1] in _LETTERS:
        return _SHORT[before[-1]], {before[-1], *frames} - {"imu"}
    if rest and rest[-1] == "rate" and words[-1] in _LETTERS and len(rest) == 1:
        return "gyro", {"rate"}
    bare = all(ROLES.get(word) == "value" for word in rest)
    return ("", set()) if bare else (None, set())
