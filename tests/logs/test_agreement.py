"""Errors of a simulation: offset and shape apart, and together the whole."""

from __future__ import annotations

import numpy as np
import pytest

from tsm_fmu.logs.agreement import agreement


def test_offset_and_shape_make_the_whole_error() -> None:
    t = np.linspace(0.0, 7.3, 911)
    measured, shape = np.sin(2.1 * t), 0.013 * np.cos(3.7 * t)
    found = agreement("rad", [measured], [shape - 0.0871])
    assert found.offset == pytest.approx(shape.mean() - 0.0871, rel=1e-12)
    assert found.shape_rmse == pytest.approx(shape.std(), rel=1e-12)
    assert found.rmse == pytest.approx(np.hypot(found.offset, found.shape_rmse), rel=1e-12)


def test_runs_with_offsets_of_their_own_have_one_shape() -> None:
    rng = np.random.default_rng(3)
    errors = [rng.normal(0.0, 0.021, n) for n in (700, 1311)]
    moved = [e + offset for e, offset in zip(errors, (0.4, -0.173), strict=True)]
    found = agreement("N", [np.sin(e) for e in errors], moved)
    centred = np.concatenate([e - e.mean() for e in moved])
    assert found.shape_rmse == pytest.approx(np.sqrt(np.mean(centred**2)), rel=1e-12)
    assert found.rmse**2 == pytest.approx(found.offset**2 + found.shape_rmse**2, rel=1e-12)
