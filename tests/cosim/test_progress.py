"""The bar of a run: how far, and how many times faster than what it simulates; nothing where nobody looks."""

import io
import sys

import pytest

from tsm_fmu.cosim import progress


class Terminal(io.StringIO):
    def isatty(self):
        return True


@pytest.fixture
def clock(monkeypatch):
    now = [100.0]
    monkeypatch.setattr(progress, "perf_counter", lambda: now[0])
    monkeypatch.setenv("TERM", "xterm")
    return now


def test_the_factor_is_simulated_over_passed_time(clock, monkeypatch):
    monkeypatch.setattr(sys, "stderr", terminal := Terminal())
    with progress.bar(True, "loop", 800, 0.013) as advance:
        clock[0] += 1.7
        advance(600)
    assert f"{600 * 0.013 / 1.7:.3g} x real time" in terminal.getvalue()
    assert "75%" in terminal.getvalue()


def test_points_of_a_sweep_have_no_such_factor(clock, monkeypatch):
    monkeypatch.setattr(sys, "stderr", terminal := Terminal())
    with progress.bar(True, "sweep", 4) as advance:
        clock[0] += 0.3
        advance(1)
    assert "25%" in terminal.getvalue()
    assert "real time" not in terminal.getvalue()


@pytest.mark.parametrize(("wanted", "stream"), [(False, Terminal), (True, io.StringIO)])
def test_a_file_or_a_program_that_reads_along_gets_nothing(clock, monkeypatch, wanted, stream):
    monkeypatch.setattr(sys, "stderr", kept := stream())
    with progress.bar(wanted, "loop", 10, 0.1) as advance:
        clock[0] += 1.0
        advance(5)
    assert kept.getvalue() == ""
