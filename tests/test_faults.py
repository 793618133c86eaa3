"""Sentences and errors that name arguments: in words of Python, of a shell, in other processes."""

import copy
import json
import pickle

import pytest

import zerorate as zr
from zerorate.faults import (
    ArgumentError,
    Sentence,
    bare_argument,
    keyword_argument,
    make_sentence,
    pack_text,
    render_text,
    sentence_of,
    strip_prefix,
    unpack_text,
    use_argument_names,
)
from zerorate.record import LogError

FLAGS = {"rate": "--rate", "time_unit": "--time-unit", "device": "--device", "range": "--range"}

SPOKEN = [
    (
        make_sentence("give ", keyword_argument("rate"), " in Hz"),
        "give rate= in Hz",
        "give --rate in Hz",
    ),
    (make_sentence(keyword_argument("rate", "100")), "rate=100", "--rate 100"),
    (make_sentence(bare_argument("rate"), " must be 1"), "rate must be 1", "--rate must be 1"),
    (
        make_sentence(keyword_argument("time_unit", "ms", "time_unit='ms'")),
        "time_unit='ms'",
        "--time-unit ms",
    ),
    (
        make_sentence(
            "by ",
            keyword_argument("device", "A", "scale=f('A', 2)", keyword_argument("range", "2")),
        ),
        "by scale=f('A', 2)",
        "by --device A --range 2",
    ),
    # A command that has no such option says what Python has.
    (make_sentence(keyword_argument("bridge"), " fills"), "bridge= fills", "bridge= fills"),
]


@pytest.mark.parametrize(("sentence", "python", "shell"), SPOKEN)
def test_a_sentence_is_text_and_can_be_said_otherwise(sentence, python, shell):
    assert sentence == python
    assert sentence.with_names(FLAGS) == shell
    assert render_text(sentence) == python
    with use_argument_names(FLAGS):
        assert render_text(sentence) == shell
        assert render_text(make_sentence("a: ", sentence, "; b")) == f"a: {shell}; b"
    for other in (pickle.loads(pickle.dumps(sentence)), copy.copy(sentence)):
        assert (other, other.parts) == (sentence, sentence.parts)
    assert unpack_text(json.loads(json.dumps(pack_text(sentence)))).parts == sentence.parts


def test_names_add_to_those_before_and_end_with_them():
    with use_argument_names({"rate": "--rate"}), use_argument_names({"unit": "--unit"}):
        assert (
            render_text(make_sentence(keyword_argument("rate"), keyword_argument("unit")))
            == "--rate--unit"
        )
    assert render_text(make_sentence(keyword_argument("rate"))) == "rate="


def test_what_is_plain_stays_so():
    assert render_text("rate= is no argument here") == "rate= is no argument here"
    assert (pack_text("a"), unpack_text("a"), strip_prefix("a: b", "a: ")) == ("a", "a", "b")
    cut = strip_prefix(make_sentence("log: give ", keyword_argument("rate")), "log: ")
    assert (cut, cut.with_names(FLAGS)) == ("give rate=", "give --rate")


def test_an_error_of_an_argument_says_which_one_it_is():
    error = ArgumentError("rate", "must be positive, got -1")
    for one in (error, pickle.loads(pickle.dumps(error))):
        assert (str(one), one.argument) == ("rate must be positive, got -1", "rate")
        assert sentence_of(one).with_names(FLAGS) == "--rate must be positive, got -1"
    assert isinstance(error, ValueError)


def test_an_error_of_a_log_keeps_its_argument_and_one_line():
    error = LogError(
        make_sentence("no\nrow; give ", keyword_argument("rate")), "rate"
    ).with_context("log: ", " (now)")
    for one in (error, pickle.loads(pickle.dumps(error))):
        assert (str(one), one.argument) == ("log: no\\nrow; give rate= (now)", "rate")
        assert sentence_of(one).with_names(FLAGS) == "log: no\\nrow; give --rate (now)"
    assert LogError("damaged").argument is None


COMPILED = {
    "rate": lambda: zr.DriftFilter(-1.0),
    "order": lambda: zr.DriftFilter(100.0, method="kf", order=(9, 0)),
    "method": lambda: zr.DriftFilter(100.0, method="none"),
    "rest_limit": lambda: zr.DriftFilter(100.0, rest_limit=-1.0),
    "forgetting_factor": lambda: zr.DriftFilter(100.0, method="kf", forgetting_factor=2.0),
    "channels": lambda: zr.DriftFilter(100.0, channels=0),
}


@pytest.mark.parametrize("argument", COMPILED)
def test_an_error_of_the_compiled_module_does_so_too(argument):
    with pytest.raises(ValueError, match=f"^{argument} ") as caught:
        COMPILED[argument]()
    assert caught.value.argument == argument
    said_otherwise = sentence_of(caught.value)
    assert isinstance(said_otherwise, Sentence)
    assert (
        said_otherwise.with_names({argument: "--it"}) == "--it" + str(caught.value)[len(argument) :]
    )
