"""Model card: what is written is what is read, and every malformed card is one line that names the key."""

from __future__ import annotations

import math
import tomllib
from pathlib import Path

import pytest
from hypothesis import given
from hypothesis import strategies as st

from tsm_fmu.card import CardParameter, ModelCard, Provenance, RecordUsed, read_card, write_card
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
