"""Names of a user are plain text in figures, pages and terminals; a figure costs no data."""

import io
import random
from dataclasses import replace

import numpy as np
import pytest
from rich.console import Console

import zerorate as zr
from support.streams import streamed
from zerorate.cli import run
from zerorate.show.live_terminal import LiveTerminal
from zerorate.show.plain_figure import PlainFigure
from zerorate.tasks.live.view import View
from zerorate.views import FigureError, save_figure

PIECES = (
    *("$", "$$", "$x", r"$\frac{", "_{", "^", "\\", "%", "&", "#", "~", "{", "}", r"\$"),
    *(
        "[red]",
        "[/red]",
        "[link=file:///etc/passwd]",
        "[",
        "]",
        ":smile:",
        "<b>",
        "</text>",
        "&amp;",
    ),
    *("\x1b[31m", "\x1b]8;;file:///etc\x1b\\", "\x07", "\x9b31m", "\u202e", "\u200b", "°", "√"),
)
VIEW = View(1.0, ("gx",), "deg/s", (0.25,), (0.5,), (0.01,), "at rest", None, None)


def drawn(seed, sure=""):
    """Return the name of a gyro's axis with what means something to a language."""
    random_ = random.Random(seed)
    return sure + "".join(random_.choices(PIECES, k=random_.randrange(1, 4)))


def named_log(name, n=800):
    data = 0.1 * np.random.default_rng(1).standard_normal((n, 3))
    names = tuple(f"{name}gyro_{axis}_dps" for axis in "xyz")
    return zr.Log(np.arange(n) / 100.0, 100.0, data, names, "deg/s", {"source": f"{name}.csv"})


@pytest.mark.parametrize("format", ["png", "svg", "pdf"])
@pytest.mark.parametrize("seed", range(6))
def test_any_name_is_drawn_as_it_stands(tmp_path, seed, format):
    name = "".join(c for c in drawn(seed, "$") if c.isprintable())
    log = named_log(name)
    for result in (zr.replay(log), zr.allan(log)):
        save_figure(result.plot(), tmp_path / f"figure.{format}")
        assert (tmp_path / f"figure.{format}").stat().st_size > 1000


def test_powers_of_ten_are_formulas_still(tmp_path):
    figure = PlainFigure()
    panel = figure.subplots()
    panel.loglog([1e-3, 1e3], [1e-5, 1e2], label="$$x")
    panel.set_title("$$x")
    figure.savefig(tmp_path / "figure.svg")
    assert panel.yaxis.get_major_ticks()[0].label1.get_parse_math()
    assert not panel.title.get_parse_math()


@pytest.mark.parametrize("seed", range(4))
def test_commands_write_all_for_any_name(tmp_path, seed, capsys):
    name = drawn(seed, "$").translate({ord(c): None for c in '\x1b\x07\x9b/,;"\\'})
    path = tmp_path / f"a{name}.csv"
    path.write_text(
        "time_s," + ",".join(f"{name}gyro_{axis}_dps" for axis in "xyz") + "\n"
        + "".join(
            f"{i / 100:.2f}," + ",".join(f"{x:.4f}" for x in row) + "\n"
            for i, row in enumerate(np.random.default_rng(seed).standard_normal((700, 3)))
        ), encoding="utf-8",
    )  # fmt: skip
    for command in ("replay", "allan", "identify"):
        out = tmp_path / command
        assert run([command, str(path), "-o", str(out)]) == 0, capsys.readouterr().err
        assert len(list(out.iterdir())) == 2


@pytest.mark.parametrize("seed", range(20))
def test_a_terminal_shows_names_and_obeys_none(seed):
    text = io.StringIO()
    name = drawn(seed)
    console = Console(file=text, force_terminal=True, width=200, color_system="truecolor")
    with LiveTerminal(console) as terminal:
        terminal.put(replace(VIEW, names=(name,)))
    shown = text.getvalue()
    plain = "".join(c if c.isprintable() else c.encode("unicode_escape").decode() for c in name)
    assert plain in shown
    assert "\x1b]8" not in shown
    assert "\x1b[31m" not in shown


@pytest.mark.parametrize("seed", range(6))
def test_what_is_told_of_names_has_no_escapes(seed, tmp_path, capsys):
    name = drawn(seed, "\x1b[31m").translate({ord(c): None for c in ' ,;"/'})
    lines = [f"t,{name}gyro_x_dps,other", *(f"{i},0.{i},{i}" for i in range(1, 9)), "a\x1b[2Jb,1,1"]
    _, _, told = streamed(lines, "--rate", "100")
    (tmp_path / name).write_bytes(b"no checkpoint")
    assert run(["stream", "--rate", "100", "--checkpoint", str(tmp_path / name)]) == 1
    told += capsys.readouterr().err
    assert "\\x1b[31m" in told
    assert not any(ord(c) < 32 or 127 <= ord(c) < 160 for c in told.replace("\n", ""))


def fails(*_, **__):
    raise ValueError("no such font\nof any size")


@pytest.mark.parametrize(
    ("command", "data"),
    [("replay", ".parquet"), ("allan", "-allan.csv"), ("attitude", "-attitude.parquet")],
)
def test_a_figure_that_fails_costs_no_data(tmp_path, monkeypatch, capsys, command, data):
    path = tmp_path / "imu.csv"
    still = "".join(f"{i / 100},0.1,0.2,{i % 3},0,0,{1 + i % 2 / 100}\n" for i in range(800))
    path.write_text("time_s,gx_dps,gy_dps,gz_dps,ax_g,ay_g,az_g\n" + still)
    for drawing in (PlainFigure.draw, PlainFigure.savefig):
        monkeypatch.setattr(PlainFigure, drawing.__name__, fails)
        out = tmp_path / drawing.__name__
        assert run([command, str(path), "-o", str(out)]) == 1
        said = capsys.readouterr()
        assert [file.name for file in out.iterdir()] == [f"imu-zerorate{data}"]
        assert said.err.count("\n") == 1
        assert "could not be drawn: no such font of any size; all other files were" in said.err
        assert f"wrote {out / f'imu-zerorate{data}'}" in said.out
        assert ".png" not in said.out


def test_a_figure_that_fails_is_an_error_of_its_own(tmp_path, monkeypatch):
    result = zr.replay(named_log(""))
    monkeypatch.setattr(PlainFigure, "draw", fails)
    with pytest.raises(FigureError, match="could not be drawn: no such font"):
        result.save(tmp_path, format="csv")
    assert [file.suffix for file in tmp_path.iterdir()] == [".csv"]
    assert "could not be drawn" in result._repr_html_()
