"""``zerorate stream``: lines of samples in, a line of answers out for each, at once."""

import math
from pathlib import Path
from typing import Annotated

import typer

from zerorate.cli.checkpoints import position_of, resumed
from zerorate.cli.effects import note_on_options
from zerorate.cli.faults import UsageFault, as_usage
from zerorate.cli.options import (
    Method,
    Motion,
    Noise,
    OutputKind,
    parse_adapt_for,
    parse_columns,
    parse_order,
)
from zerorate.cli.serving import report, run, tell
from zerorate.io import check_writable
from zerorate.run.live import Beside, Settings
from zerorate.run.live.saver import Saver
from zerorate.run.live.serving import Server

__all__ = ["stream"]


def stream(
    context: typer.Context,
    source: Annotated[
        Path | None,
        typer.Argument(help="Device, FIFO or file; stdin without it.", show_default=False),
    ] = None,
    rate: Annotated[float | None, typer.Option(help="Samples per second, Hz; required.")] = None,
    columns: Annotated[
        str | None, typer.Option(help="Channels: names or positions from 0, commas between.")
    ] = None,
    sequence: Annotated[
        str | None,
        typer.Option(
            metavar="COLUMN",
            help="Sequence number, by name or position: what the source lost is taken as missing "
            "and counted. Without it a lost sample cannot be seen.",
        ),
    ] = None,
    fields: Annotated[
        int | None,
        typer.Option(min=1, help="Numbers in a line, if the first may not be whole."),
    ] = None,
    method: Annotated[Method, typer.Option(help="Method of the filter.")] = Method.auto,
    motion: Annotated[
        Motion | None,
        typer.Option(metavar="<kind>", help="'hold' the drift in motion, or 'ignore' motion."),
    ] = None,
    output_kind: Annotated[
        OutputKind, typer.Option(help="What is answered.")
    ] = OutputKind.compensated,
    order: Annotated[str, typer.Option(help="Orders p,q of a published method.")] = "2,1",
    fading: Annotated[float, typer.Option(help="Memory of R, 0 to 1.")] = 0.97,
    adapt_for: Annotated[str, typer.Option(help="Seconds of learning, or 'always'.")] = "120",
    forgetting_factor: Annotated[float, typer.Option(help="Of the least squares, 0 to 1.")] = 1.0,
    process_noise: Annotated[
        float, typer.Option(help="Initial G and P, in variances of the start-up.")
    ] = 0.1,
    startup: Annotated[float, typer.Option(help="Seconds of the start-up.")] = 1.0,
    noise: Annotated[Noise, typer.Option(help="Variance that R is taken from.")] = Noise.allan,
    beside: Annotated[
        str | None, typer.Option("--with", help="More columns: bias,bias_sigma,at_rest.")
    ] = None,
    udp: Annotated[
        str | None,
        typer.Option(
            metavar="HOST:PORT", help="Take datagrams of this machine, answer to their sender."
        ),
    ] = None,
    checkpoint: Annotated[
        Path | None,
        typer.Option(metavar="FILE", help="Save the state, and go on from it at the next start."),
    ] = None,
    every: Annotated[float, typer.Option(help="Seconds of samples between two saves.")] = 1.0,
    position: Annotated[
        bool,
        typer.Option("--position", help="Print the sample that the checkpoint goes on with."),
    ] = False,
    force: Annotated[
        bool, typer.Option("--force", help="Begin anew if the checkpoint cannot be used.")
    ] = False,
) -> None:
    """Answer each line of samples at once with the compensated rate.

    A line that is garbled is told on stderr, answered with nan and taken as missing.
    """
    if position:
        if checkpoint is None:
            raise UsageFault("--position needs --checkpoint")
        print(position_of(checkpoint))
        return
    if source is not None and udp is not None:
        raise UsageFault("give either a source or --udp, not both")
    if rate is None:
        raise UsageFault("--rate is required: samples per second")
    note_on_options(context, method)
    with as_usage():
        settings = Settings(
            rate=rate,
            method=method.value,
            motion=None if motion is None else motion.value,
            output=output_kind.value,
            beside=_beside(beside),
            columns=_columns(columns),
            sequence=_column(sequence),
            order=parse_order(order),
            fading=fading,
            adapt_for=parse_adapt_for(adapt_for),
            forgetting_factor=forgetting_factor,
            process_noise=process_noise,
            startup=startup,
            noise=noise.value,
        )
    saver = None if checkpoint is None else _saver(checkpoint, every * rate)
    lines = resumed(checkpoint, settings, fields, force)
    server = Server(lines, saver, tell, patient=fields is not None)
    try:
        run(server, source, udp)
    finally:
        report(server)


def _saver(checkpoint: Path, every: float) -> Saver:
    if not 0.0 < every < math.inf:
        raise UsageFault("--every takes a positive number of seconds")
    with as_usage():
        check_writable(checkpoint, force=True)
    return Saver(checkpoint, max(1, round(every)), tell)


def _beside(text: str | None) -> tuple[Beside, ...]:
    words = [] if text is None else [word.strip() for word in text.split(",")]
    for word in words:
        if word not in list(Beside):
            raise UsageFault(f"--with takes some of {', '.join(Beside)}, got '{word}'")
    return tuple(dict.fromkeys(map(Beside, words)))


def _columns(text: str | None) -> tuple[str | int, ...] | None:
    found = parse_columns(text)
    return None if found is None else tuple(found)


def _column(text: str | None) -> str | int | None:
    found = parse_columns(text)
    if found is not None and len(found) != 1:
        raise UsageFault(f"--sequence takes one column, got '{text}'")
    return None if found is None else found[0]
