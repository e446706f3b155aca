"""What a card keeps of a fit's errors: those that are known, as a matrix of correlations, in the card's names."""

from __future__ import annotations

import math

import numpy as np
import pytest

from tsm_fmu.kernels.chain import chain
from tsm_fmu.kernels.kernel import kernel
from tsm_fmu.regression.card_errors import correlation
from tsm_fmu.regression.uncertainty import Uncertainty

MODEL = chain("TendonDrive", ("delay@tau_in",))
FIELDS = ("alpha", "tau_in__delay__T_d", "beta", "c", "sigma1")
MATRIX = np.array([
    [1.0, 0.3, -0.9, 0.2, 0.1], [0.3, 1.0, 0.05, -0.4, 0.0], [-0.9, 0.05, 1.0, 0.25, -0.6], [0.2, -0.4, 0.25, 1.0, 0.7],
    [0.1, 0.0, -0.6, 0.7, 1.0],
])  # fmt: skip


VALUES = dict.fromkeys(FIELDS, -0.7)


def known(matrix: np.ndarray = MATRIX) -> Uncertainty:
    return Uncertainty(dict.fromkeys(FIELDS, 0.1), (), matrix, FIELDS, 3.0, 10.0, 1.0, {})


def test_all_that_are_known_are_kept_with_their_public_names_and_how_they_were_searched() -> None:
    found = correlation(MODEL, known(), dict.fromkeys(FIELDS, 0.1), VALUES)
    assert found is not None
    assert found.names == ("alpha", "tau_in.delay.T_d", "beta", "c", "sigma1")
    assert np.array(found.matrix) == pytest.approx(MATRIX)
    assert found.logarithm == ("alpha", "beta", "c")  # open bounds at zero, from either side


@pytest.mark.parametrize("missing", [None, math.nan, math.inf, "absent"])
@pytest.mark.parametrize("left_out", [("alpha",), ("beta", "sigma1"), ("c",)])
def test_what_the_log_does_not_determine_takes_its_row_and_column(missing, left_out) -> None:
    errors = {f: missing if f in left_out else 0.1 for f in FIELDS if not (missing == "absent" and f in left_out)}
    found = correlation(MODEL, known(), errors, VALUES)
    assert found is not None
    kept = [k for k, f in enumerate(FIELDS) if f not in left_out]
    assert found.names == tuple(FIELDS[k].replace("__", ".") for k in kept)
    assert np.array(found.matrix) == pytest.approx(MATRIX[np.ix_(kept, kept)])
    assert set(found.logarithm) == {"alpha", "beta", "c"} - set(left_out)


def test_a_logarithm_of_which_nothing_is_known_takes_its_row_and_column() -> None:
    """Its draws would be any number; one searched as it is may be as uncertain as it likes."""
    for error, names in ((6.9, {"alpha", "beta"}), (7.1, {"beta"})):
        errors = {**dict.fromkeys(FIELDS, 0.1), "alpha": error, "sigma1": 1e3}
        found = correlation(MODEL, known(), errors, VALUES)
        assert found is not None
        assert {"alpha", "beta"} & set(found.names) == names
        assert "sigma1" in found.names


def test_nothing_known_is_no_correlation() -> None:
    assert correlation(MODEL, known(), {}, VALUES) is None
    assert correlation(MODEL, known(), dict.fromkeys(FIELDS, None), VALUES) is None


def test_rounding_is_taken_out_of_the_matrix() -> None:
    """Symmetric, ones on its diagonal, nothing beyond one."""
    rough = MATRIX + 1e-9 * np.random.default_rng(3).normal(size=MATRIX.shape)
    rough[0, 2], rough[2, 0] = -1.0 - 1e-7, -1.0 - 1e-8
    found = correlation(MODEL, known(rough), dict.fromkeys(FIELDS, 0.1), VALUES)
    assert found is not None
    matrix = np.array(found.matrix)
    assert (matrix == matrix.T).all()
    assert (np.diag(matrix) == 1.0).all()
    assert matrix[0, 2] == -1.0
    rest = np.abs(MATRIX) < 0.9
    assert matrix[rest] == pytest.approx(0.5 * (rough + rough.T)[rest], abs=1e-12)


def test_a_model_without_effects_has_its_own_names() -> None:
    model = kernel("PairedTsmBacklash")
    fields = ("c", "alpha")
    one = Uncertainty({}, (), np.array([[1.0, 0.5], [0.5, 1.0]]), fields, 1.0, 9.0, 1.0, {})
    found = correlation(model, one, {"c": 0.0, "alpha": 1.0}, {"c": 0.9, "alpha": 12.0})
    assert found is not None
    assert (found.names, found.matrix) == (("c", "alpha"), ((1.0, 0.5), (0.5, 1.0)))
