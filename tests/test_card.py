"""Model card: what is written is what is read, and every malformed card is one line that names the key."""

from __future__ import annotations

import math
import tomllib
from dataclasses import replace
from pathlib import Path

import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from tsm_fmu.card import FORMAT, CardParameter, Correlation, ModelCard, Provenance, RecordUsed, read_card, write_card
from tsm_fmu.models.contract import InputError

CARD = ModelCard(
    model="PairedTsmBacklash",
    preset="published",
    parameters={
        "c": CardParameter(0.9137, "1", 0.0021, 0.0, math.inf),
        "beta": CardParameter(-0.4871, "1", 1.7e-3, -math.inf, 0.0),
        "alpha": CardParameter(17.33, "1/rad", None, 0.0, math.inf, fixed=True),
        "x_0": CardParameter(-1.2561, "rad", 3.1e-4),
    },
    per_run={'T4L4/00 "cold".csv': {"x_0": -1.2617}, "01": {"x_0": -1.2505}},
    provenance=Provenance(
        (RecordUsed("00", "ab" * 32), RecordUsed("01", "0c" * 32, "holdout")), "0.1.0", 7, "", "fast"
    ),
)


def written(tmp_path: Path, card: ModelCard = CARD) -> Path:
    path = tmp_path / "card.toml"
    write_card(path, card)
    return path


def test_written_card_reads_back_equal(tmp_path: Path) -> None:
    assert read_card(written(tmp_path)) == CARD


@pytest.mark.parametrize("unit", ["N.m.s/rad", "N.m/(rad/s)"])
def test_a_unit_in_another_form_of_the_same_text_is_read(tmp_path: Path, unit: str) -> None:
    values = {"viscous.f_v": CardParameter(0.0137, unit, 0.0021, 0.0, math.inf)}
    card = read_card(written(tmp_path, ModelCard("TendonDrive", effects=("viscous",), parameters=values)))
    assert card.kernel().named(card.params())["viscous.f_v"] == 0.0137
    wrong = {"viscous.f_v": CardParameter(0.0137, "N.m/(s/rad)", 0.0021, 0.0, math.inf)}
    with pytest.raises(InputError, match=r"unit = 'N\.m/\(s/rad\)' -- expected 'N\.m\.s/rad'"):
        read_card(written(tmp_path, ModelCard("TendonDrive", effects=("viscous",), parameters=wrong)))


def test_parameters_of_one_run_replace_the_shared_value(tmp_path: Path) -> None:
    card = read_card(written(tmp_path))
    assert card.params().x_0 == -1.2561
    assert card.params("01").x_0 == -1.2505
    assert card.params("01").alpha == 17.33
    with pytest.raises(InputError, match=r"run '02' -- expected one of .*01"):
        card.params("02")


@settings(deadline=None, derandomize=True, database=None)
@given(st.text(), st.floats(allow_nan=False, allow_infinity=False))
def test_any_run_name_and_number_survive(tmp_path_factory: pytest.TempPathFactory, name: str, value: float) -> None:
    path = tmp_path_factory.getbasetemp() / "any.toml"
    write_card(path, ModelCard("PairedTsmBacklash", per_run={name: {"x_0": value}}))
    assert tomllib.loads(path.read_text(encoding="utf-8"))["per_run"][name]["x_0"] == value


@pytest.mark.parametrize(
    ("old", "new", "message"),
    [
        ("format = 2", "format = 3", r"format = 3 -- expected format 1 or 2"),
        ("format = 2\n", "", r"no key format -- expected an integer"),
        ('model = "PairedTsmBacklash"\n', "", r"no key model -- expected a string"),
        ('"PairedTsmBacklash"', '"PairedTsm"', r"model 'PairedTsm' -- expected one of .*PairedTsmBacklash"),
        ('"published"', '"measured"', r"preset 'measured' of PairedTsmBacklash -- expected one of published"),
        ("effects = []", 'effects = ["creap"]', r"creap"),
        ("effects = []", "effects = [3]", r"effects = \[3\] -- expected a list of effect ids"),
        ("effects = []", "efects = []", r"efects = \[\] -- expected one of the keys format, model"),
        ("value = 0.9137", 'value = "0.9137"', r"parameters\.c\.value = '0\.9137' -- expected a number"),
        ("value = 0.9137\n", "", r"no key parameters\.c\.value -- expected a number"),
        ("value = 0.9137", "value = -0.9137", r"parameters\.c\.value = -0\.9137 -- expected a value in its own bounds"),
        ("value = 0.9137", "value = nan", r"parameters\.c\.value = nan -- expected a value in its own bounds"),
        ("value = -0.4871", "value = -0.94", r"beta = -0\.94 with c = 0\.9137 gives B .* expected B > 0"),
        ("stderr = 0.0021", "stderr = -0.0021", r"parameters\.c\.stderr = -0\.0021 -- expected a number that is not"),
        ("fixed = true", "fixed = 1", r"parameters\.alpha\.fixed = 1 -- expected true or false"),
        ('unit = "1/rad"', 'unit = "1/deg"', r"parameters\.alpha\.unit = '1/deg' -- expected '1/rad', cards are in SI"),
        ("[parameters.x_0]", "[parameters.x0]", r"parameters\.x0 -- expected one of c, beta, alpha, x_0, x_h_0"),
        ("x_0 = -1.2505", "x0 = -1.2505", r"per_run\.01: parameter 'x0' of PairedTsmBacklash -- expected one of"),
        ("x_0 = -1.2505", "x_0 = nan", r"per_run\.01: parameter x_0 = nan"),
        ("0c" * 32, "0g" * 32, r"provenance\.records\[1\]\.sha256 = '0g.* -- expected 64 hexadecimal digits"),
        ('"holdout"', '"test"', r"provenance\.records\[1\]\.role = 'test' -- expected 'measured' or 'holdout'"),
        ("seed = 7", "seed = 7.5", r"provenance\.seed = 7\.5 -- expected an integer"),
        ("seed = 7", "seed = = 7", r"line \d+.* -- expected TOML"),
        ("[provenance]", "[[provenance]]", r"provenance = \[.* -- expected a table"),
    ],
)
def test_malformed_card_names_the_key(tmp_path: Path, old: str, new: str, message: str) -> None:
    path = written(tmp_path)
    text = path.read_text(encoding="utf-8")
    assert old in text
    path.write_text(text.replace(old, new, 1), encoding="utf-8")
    with pytest.raises(InputError, match=message) as caught:
        read_card(path)
    assert str(path) in str(caught.value)
    assert "\n" not in str(caught.value)


def test_missing_binary_and_unwritable_files(tmp_path: Path) -> None:
    with pytest.raises(InputError, match=r"none\.toml -- expected a readable file \(No such file"):
        read_card(tmp_path / "none.toml")
    (tmp_path / "binary.toml").write_bytes(b"format = \xff\xfe")
    with pytest.raises(InputError, match=r"binary\.toml -- expected UTF-8 text \(byte 9\)"):
        read_card(tmp_path / "binary.toml")
    with pytest.raises(InputError, match=r"binary\.toml.card\.toml could not be written"):
        write_card(tmp_path / "binary.toml" / "card.toml", CARD)


def test_reading_never_runs_what_the_card_says(tmp_path: Path) -> None:
    path = tmp_path / "card.toml"
    path.write_text('format = 1\nmodel = "os.system"\n', encoding="utf-8")
    with pytest.raises(InputError, match=r"model 'os\.system' -- expected one of"):
        read_card(path)


ERRORS = Correlation(("c", "x_0", "beta"), ((1.0, 0.3, -0.2), (0.3, 1.0, 0.0), (-0.2, 0.0, 1.0)), ("c", "beta"))
KNOWN = replace(CARD, correlation=ERRORS)
ALONG = ((1.0, 1.0, 0.0), (1.0, 1.0, 0.0), (0.0, 0.0, 1.0))
"""Two parameters that are known as one: the smallest eigenvalue is 0."""


@pytest.mark.parametrize("errors", [ERRORS, replace(ERRORS, matrix=ALONG), Correlation((), (), ())])
def test_correlations_read_back_equal(tmp_path: Path, errors: Correlation) -> None:
    assert read_card(written(tmp_path, replace(KNOWN, correlation=errors))).correlation == errors


BAD_CORRELATIONS = {
    "twice": ({"names": ("c", "c", "beta")}, r"correlation\.names = .* that have a stderr \(c, beta, x_0\), each once"),
    "no error": ({"names": ("c", "x_0", "alpha")}, r"correlation\.names"),
    "not of the names": ({"logarithm": ("c", "alpha")}, r"correlation\.logarithm = .* some of its names"),
    "a row less": ({"matrix": ERRORS.matrix[:2]}, r"correlation\.matrix = .* expected 3 rows of 3 numbers"),
    "a row more": ({"matrix": (*ERRORS.matrix, ERRORS.matrix[0])}, r"expected 3 rows of 3 numbers"),
    "too long": ({"matrix": (*ERRORS.matrix[:2], (-0.2, 0.0, 1.0, 0.0))}, r"expected 3 rows of 3 numbers"),
    "too short": ({"matrix": (*ERRORS.matrix[:2], (-0.2, 0.0))}, r"expected 3 rows of 3 numbers"),
    "no rows": ({"matrix": (1.0, 0.3, -0.2)}, r"expected 3 rows of 3 numbers"),
    "words": ({"matrix": (*ERRORS.matrix[:2], (-0.2, 0.0, "one"))}, r"expected 3 rows of 3 numbers"),
    "yes or no": ({"matrix": (*ERRORS.matrix[:2], (-0.2, 0.0, True))}, r"expected 3 rows of 3 numbers"),
    "not finite": ({"matrix": (*ERRORS.matrix[:2], (-0.2, math.nan, 1.0))}, r"expected a correlation: symmetric"),
    "not symmetric": ({"matrix": (*ERRORS.matrix[:2], (-0.2, 1e-3, 1.0))}, r"expected a correlation: symmetric"),
    "not 1": ({"matrix": (*ERRORS.matrix[:2], (-0.2, 0.0, 1.001))}, r"expected a correlation: symmetric, 1 on the"),
    "not positive": (
        {"matrix": ((1.0, 0.8, -0.8), (0.8, 1.0, 0.8), (-0.8, 0.8, 1.0))}, r"no negative eigenvalue"
    ),
    "slightly negative": (
        {"matrix": ((1.0, 1.0005, 0.0), (1.0005, 1.0, 0.0), (0.0, 0.0, 1.0))}, r"no negative eigenvalue"
    ),
}  # fmt: skip


@pytest.mark.parametrize("what", BAD_CORRELATIONS)
def test_what_is_no_correlation_is_refused_with_its_key(tmp_path: Path, what: str) -> None:
    change, message = BAD_CORRELATIONS[what]
    with pytest.raises(InputError, match=message) as caught:
        read_card(written(tmp_path, replace(KNOWN, correlation=replace(ERRORS, **change))))
    assert "\n" not in str(caught.value)


def test_a_logarithm_needs_a_value_that_is_not_zero(tmp_path: Path) -> None:
    at_zero = {**CARD.parameters, "x_0": CardParameter(0.0, "rad", 3.1e-4)}
    card = replace(KNOWN, parameters=at_zero)
    assert read_card(written(tmp_path, card)) == card
    with pytest.raises(
        InputError, match=r"correlation\.logarithm = \['x_0'\] -- expected some of its names, of values"
    ):
        read_card(written(tmp_path, replace(card, correlation=replace(ERRORS, logarithm=("x_0",)))))


@pytest.mark.parametrize(
    ("value", "lo", "hi", "inside"),
    [(0.9, 0.9, 1.0, True), (0.9, 0.8, 0.9, True), (0.9, 0.9000001, 1.0, False), (0.9, 0.8, 0.8999999, False)],
)
def test_a_value_may_stand_on_its_own_bounds_and_not_beyond(
    tmp_path: Path, value: float, lo: float, hi: float, inside: bool
) -> None:
    card = replace(CARD, parameters={**CARD.parameters, "c": CardParameter(value, "1", 0.0, lo, hi)})
    if inside:
        assert read_card(written(tmp_path, card)) == card
        return
    with pytest.raises(InputError, match=r"parameters\.c\.value = 0\.9 -- expected a value in its own bounds"):
        read_card(written(tmp_path, card))


def test_a_card_of_the_least_says_nothing_of_the_rest(tmp_path: Path) -> None:
    path = tmp_path / "least.toml"
    path.write_text('format = 1\nmodel = "PairedTsmBacklash"\n[parameters.c]\nvalue = 1\nunit = "1"\n')
    card = read_card(path)
    assert card.parameters == {"c": CardParameter(1.0, "1", None, -math.inf, math.inf, fixed=False)}
    assert (card.preset, card.effects, card.per_run, card.correlation, card.version) == ("", (), {}, None, FORMAT)
    assert card.provenance == Provenance((), "", 0, "", "")
    for version in (0, 3):
        path.write_text(f'format = {version}\nmodel = "PairedTsmBacklash"\n')
        with pytest.raises(
            InputError, match=rf"format = {version} -- expected format 1 or 2, which this version reads"
        ):
            read_card(path)
