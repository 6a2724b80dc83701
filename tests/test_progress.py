"""Progress: lines from rank 0 every few seconds, a bar in a terminal, always closed."""

import io
import re
import sys
import time

import pytest

from iceslide_fem.runtime.terminal import LongTask

pytest.importorskip("iceslide_fem.fenics.compat")
from iceslide_fem.runs.observers import Progress  # noqa: E402

pytestmark = pytest.mark.quick


class Terminal(io.StringIO):
    def isatty(self) -> bool:
        return True


@pytest.fixture
def clock(monkeypatch):
    """A clock that the test sets: clock[0] is the time now."""
    now = [0.0]
    monkeypatch.setattr(time, "monotonic", lambda: now[0])
    return now


def test_a_line_every_five_seconds(capsys, clock):
    with Progress(0, 7e-3) as shown:
        for second in range(1, 11):
            clock[0] = float(second)
            shown.update(second * 0.35e-3, 0.3123, 5e-5, 3, "slide")
    lines = capsys.readouterr().err.splitlines()
    assert lines == [
        "t = 1.750 of 7 ms, mu 0.312, step 0.05 ms, 3 Newton, slide, 15 s left",
        "t = 3.500 of 7 ms, mu 0.312, step 0.05 ms, 3 Newton, slide, 10 s left",
    ]


def test_time_left_of_a_run_that_goes_on(capsys, clock):
    with Progress(0, 7e-3) as shown:
        shown.go_on(6.3e-3)
        clock[0] = 10.0
        shown.update(6.4e-3, 0.3, 5e-5, 3)
    assert capsys.readouterr().err.strip().endswith("60 s left")


def test_no_time_left_before_the_start(capsys, clock):
    with Progress(0, 7e-3) as shown:
        clock[0] = 6.0
        shown.update(0.0, 0.1, 5e-5, 4, "press")
    assert capsys.readouterr().err.endswith("4 Newton, press\n")


def test_other_ranks_are_silent(monkeypatch, clock):
    monkeypatch.setattr(sys, "stderr", Terminal())
    with Progress(1, 7e-3) as shown:
        clock[0] = 60.0
        shown.update(1e-3, 0.3, 5e-5, 3)
    assert sys.stderr.getvalue() == ""


def test_a_bar_in_a_terminal_is_closed_even_after_an_error(monkeypatch, clock):
    monkeypatch.setattr(sys, "stderr", Terminal())
    monkeypatch.setenv("COLUMNS", "120")
    shown = Progress(0, 7e-3)
    with pytest.raises(RuntimeError), shown:
        shown.update(1e-3, 0.1, 5e-5, 3)
        assert sys.stderr.getvalue() == ""  # nothing of what may be over in a moment
        clock[0] = 2.0
        shown.update(3.5e-3, 0.3123, 5e-5, 3)
        raise RuntimeError
    printed = sys.stderr.getvalue()
    assert printed.count("\x1b[?25l") == printed.count("\x1b[?25h") == 1  # the cursor is back
    assert "50%" in printed and "mu 0.312" in printed and "2 s left" in printed


def test_a_narrow_bar_keeps_the_time_left(monkeypatch, clock):
    monkeypatch.setattr(sys, "stderr", Terminal())
    monkeypatch.setenv("COLUMNS", "60")
    with Progress(0, 7e-3) as shown:
        clock[0] = 1000.0
        shown.update(7e-4, 0.3123, 5e-5, 3, "sliding")
    plain = re.sub(r"\x1b\[[0-9;?]*[A-Za-z]", "", sys.stderr.getvalue())
    bar = plain.strip().splitlines()[-1].strip("\r")
    assert " 10%" in bar and "9000 s left" in bar and len(bar) <= 60


def test_other_tasks_say_how_far_they_are(capsys, clock):
    with LongTask(20) as shown:
        clock[0] = 6.0
        shown.show(5, "5 of 20 pictures")
    assert capsys.readouterr().err == "5 of 20 pictures, 18 s left\n"
