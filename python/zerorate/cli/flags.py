"""The options of every command, so that a wrong one is refused before anything is imported."""

from collections.abc import Mapping, Sequence
from typing import Final

FLAGS: Final[Mapping[str, tuple[str, str]]] = {
    "demo": (
        "--device --duration --rate --seed -o --output",
        "--force",
    ),
    "report": (
        "--gnss --columns --unit --rate --time --time-unit --scale --device --range "
        "--sensor --start --stop --topic --group-by -o --output",
        "--force",
    ),
    "replay": (
        "--columns --unit --rate --time --time-unit --scale --device --range --sensor "
        "--start --stop --topic --group-by -o --output --format --figure-format "
        "--figure --methods --calibration --rotations --weights --array-method "
        "--scale-error --method --output-kind --motion --limit --rest-limit "
        "--bias-limit --order --process-noise --fading --process-noise-memory --noise "
        "--outliers --adapt-for --forgetting-factor --zones --damping --correction "
        "--startup --noise-scale",
        "--no-figure --force --fix --no-accel --array",
    ),
    "allan": (
        "--columns --unit --rate --time --time-unit --scale --device --range --sensor "
        "--start --stop --topic --group-by --deviation --kind --taus --bridge "
        "--confidence --markov --export --inflate -o --output --format --figure-format",
        "--second-opinion --no-second-opinion --fix --per-sample --no-figure --force",
    ),
    "stream": (
        "--columns --unit --rate --time --time-unit --scale --device --range --sequence "
        "--sequence-bits --fields --method --output-kind --motion --limit --rest-limit "
        "--bias-limit --order --process-noise --fading --process-noise-memory --noise --outliers "
        "--adapt-for --forgetting-factor --zones --damping --correction --startup "
        "--noise-scale --accel-columns --with --frame --udp --from --form "
        "--checkpoint --every --serve",
        "--no-accel --attitude --no-mag --learn-magnetometer --position --force --show",
    ),
    "batch": (
        "-o --output --command --workers --local-cluster --scheduler --columns --unit "
        "--rate --time --time-unit --scale --device --range --sensor --start --stop "
        "--topic --method --output-kind --motion --limit --rest-limit --bias-limit "
        "--order --process-noise --fading --process-noise-memory --noise --outliers "
        "--adapt-for --forgetting-factor --zones --damping --correction --startup "
        "--noise-scale --format --calibration",
        "--report --no-accel --force",
    ),
    "compare": (
        "--reference --quaternion --seeds --methods --contaminate --attitude --frame "
        "--columns --unit --rate --time --time-unit --scale --device --range --sensor "
        "--start --stop --topic --group-by -o --output --figure-format --json",
        "--simulated --fix --per-axis --no-figure --force",
    ),
    "identify": (
        "--columns --unit --rate --time --time-unit --scale --device --range --sensor "
        "--start --stop --topic --group-by -o --output --figure --order --criterion "
        "--max-order --estimator --segments --outliers --smooth --decimate --trend",
        "--fix --no-figure --force",
    ),
    "calibrate": (
        "--columns --accel-columns --mag-columns --unit --rate --time --time-unit "
        "--scale --device --range --sensor --start --stop --topic --group-by -o "
        "--output --gravity --frame --g-sensitivity --prior --saturation --field --dip "
        "--at --gyro --accel --compare --export --apply --format --figure-format "
        "--figure",
        "--magnetometer --one-iron --temperature --fix --no-figure --force",
    ),
    "attitude": (
        "--columns --accel-columns --mag-columns --unit --rate --time --time-unit "
        "--scale --device --range --sensor --start --stop --topic --group-by --frame "
        "--method --declination --at --bias-limit --time-constant --kp --ki --beta "
        "--gyro-noise --accel-noise --mag-noise --bias-walk --gyro --accel "
        "--calibration --magnetometer --reference --reference-heading "
        "--reference-offset --reference-frame --clipped -o --output --format "
        "--figure-format",
        "--offline --no-mag --learn-magnetometer --fix --no-figure --force --tum",
    ),
    "navigate": (
        "--columns --accel-columns --mag-columns --unit --rate --time --time-unit "
        "--scale --device --range --sensor --start --stop --topic --outages --heading "
        "--rest --gyro-noise --accel-noise --gate --adapt --covariance-step --kind "
        "--antenna-sigma --wheel-sigma --speed-sigma --vehicle --axle --wheel-speed "
        "--wheel-ticks --tick --antenna --mount --time-offset --reference "
        "--reference-offset --calibration --clipped -o --output --format "
        "--figure-format --figure",
        "--smooth --tum --fix --no-figure --force",
    ),
    "walk": (
        "--columns --accel-columns --mag-columns --unit --rate --time --time-unit "
        "--scale --device --range --sensor --start --stop --topic --floor --at "
        "--heading --height --calibration --clipped -o --output --format "
        "--figure-format",
        "--smooth --fix --no-figure --force",
    ),
    "formats": (
        "",
        "",
    ),
    "simulate": (
        "-o --output --duration --rate --seed --axes --poses --temperature",
        "--list --force",
    ),
}
"""Options with a value, and those without one; a test holds them to what the commands take."""


def wrong_option(command: str, words: Sequence[str]) -> str | None:
    """Return the first of the words after a command that is an option it has not."""
    valued, plain = (known.split() for known in FLAGS[command])
    takes_next = False
    for word in words:
        if takes_next:
            takes_next = False
            continue
        if word == "--":
            return None
        name = word.partition("=")[0]
        if word.startswith("--") and name not in (*valued, *plain):
            return name
        takes_next = word in valued
    return None
