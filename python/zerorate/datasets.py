"""Public recordings by name, downloaded once, for the tutorials.

Each recording is pinned to a commit of its repository. A file with another SHA-256 is rejected. If
the package has no checksum, the first download saves its checksum next to the file.
"""

from __future__ import annotations

import sys
from dataclasses import dataclass
from difflib import get_close_matches
from importlib.util import find_spec
from pathlib import Path
from typing import Final
from urllib.parse import quote

from zerorate.faults import ArgumentError
from zerorate.texts import describe_missing_extra

__all__ = ["DATASETS", "Dataset", "fetch"]

_HOST_URL: Final = "https://raw.githubusercontent.com"


@dataclass(frozen=True)
class Dataset:
    """A public recording.

    Attributes
    ----------
    name : str
        Name to pass to `fetch`.
    about : str
        What was recorded, and with which device.
    licence : str
        Licence of the recording.
    repository, commit, path : str
        Owner and name of the GitHub repository, its commit, and the path of the file in it.
    sha256 : str, optional
        SHA-256 of the file; None if it is not known.

    Examples
    --------
    >>> import zerorate as zr
    >>> one = zr.datasets.DATASETS["broad/05"]
    >>> one.licence, one.url.startswith("https://")
    ('CC BY 4.0', True)
    """

    name: str
    about: str
    licence: str
    repository: str
    commit: str
    path: str
    sha256: str | None = None

    @property
    def url(self) -> str:
        """Address of the download."""
        return f"{_HOST_URL}/{self.repository}/{self.commit}/{quote(self.path)}"


def _broad(number: int, title: str) -> Dataset:
    return Dataset(
        f"broad/{number:02}",
        f"BROAD, {title.replace('_', ' ')}: nine axes of a myon aktos-t at 285.7 Hz in a hand, "
        "orientation by motion capture",
        "CC BY 4.0",
        "dlaidig/broad",
        "afbaa4d75c4cd7c8ca76b8145b1812312d87fb7f",
        f"data_mat/{number:02}_{title}.mat",
    )


_BROAD: Final = {
    1: "undisturbed_slow_rotation_A",
    2: "undisturbed_slow_rotation_B",
    3: "undisturbed_slow_rotation_C",
    4: "undisturbed_slow_rotation_with_breaks_A",
    5: "undisturbed_slow_rotation_with_breaks_B",
    6: "undisturbed_fast_rotation_A",
    7: "undisturbed_fast_rotation_B",
    8: "undisturbed_fast_rotation_with_breaks_A",
    9: "undisturbed_fast_rotation_with_breaks_B",
    10: "undisturbed_slow_translation_A",
    11: "undisturbed_slow_translation_B",
    12: "undisturbed_slow_translation_C",
    14: "undisturbed_slow_translation_with_breaks_B",
    15: "undisturbed_fast_translation_A",
    16: "undisturbed_fast_translation_B",
    18: "undisturbed_fast_translation_with_breaks_B",
    21: "undisturbed_fast_combined",
    24: "disturbed_tapping_A",
    25: "disturbed_tapping_B",
    26: "disturbed_phone_vibration_A",
    27: "disturbed_phone_vibration_B",
    28: "disturbed_stationary_magnet_A",
    29: "disturbed_stationary_magnet_B",
    30: "disturbed_stationary_magnet_C",
    31: "disturbed_stationary_magnet_D",
    32: "disturbed_attached_magnet_1cm",
    33: "disturbed_attached_magnet_2cm",
    34: "disturbed_attached_magnet_3cm",
    35: "disturbed_attached_magnet_4cm",
    36: "disturbed_attached_magnet_5cm",
}

_OTHER_DATASETS: Final = (
    Dataset(
        "px4/sample",
        "six seconds of a PX4 autopilot's log with three IMUs and a receiver",
        "BSD-3-Clause",
        "PX4/pyulog",
        "3cf17793f14709713ab297d3743314c658874068",
        "test/sample_log_small.ulg",
        "68d1020f688109f027dba08d2950247cc0ae34aaefdcf37e4a7d60838f3e1aa3",
    ),
    Dataset(
        "px4/motor-failure",
        "a flight of a PX4 autopilot in which a motor failed",
        "MIT",
        "PX4/flight-review-rs",
        "0b1d5ee209e3b4ccfb30d91b675a9f7e8c484ad8",
        "crates/converter/tests/fixtures/motor_failure.ulg",
        "471f4af4b57a94adbeb7006f1994cbc4742f0510a5ae8bc562b41c125282e860",
    ),
    Dataset(
        "gopro/karma",
        "a GoPro's video with its telemetry: twelve seconds of gyro at 398 Hz and accelerometer",
        "Apache-2.0 or MIT",
        "gopro/gpmf-parser",
        "2f54a2c11039d1fe4f7514e0f9288beb61ba3e06",
        "samples/karma.mp4",
        "35c2c80530e0d6c5eed8dafd71852dac621db547bef6bf5ad375b91bd0e38347",
    ),
    Dataset(
        "xsens/sit-to-stand",
        "an export of Xsens MT Manager at 100 Hz: a person stands up",
        "Apache-2.0",
        "opensim-org/opensim-core",
        "095277807870a7c95dd7fb5e47449ed60afa50dd",
        "OpenSim/Tests/shared/IMUData/Xsens/MT_012005D6-000_sit_to_stand-000_00B421ED.txt",
        "5ff9bbbbdc928f061a46781cb2613769f9655a4093b5392e2ee998db23710a13",
    ),
)

DATASETS: Final = {
    one.name: one for one in (*(_broad(*item) for item in _BROAD.items()), *_OTHER_DATASETS)
}
"""Public recordings by name, as `Dataset` objects."""


def fetch(name: str, folder: str | Path | None = None) -> Path:
    """Return the path of a public recording; download the file first if it is missing.

    Before a download, its description, licence and address are written to stderr.

    Parameters
    ----------
    name : str
        Key of `DATASETS`, such as ``"broad/05"``.
    folder : path, optional
        Folder for the files. Default: the user's cache.

    Returns
    -------
    pathlib.Path
        Path for `zerorate.read_recording` or `zerorate.read_log`.

    Raises
    ------
    ValueError
        If the name is unknown, or the checksum of the file is wrong. Also if the file exists but
        was not downloaded by zerorate.
    ImportError
        If pooch (extra ``data``) is not installed.
    OSError
        If the download fails.

    Examples
    --------
    >>> import zerorate as zr
    >>> path = zr.datasets.fetch("broad/05")  # doctest: +SKIP
    >>> recording = zr.read_recording(path)  # doctest: +SKIP
    """
    if name not in DATASETS:
        matches = get_close_matches(name, DATASETS, 3) or sorted(DATASETS)[-4:]
        raise ArgumentError(
            "name", f"is no public recording: '{name}'; such as {', '.join(matches)}"
        )
    if find_spec("pooch") is None:
        raise ImportError(describe_missing_extra("pooch", "data", "a public recording"))
    import pooch

    dataset = DATASETS[name]
    directory = Path(pooch.os_cache("zerorate") if folder is None else folder).expanduser()
    file = name.replace("/", "-") + Path(dataset.path).suffix
    path = directory / file
    if path.exists():
        expected: str | None = dataset.sha256 or _read_checksum(path)
    else:
        expected = dataset.sha256
        checksum_note = "" if expected else "; pinned by its commit, no checksum is known"
        print(
            f"{name}: {dataset.about}. {dataset.licence}, {dataset.url}{checksum_note}",
            file=sys.stderr,
        )
    pooch.retrieve(dataset.url, expected, file, directory, progressbar=False)
    if expected is None:
        _checksum_path(path).write_text(pooch.file_hash(str(path)) + "\n", encoding="ascii")
    return path


def _checksum_path(path: Path) -> Path:
    return path.with_name(f"{path.name}.sha256")


def _read_checksum(path: Path) -> str:
    """Return the SHA-256 saved by the first download; ValueError if there is none."""
    try:
        return _checksum_path(path).read_text(encoding="ascii").strip()
    except OSError:
        raise ValueError(
            f"{path} was not downloaded by zerorate, or its checksum {_checksum_path(path).name} "
            "is missing: delete the file to download it again"
        ) from None


def __dir__() -> list[str]:
    """Return the public names."""
    return __all__
