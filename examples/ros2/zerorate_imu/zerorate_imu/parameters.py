"""Parameters of the node: its own, and the drift filter's, from the table of its options."""

from collections.abc import Iterator, Mapping
from dataclasses import dataclass

from zerorate.options import FILTER_OPTIONS, add_rest_limits

UNIT = "rad/s"
"""Unit of the rate in sensor_msgs/Imu."""


@dataclass(frozen=True)
class Parameter:
    """A parameter in ROS; its type is fixed, so zero or "" means that it is not set."""

    name: str
    default: bool | float | str
    meaning: str


OWN = (
    Parameter("rate", 0.0, "Samples per second; 0: from the stamps of the first messages"),
    Parameter("attitude", True, "Publish the orientation too, from gyro and accelerometer"),
    Parameter(
        "state_file", "", "Keeps what is known of the noise from run to run; empty: nothing is kept"
    ),
    Parameter("diagnostics_period", 1.0, "Seconds between diagnostics"),
)


def _of_filter() -> Iterator[Parameter]:
    limits = add_rest_limits({}, ["auto"], UNIT)
    for option in FILTER_OPTIONS.values():
        # The node runs the self-tuning method, and publishes compensated rates.
        if "auto" not in option.methods or option.name in ("method", "output"):
            continue
        words = option.meaning
        if option.kind == "choice":
            yield Parameter(option.name, str(option.default or ""), words)
            continue
        unit = option.unit.replace("unit of the samples", UNIT)
        none = "" if option.default is not None else "; 0: none"
        value = float(limits.get(option.name, option.default or 0.0))
        yield Parameter(option.name, value, f"{words} ({unit}{none})")


FILTER = tuple(_of_filter())
PARAMETERS = (*OWN, *FILTER)


def filter_options(values: Mapping[str, bool | float | str]) -> dict[str, float | str]:
    """Return the drift filter's options that are set; raises `ValueError` for non-numbers."""
    given = {parameter.name: values[parameter.name] for parameter in FILTER}
    return {name: value for name, value in given.items() if value not in (0.0, "")}


def as_yaml() -> str:
    """Return ``config/params.yaml``: all parameters with their defaults."""
    lines = [
        "# All parameters with their defaults, written by",
        "# python -m zerorate_imu.parameters > config/params.yaml",
        "zerorate_imu:",
        "  ros__parameters:",
    ]
    for parameter in PARAMETERS:
        lines += [
            f"    # {parameter.meaning}.",
            f"    {parameter.name}: {_value(parameter.default)}",
        ]
    return "\n".join(lines) + "\n"


def _value(value: bool | float | str) -> str:
    if isinstance(value, bool):
        return str(value).lower()
    # ROS distinguishes a float from an integer by its decimal point.
    return f'"{value}"' if isinstance(value, str) else repr(round(value, 6))


if __name__ == "__main__":
    print(as_yaml(), end="")
