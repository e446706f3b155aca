"""The data gate on real logs: what is there is found, and nothing else."""

import os
from pathlib import Path

import numpy as np
import pytest

from tsm_fmu.checking import check_record
from tsm_fmu.logs.record import read_record

ROOT = Path(os.environ.get("TSM_FMU_DATA") or Path(__file__).parents[3] / "shared" / "data")
DAVINCI = ROOT / "davinci"
pytestmark = pytest.mark.skipif(
    not DAVINCI.is_dir(), reason=f"no davinci in {ROOT}: set TSM_FMU_DATA to the folder that contains davinci/"
)
# In T4L4/29 the jaw lets go at 12.893 s: its torque peaks for one sample and drops by 0.011 N.m in a millisecond.
KNOWN = {"T4L4/07": {"disturbance"}, "T4L4/29": {"glitch"}}


@pytest.fixture(scope="module")
def checks():
    paths = sorted(DAVINCI.glob("T4L*/[0-9]*.csv.gz"))
    return {f"{p.parent.name}/{p.name[:2]}": check_record(read_record(p)) for p in paths}


def test_disturbance_of_run_07(checks):
    (event,) = [f for f in checks["T4L4/07"].findings if f.kind == "disturbance"]
    assert event.t0 < 17.35 < event.t1
    assert event.t1 - event.t0 < 0.6
    assert {"x_in", "x_out"} <= set(event.channel.split(", "))


def test_nothing_else_is_found(checks):
    assert len(checks) == 70
    ordinary = {"coverage", "start_up"}
    found = {name: {f.kind for f in c.findings} - ordinary for name, c in checks.items()}
    assert {name: kinds for name, kinds in found.items() if kinds} == KNOWN


def test_encoders_rate_frequencies_and_power(checks):
    for name, check in checks.items():
        assert check.channels["x_in"].step == pytest.approx(2 * np.pi / 8192, rel=1e-6), name
        assert check.channels["x_out"].step == pytest.approx(2 * np.pi / 4000, rel=1e-6), name
        assert check.clock.rate == pytest.approx(1000.0, rel=1e-9), name
        assert check.motion.frequencies[0] == pytest.approx(0.1 * (1 + int(name[-2])), rel=2e-3), name
        assert next(p for p in check.powers if p.effort == "tau_in").mean > 0.0, name
