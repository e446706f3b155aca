"""Columns of a log that drive effects: how they are written, what they may be; chain, card and FMU have them."""

from __future__ import annotations

from pathlib import Path

import numpy as np
import pytest
from fmpy import read_model_description

from tsm_fmu.card import ModelCard, read_card, write_card
from tsm_fmu.effects import EFFECTS, id_of, place_of, words
from tsm_fmu.fmu.build import build_fmu
from tsm_fmu.fmu.native.zig import loaded_here
from tsm_fmu.kernels import compiled_cache
from tsm_fmu.kernels.chain import attach, chain
from tsm_fmu.kernels.drives import Drive, read_drives, text_of
from tsm_fmu.kernels.kernel import kernel
from tsm_fmu.models.contract import InputError


@pytest.mark.parametrize(
    ("text", "canonical"),
    [
        ("load_dependence~T_in", "load_dependence~T_in[N]"),
        ("load_dependence~load=T_in[N]", "load_dependence~T_in[N]"),
        ("load_dependence~load=p[V]", "load_dependence~load=p[V]"),
        ("bend_angle~Theta[rad]", "bend_angle"),
        ("bend_angle~q[rad],f[N.m]", "bend_angle~f[N.m],q[rad]"),
        ("offset_drift@F", "offset_drift@F"),
        ("temperature_dependence~temperature", "temperature_dependence"),
        ("temperature_dependence~oil[K]", "temperature_dependence~oil[K]"),
        ("drum_periodic@F~phi[rad]", "drum_periodic@F~phi[rad]"),
    ],
)
def test_a_spec_has_one_form(text: str, canonical: str) -> None:
    one = attach(kernel("LuGreFriction"), text)
    assert one.spec == canonical
    assert attach(kernel("LuGreFriction"), canonical) == one
    assert read_drives(text_of(one.drives, one.module), one.module) == one.drives
    assert id_of(canonical) == text.partition("~")[0].partition("@")[0]
    assert place_of(canonical)[1] == one.channel


def test_words_say_what_drives() -> None:
    assert words("load_dependence~T_in[N]") == "load-dependent friction, driven by T_in"
    assert words("bend_angle~f[N],bend=q[V]") == "bend-dependent friction, driven by f and q"
    on_motion = "lost motion that grows with the sheath's bend in x_out, driven by f and q"
    assert words("bend_angle@x_out~f[N],bend=q[V]") == on_motion


@pytest.mark.parametrize(
    ("text", "said"),
    [
        ("load_dependence", "needs a load, which LuGreFriction has not"),
        ("load_dependence~foo", "expected its unit"),
        ("load_dependence~foo[V]", "it takes load"),
        ("load_dependence~bend=foo[rad]", "drives load_dependence as bend"),
        ("load_dependence~a[N],b[N]", "expected one column as load"),
        ("load_dependence~my load[N]", "expected a name"),
        ("load_dependence~sigma0[N]", "sigma0 is its own"),
        ("viscous~T_in[N]", "it takes nothing measured"),
        ("temperature_dependence~temperature=oil[V]", "expected K, to which degC is brought"),
    ],
)
def test_what_cannot_drive_is_one_line(text: str, said: str) -> None:
    with pytest.raises(InputError, match=r" -- .+ -- ") as caught:
        chain("LuGreFriction", (text,))
    assert said in str(caught.value)
    assert "\n" not in str(caught.value)


@pytest.mark.parametrize("module", [m for m in EFFECTS if "load" in m.Inputs._fields], ids=lambda m: m.NAME)
def test_a_column_does_what_the_models_own_load_does(module) -> None:
    """TendonDrive's load as its input and as a column of another name: the same bits."""
    rng = np.random.default_rng(8)
    t, inputs = np.arange(120) * 0.0113, np.cumsum(rng.normal(size=(120, 2)), axis=0)
    own = chain("TendonDrive", (module.NAME,))
    other = chain("TendonDrive", (f"{module.NAME}~{'Theta[rad],' if 'bend' in module.Inputs._fields else ''}f[N.m]",))
    size = next(v.name for v in own.parameters if v.name.endswith(tuple(f".{f}" for f in module.Params._fields)))
    values = {size: 0.07}
    angle = rng.random((120, 1)) if "bend" in module.Inputs._fields else np.empty((120, 0))
    names = [v.name for v in other.inputs]
    columns = np.column_stack([inputs, angle, inputs[:, 1]])
    order = ["x_in", "tau_out", *(["Theta"] if angle.size else []), "f"]
    assert sorted(names) == sorted(order)
    one = own.simulate(own.params(None, values), t, np.column_stack([inputs, angle]))
    two = other.simulate(other.params(None, values), t, columns[:, [order.index(n) for n in names]])
    assert np.array_equal(one, two)
    still = kernel("TendonDrive")
    assert not np.array_equal(one, still.simulate(still.params(None, {}), t, inputs))


@pytest.mark.parametrize(("flavour", "fmi"), [("python", 2), ("native", 2), ("native", 3)])
def test_card_and_fmu_have_the_input(tmp_path: Path, flavour: str, fmi: int) -> None:
    specs = ("load_dependence~T_in[N]", "stiffness_hardening~x[m]")
    path = write_card(tmp_path / "card.toml", ModelCard("LuGreFriction", effects=specs))
    found = read_card(tmp_path / "card.toml").kernel()
    assert found.module.EFFECTS == specs, path
    assert [(v.name, v.quantity.unit) for v in found.inputs] == [("v", "m/s"), ("T_in", "N"), ("x", "m")]
    fmu = build_fmu(found, tmp_path / "f.fmu", flavour=flavour, fmi=fmi, platforms=loaded_here(fmi))
    described = read_model_description(str(fmu)).modelVariables
    assert {(v.name, v.unit) for v in described if v.causality == "input"} == {("v", "m/s"), ("T_in", "N"), ("x", "m")}


def test_inputs_that_no_effect_uses_change_nothing() -> None:
    rng = np.random.default_rng(31)
    t, inputs = np.arange(90) * 0.0113, rng.normal(size=(90, 3))
    plain = chain("LuGreFriction", ("coulomb",))
    listening = chain("LuGreFriction", ("coulomb",), (Drive("load", "T_in", "N"), Drive("bend", "q", "rad")))
    assert [v.name for v in listening.inputs] == ["v", "T_in", "q"]
    found = listening.simulate(listening.params(None, {}), t, inputs)
    assert np.array_equal(found, plain.simulate(plain.params(None, {}), t, inputs[:, :1]))


def test_a_chain_driven_by_a_column_is_made_where_nothing_can_be_kept(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(compiled_cache, "folder", lambda: None)
    k = chain("LuGreFriction", ("load_dependence~T_nowhere[N]",))
    assert (k.inputs[-1].name, k.inputs[-1].quantity.unit) == ("T_nowhere", "N")
    assert k.module.__file__ == f"<{k.module.__name__.rpartition('.')[2]}>"


@pytest.mark.parametrize(("flavour", "fmi"), [("python", 2), ("native", 3)])
def test_a_temperature_that_nobody_connects_is_that_of_a_room(tmp_path: Path, flavour: str, fmi: int) -> None:
    k = chain("TendonDrive", ("temperature_dependence~oil[K]",))
    fmu = build_fmu(k, tmp_path / "f.fmu", flavour=flavour, fmi=fmi, platforms=loaded_here(fmi))
    starts = {v.name: v.start for v in read_model_description(str(fmu)).modelVariables if v.causality == "input"}
    assert float(starts["oil"]) == 293.15
    assert float(starts["x_in"]) == 0.0
    rng, t = np.random.default_rng(5), np.arange(90) * 0.0113
    inputs = np.column_stack([np.cumsum(rng.normal(size=(90, 2)), axis=0), np.full(90, 293.15)])
    warm = k.simulate(k.params(None, {"temperature_dependence.beta": 0.037}), t, inputs)
    assert np.array_equal(warm, kernel("TendonDrive").simulate(kernel("TendonDrive").params(), t, inputs[:, :2]))
