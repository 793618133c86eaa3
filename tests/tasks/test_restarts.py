"""A noise that was learned wrong is told of."""

import numpy as np

from support.logs import make_log
from zerorate.show import format_notes
from zerorate.tasks.replay.run import run_filters


def test_replay_notes_a_noise_that_was_learned_anew():
    z = np.random.default_rng(1).standard_normal((6000, 2))
    z[:1000, 1] *= 1e-9
    told = run_filters(make_log(z, names=["x", "y"]), motion="ignore")
    assert told.restart_count.tolist() == [0, 1]
    notes = " ".join(format_notes(told).split())
    assert "y: the noise learned at the start was wrong by orders of magnitude" in notes
    assert "x: the noise" not in notes
