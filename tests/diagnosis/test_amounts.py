"""The linear step by products: against scipy's bounded least squares, and against sums over all samples."""

from __future__ import annotations

import numpy as np
import pytest
from scipy.optimize import lsq_linear

from tsm_fmu.diagnosis.fits.amounts import CLOSED, DAMPING, Parts, explained, products

CHANNELS, N = 2, 86


def drawn(seed: int, *shape: int) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
    """Responses, what of them lies outside of a basis, and a residual outside of it."""
    rng = np.random.default_rng(seed)
    basis = np.linalg.qr(rng.normal(size=(N, 5)))[0]
    responses = rng.normal(size=(*shape, N)) * 10.0 ** rng.uniform(-3, 3, (*shape, 1))
    residual = rng.normal(size=N)
    return responses, responses - responses @ basis @ basis.T, residual - basis @ (basis.T @ residual)


def squares(column: np.ndarray) -> np.ndarray:
    return np.sum(column.reshape(-1, CHANNELS) ** 2, axis=0)


@pytest.mark.parametrize("signed", [[True, True, True], [False, True, False], [False, False, False]])
def test_amounts_are_those_of_bounded_least_squares(signed: list[bool]) -> None:
    responses, outside, residual = drawn(7, 60, 3)
    gains, amounts = explained(
        products(responses, outside, residual, CHANNELS), squares(residual), np.array(signed)
    )  # fmt: skip
    at_bound = 0
    for columns, beyond, gain, found in zip(responses, outside, gains, amounts, strict=True):
        ridge = np.diag(np.sqrt(DAMPING) * np.linalg.norm(columns, axis=1))  # of the whole response
        lo = np.where(signed, -np.inf, 0.0)
        scale = np.linalg.norm(beyond, axis=1)
        rows, right = np.vstack([beyond.T, ridge]) / scale, np.concatenate([residual, np.zeros(3)])
        best = lsq_linear(rows, right, (lo, np.inf), method="bvls", tol=1e-14).x / scale
        assert found * scale == pytest.approx(best * scale, rel=1e-6, abs=1e-9)
        left = np.maximum(squares(residual - found @ beyond), CLOSED * squares(residual))
        assert gain == pytest.approx(np.sum(np.log(squares(residual) / left)), rel=1e-9, abs=1e-12)
        at_bound += int((found == 0.0).sum())
    assert (at_bound > 0) == (not all(signed))


@pytest.mark.parametrize("signs", [[1.0, 0.0, 0.0], [0.0, -1.0, 0.0], [-1.0, 0.0, 1.0]])
def test_sizes_may_be_held_to_one_sign_each_or_to_nothing(signs: list[float]) -> None:
    responses, outside, residual = drawn(11, 60, 3)
    lo, hi = np.where(np.array(signs) < 0.0, -np.inf, 0.0), np.where(np.array(signs) > 0.0, np.inf, 0.0)
    gains, amounts = explained(
        products(responses, outside, residual, CHANNELS), squares(residual), np.full(3, True), np.array(signs)
    )
    used = np.array(signs) != 0.0
    for columns, beyond, gain, found in zip(responses, outside, gains, amounts, strict=True):
        ridge = np.diag(np.sqrt(DAMPING) * np.linalg.norm(columns, axis=1))
        scale = np.linalg.norm(beyond, axis=1)
        rows, right = np.vstack([beyond.T, ridge]) / scale, np.concatenate([residual, np.zeros(3)])
        best = lsq_linear(rows[:, used], right, (lo[used], hi[used]), method="bvls", tol=1e-14).x
        assert found[used] * scale[used] == pytest.approx(best, rel=1e-6, abs=1e-9)
        assert not found[~used].any()
        left = np.maximum(squares(residual - found @ beyond), CLOSED * squares(residual))
        assert gain == pytest.approx(np.sum(np.log(squares(residual) / left)), rel=1e-9, abs=1e-12)
    assert 0 < np.count_nonzero(amounts[:, used]) < amounts[:, used].size


def test_all_that_can_be_closed_is_one_part_in_a_million() -> None:
    responses, outside, residual = drawn(8, 1, 1)
    responses[0, 0] = outside[0, 0] = -37.0 * residual
    gains, amounts = explained(products(responses, outside, residual, CHANNELS), squares(residual), np.array([True]))
    assert amounts[0, 0] == pytest.approx(-1.0 / 37.0, rel=2.0 * DAMPING)
    assert gains[0] == pytest.approx(CHANNELS * np.log(1.0 / CLOSED), rel=1e-9)


def test_runs_at_any_states_have_the_products_of_their_sum() -> None:
    runs, states, sizes = 4, 3, 2
    responses, _, residual = drawn(9, states, sizes)
    basis = np.linalg.qr(np.random.default_rng(10).normal(size=(N, 5)))[0]
    parts = np.zeros((runs, states, sizes, N))
    for k in range(runs):
        here = slice(22 * k, min(22 * (k + 1), N))
        parts[k, :, :, here] = responses[:, :, here]
    outside = parts - parts @ basis @ basis.T
    of_parts, chosen = Parts(parts, outside, residual, CHANNELS), [2, 0, 1, 2]
    for k in range(runs):
        found = of_parts.with_run(k, chosen)
        for i in range(states):
            at = [i if j == k else chosen[j] for j in range(runs)]
            whole, beyond = (sum(one[j, at[j]] for j in range(runs))[None] for one in (parts, outside))
            expected = products(whole, beyond, residual, CHANNELS)
            for one, other in zip(found, expected, strict=True):
                assert one[i] == pytest.approx(other[0], rel=1e-9, abs=1e-9 * np.abs(other).max())
