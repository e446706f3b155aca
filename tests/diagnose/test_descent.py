"""The optimiser's view of a refit: few rows, the same problem."""

from __future__ import annotations

import numpy as np
import pytest

from tsm_fmu.diagnose.descent import triangle


@pytest.mark.parametrize("rows", [3, 7, 8, 4001])
@pytest.mark.parametrize("size", [0.0, 1.7e-3, 2.9e6])
def test_norms_and_slopes_are_those_of_all_rows(rows: int, size: float) -> None:
    rng = np.random.default_rng(rows)
    residual, columns = size * rng.normal(size=rows), rng.normal(size=(rows, 7)) @ np.diag(10.0 ** np.arange(-3, 4))
    turned = triangle(residual, columns)
    assert turned.shape == (8, 7)
    scale = np.linalg.norm(columns, axis=0)
    first = np.append(np.linalg.norm(residual), np.zeros(7))
    assert np.allclose((turned / scale).T @ (turned / scale), (columns / scale).T @ (columns / scale), atol=1e-13)
    assert np.allclose((turned / scale).T @ first, (columns / scale).T @ residual, atol=1e-13 * max(size, 1.0) * rows)


def test_a_step_is_that_of_all_rows() -> None:
    rng = np.random.default_rng(3)
    residual, columns = rng.normal(size=911), rng.normal(size=(911, 5))
    turned, first = triangle(residual, columns), np.append(np.linalg.norm(residual), np.zeros(5))
    whole, few = (np.linalg.lstsq(a, -b, rcond=None)[0] for a, b in ((columns, residual), (turned, first)))
    assert np.allclose(whole, few, rtol=1e-11)
