"""What options refuse that are read from texts."""

from pathlib import Path

import pytest

from planarfriction.cli import identify, options
from planarfriction.sweeps import settings
from tests.support.refusals import refusal

REFUSED = [
    (
        settings.parse,
        "a=1:1:2",
        "--set a must have a STOP that differs from START, got 1:1:2",
    ),
    (
        settings.parse,
        "a=1:2:x",
        "--set a must be START:STOP:COUNT with a whole number as COUNT, got 1:2:x",
    ),
    (settings.parse, "a=0:1:1", "COUNT of --set a must be an integer >= 2, got 1"),
    (settings.parse, "a=x:1:3", "START of --set a must be a number, got x"),
    (
        settings.parse,
        "a=",
        "--set must be PATH=VALUE, PATH=VALUE,VALUE,... or PATH=START:STOP:COUNT, got 'a='",
    ),
    (settings.parse, "=1", "or PATH=START:STOP:COUNT, got '=1'"),
    (settings.parse, "mu_c,v_s", "or PATH=START:STOP:COUNT, got 'mu_c,v_s'"),
    (settings.parse, "a=1,,2", "--set a must have a value between commas, got ''"),
    (settings.parse, "a=1,1", "--set a must have each value once, got 1 2 times"),
    (settings.parse, "a=[1", "--set a must be a list or a text as in TOML, got [1"),
    (settings.parse, "a=inf", "--set a must be finite, got inf"),
    (
        lambda text: identify.parse_start([text]),
        "a=0.5, 1",
        "--start a must be a number, got 0.5, 1",
    ),
    (
        lambda text: identify.parse_start([text]),
        "a=inf",
        "--start a must be finite, got inf",
    ),
    (
        lambda text: identify.parse_start([text]),
        "mu_c",
        "--start must be NAME=VALUE, such as mu_c=0.4, got mu_c",
    ),
    (
        identify.parse_names,
        "mu_c,mu_x",
        "n, k, k_per_newton, got 'mu_x' (did you mean 'mu_s'?)",
    ),
    (identify.parse_noise, "1,2,x", "--noise must be a number, got x"),
    (
        lambda text: options.find_patch(text, {}),
        "sqare",
        "got 'sqare' (did you mean 'Square'?)",
    ),
    (
        lambda text: options.find_patch(text, {}),
        "here.py",
        "--cell-size must be given (or --width) for the pressure map",
    ),
    (
        lambda text: options.load_function("--measure", text),
        "f",
        "--measure must be FILE.py:NAME, got f",
    ),
    (
        lambda text: options.load_function("--measure", text),
        "none.py:f",
        "none.py: no such file",
    ),
    (
        lambda text: options.load_function("--measure", text),
        "here.py:f",
        "here.py: has no function called f",
    ),
    (
        lambda text: options.load_function("--measure", text),
        "bad.py:f",
        "bad.py: ZeroDivisionError: division by zero",
    ),
]


@pytest.mark.parametrize(("read", "text", "words"), REFUSED)
def test_a_mistake_is_refused_in_words(read, text, words, tmp_path, monkeypatch):
    monkeypatch.chdir(tmp_path)
    Path("here.py").write_text("f = 3\n", encoding="utf-8")
    Path("bad.py").write_text("1 / 0\n", encoding="utf-8")
    assert words in refusal(read, text)
