"""``MODEL[:PRESET][+EFFECT...]`` and cards on the command line."""

import json

import numpy as np
import pytest

from tsm_fmu import InputError
from tsm_fmu.card import read_card
from tsm_fmu.cli.app import run
from tsm_fmu.logs.record import write_record
from tsm_fmu.verbs.models import resolve_model


def test_effects_are_attached_in_order():
    resolved = resolve_model("TendonDrive:published+load_dependence+tendon_elasticity@x_out")
    assert resolved.effects == ("load_dependence", "tendon_elasticity@x_out")
    assert resolved.preset == "published"
    assert "load_dependence.k" in {v.name for v in resolved.kernel.parameters}


@pytest.mark.parametrize(
    ("text", "message"),
    [
        ("Nothing", "model 'Nothing' -- expected one of"),
        ("TendonDrive:odd", "preset 'odd' of TendonDrive -- expected one of published"),
        ("TendonDrive+odd", "effect 'odd' -- expected one of coulomb"),
        ("TendonDrive+", "effect '' -- expected one of coulomb"),
        ("missing.toml", "missing.toml"),
    ],
)
def test_what_cannot_be_read_is_named(text, message):
    with pytest.raises(InputError, match=message):
        resolve_model(text)


def test_a_card_of_a_model_with_effects_serves_every_verb(tmp_path, capsys):
    """Identify with an effect, simulate the card, export it, simulate the FMU: the same numbers."""
    time = np.arange(6000) * 2e-3
    x = 0.5 * np.sin(2.1 * time) + 0.2 * np.sin(5.3 * time)
    rng = np.random.default_rng(8)
    side = np.tanh(40.0 * np.gradient(x, time))
    load = 0.1 + 0.06 * np.sin(0.9 * time)
    tau_in = 0.93 * load + (0.02 + 0.31 * load) * side + 1e-4 * rng.normal(size=time.size)
    log = write_record(
        tmp_path / "run.csv",
        time,
        {"x_in": x, "tau_out": load, "tau_in": tau_in},
        {"x_in": "rad", "tau_out": "N.m", "tau_in": "N.m"},
    )
    card, fmu = tmp_path / "card.toml", tmp_path / "Loaded.fmu"
    assert run(["identify", "TendonDrive+load_dependence", "--measured", str(log), "--out", str(card), "--json"]) == 0
    capsys.readouterr()
    assert read_card(card).effects == ("load_dependence",)
    assert read_card(card).parameters["load_dependence.k"].value == pytest.approx(0.31, abs=0.03)
    assert run(["export", str(card), "--out", str(fmu)]) == 0
    capsys.readouterr()
    errors = []
    for what in (card, fmu):
        assert run(["simulate", str(what), "--input", str(log), "--out", str(tmp_path / "r.csv"), "--json"]) == 0
        errors.append(json.loads(capsys.readouterr().out)["channels"]["tau_in"]["rmse"])
    assert errors[0] == pytest.approx(errors[1], rel=1e-9)
    assert errors[0] < 0.01
