"""Spikes of a measurement are not compared, and said."""

import numpy as np

from tsm_fmu.diagnosis.runs.prepared import prepared
from tsm_fmu.kernels.kernel import kernel
from tsm_fmu.logs.record import Record


def test_spikes_of_compared_channels_are_not_compared_and_said() -> None:
    rng = np.random.default_rng(17)
    t = np.arange(0.0, 9.3, 0.007)
    v = 0.031 * np.cos(1.9 * t)
    force = 2.7 * np.tanh(400.0 * v) + 0.01 * rng.standard_normal(t.size)
    hurt = force.copy()
    at = [311, 874]
    hurt[at] += [13.0, -21.0]

    def runs(channel: np.ndarray) -> list[Record]:
        return [Record("run", t, {"v": v, "F": channel}, {"v": "m/s", "F": "N"})]

    clean, found = (prepared(kernel("LuGreFriction"), runs(y), [], [], None) for y in (force, hurt))
    np.testing.assert_allclose(found.measured[0].targets, clean.measured[0].targets, atol=0.05)
    assert not any("spikes" in note for note in clean.notes)
    note = next(note for note in found.notes if "spikes" in note)
    assert note.startswith("2 single samples of F")
    assert f"{t[311]:.3f} s" in note
