"""Which channels count: those that every run has, and what is said of the others."""

from __future__ import annotations

import numpy as np
import pytest

from tsm_fmu import InputError
from tsm_fmu.kernels.kernel import kernel
from tsm_fmu.logs.record import Record
from tsm_fmu.regression.specification import measured_channels, not_in_every_run

MODEL = kernel("TendonDrive")


def run(name: str, *channels: str) -> Record:
    time = 0.01 * np.arange(5)
    return Record(name, time, {n: np.sin(time) for n in channels}, dict.fromkeys(channels, "1"), first_row=2)


def test_an_output_that_a_run_does_not_have_is_said_to_be_left_out() -> None:
    full, short = run("a.csv", "x_in", "x_out", "tau_in"), run("b.csv", "x_in", "tau_in")
    assert measured_channels(MODEL, [full, short]) == ("tau_in",)
    assert not_in_every_run(MODEL, [full, short]) == ("x_out is not compared in any run: it is not in b.csv",)
    assert not_in_every_run(MODEL, [full, full, short, short]) == (
        "x_out is not compared in any run: it is not in 2 of 4 runs (b.csv)",
    )
    assert not_in_every_run(MODEL, [full, full]) == ()


@pytest.mark.parametrize(("runs", "said"), [
    ([run("a.csv", "x_in", "tau_in"), run("b.csv", "x_in", "torque")],
     "run b.csv has x_in, torque and no output of TendonDrive"),
    ([run("a.csv")], "run a.csv has only time and no output of TendonDrive"),
    ([run("a.csv", "x_out"), run("b.csv", "tau_in")],
     "no output of TendonDrive is in every run (a.csv has x_out; b.csv has tau_in)"),
])  # fmt: skip
def test_without_an_output_the_run_and_what_it_has_are_named(runs: list[Record], said: str) -> None:
    with pytest.raises(InputError) as caught:
        measured_channels(MODEL, runs)
    assert str(caught.value) == (
        f"{said} -- expected one of {', '.join(v.name for v in MODEL.outputs)} -- rename one with --map LOG=NAME"
    )
