"""Unit texts: what people write, what FMI writes, and what must not be guessed."""

import math
from pathlib import Path

import pytest

from tsm_fmu.kernels.compiled_cache import VARIABLE
from tsm_fmu.kernels.kernel import Kernel
from tsm_fmu.logs import units
from tsm_fmu.logs.units import same_quantity, unit_to_si
from tsm_fmu.models import MODELS
from tsm_fmu.models.contract import InputError

KNOWN = {
    "deg": ("rad", math.pi / 180), "°": ("rad", math.pi / 180), "turn": ("rad", 2 * math.pi),
    "arcmin": ("rad", math.pi / 10800),
    "rpm": ("rad/s", math.pi / 30), "deg/s^2": ("rad/s2", math.pi / 180), "rad/s²": ("rad/s2", 1.0),
    "Nm": ("N.m", 1.0), "mNm": ("N.m", 1e-3), "Nmm": ("N.m", 1e-3), "N-m": ("N.m", 1.0), "N·m": ("N.m", 1.0),
    "N m": ("N.m", 1.0),
    "kN.m/rad": ("N.m/rad", 1e3), "N.m.s/rad": ("N.m.s/rad", 1.0), "kg.cm2": ("kg.m2", 1e-4), "mm/s2": ("m/s2", 1e-3),
    "lbf.in": ("N.m", 4.4482216152605 * 0.0254), "kgf*cm": ("N.m", 0.0980665), "µm": ("m", 1e-6), "us": ("s", 1e-6),
    "%": ("1", 1e-2), "1": ("1", 1.0), "-": ("1", 1.0), "mA": ("A", 1e-3), "1/rad": ("1/rad", 1.0),
    "s2/m": ("s2/m", 1.0),
}  # fmt: skip


@pytest.mark.parametrize("text", KNOWN)
def test_known(text):
    si, factor = KNOWN[text]
    unit = unit_to_si(text)
    assert unit.si == si
    assert unit.factor == pytest.approx(factor, rel=1e-13)
    assert unit.offset == 0.0


def test_celsius_has_an_offset():
    unit = unit_to_si("degC")
    assert (unit.si, unit.factor, unit.offset) == ("K", 1.0, 273.15)
    fahrenheit = unit_to_si("degF")
    assert fahrenheit.factor * 212.0 + fahrenheit.offset == pytest.approx(373.15, rel=1e-12)


@pytest.mark.parametrize("text", ["blah", "2*rad", "(", "dB", "m**", "x" * 500, "", " ", "__import__('os')", "rad)"])
def test_unknown(text):
    with pytest.raises(InputError, match="-- expected a unit that pint knows"):
        unit_to_si(text)


@pytest.mark.parametrize("text", ["C", "F", "oz.in", "kg.cm", "lb-in"])
def test_ambiguous(text):
    with pytest.raises(InputError, match="-- expected one meaning -- write "):
        unit_to_si(text)


def test_radian_is_a_quantity_of_its_own():
    assert not same_quantity("Hz", "rad/s")
    assert not same_quantity("1", "rad")
    assert not same_quantity("N.m/rad", "N.m")
    assert same_quantity("rpm", "rad/s")
    assert same_quantity("lbf.in", "N.m")


def test_every_declared_unit_is_read_and_coherent():
    units = {v.quantity.unit for m in MODELS for v in (*Kernel(m).inputs, *Kernel(m).outputs, *Kernel(m).parameters)}
    assert len(units) > 10
    for unit in sorted(units):
        found = unit_to_si(unit)
        assert (found.factor, found.offset) == (1.0, 0.0), unit
        assert same_quantity(found.si, unit), unit


@pytest.fixture
def kept_units(tmp_path: Path, monkeypatch: pytest.MonkeyPatch):
    """``kept_units()``: the files that processes keep of pint's definitions, in a folder of this test."""
    monkeypatch.setenv(VARIABLE, str(tmp_path / "kept"))
    units._registry.cache_clear()
    yield lambda: sorted((tmp_path / "kept").glob("units-*/*.pickle"))
    units._registry.cache_clear()


def length_of_an_inch() -> float:
    """As a new process has it."""
    units._registry.cache_clear()
    return units._registry().Quantity(1.0, "inch").to("m").magnitude


def test_definitions_are_kept_for_later_processes(kept_units) -> None:
    assert length_of_an_inch() == pytest.approx(0.0254)
    (*_, last) = files = kept_units()
    before = last.read_bytes(), last.stat().st_mtime_ns
    assert length_of_an_inch() == pytest.approx(0.0254)
    assert kept_units() == files
    assert (last.read_bytes(), last.stat().st_mtime_ns) == before


@pytest.mark.parametrize("damage", [b"", b"no pickle", None])
def test_definitions_that_are_damaged_are_read_anew(kept_units, damage: bytes | None) -> None:
    assert length_of_an_inch() == pytest.approx(0.0254)
    for path in kept_units():
        path.write_bytes(path.read_bytes()[:-20] if damage is None else damage)
    assert length_of_an_inch() == pytest.approx(0.0254)
    assert kept_units() == []
    assert length_of_an_inch() == pytest.approx(0.0254)
    assert kept_units()


def test_where_nothing_is_or_can_be_kept_units_are_read_all_the_same(
    kept_units, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    (tmp_path / "kept").write_text("a file where the folder would be")
    assert length_of_an_inch() == pytest.approx(0.0254)
    monkeypatch.setenv(VARIABLE, "")
    assert length_of_an_inch() == pytest.approx(0.0254)
    assert kept_units() == []
