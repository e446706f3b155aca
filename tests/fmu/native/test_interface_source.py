"""The variable table in C as a compiler reads it, against the kernel's declarations."""

from __future__ import annotations

import ctypes
import math
import subprocess
from pathlib import Path

import numpy as np
import pytest

from tsm_fmu.fmu.description import interface
from tsm_fmu.fmu.native.interface_source import interface_files
from tsm_fmu.fmu.native.model_source import model_files
from tsm_fmu.fmu.native.types import c_variable
from tsm_fmu.fmu.native.zig import c_compiler
from tsm_fmu.kernels.chain import chain
from tsm_fmu.kernels.kernel import Kernel, kernel
from tsm_fmu.models import MODELS
from tsm_fmu.models.contract import bounds_in_words, sizes, with_unit

from .translated import LAYER

TOLD = """
#include "interface.h"
const int layout[] = {FIRST_INPUT, FIRST_OUTPUT, VARIABLES, MEASURED_TENSION, DISTAL_TENSION};
const char model_name[] = MODEL_NAME, model_guid[] = MODEL_GUID;
double started(int k) { return value_get(&model_start_values, k); }
double read_back(int k, double value)
{
    Values values = {0};
    value_put(&values, k, value);
    for (int other = 0; other < VARIABLES; other++) {
        if (other != k && value_get(&values, other) != 0.0) return -1.0;  /* two at one place */
    }
    return value_get(&values, k);
}
double sum_of(const double *outputs)
{
    Values values = {0};
    for (int k = FIRST_OUTPUT; k < VARIABLES; k++) value_put(&values, k, outputs[k - FIRST_OUTPUT]);
    return model_outputs_sum(&values.y);
}
"""


class Row(ctypes.Structure):
    _fields_ = (
        ("name", ctypes.c_char_p), ("unit", ctypes.c_char_p), ("meaning", ctypes.c_char_p),
        ("expected", ctypes.c_char_p), ("kind", ctypes.c_int), ("offset", ctypes.c_size_t), ("count", ctypes.c_size_t),
        ("lo", ctypes.c_double), ("hi", ctypes.c_double), ("open_lo", ctypes.c_bool), ("open_hi", ctypes.c_bool),
    )  # fmt: skip


def compiled(k: Kernel, fmi: int, folder: Path, starts: dict[str, float]) -> ctypes.CDLL:
    files = model_files(k) | interface_files(k.module, interface(k, "Named", starts), fmi) | {"told.c": TOLD}
    for name, text in files.items():
        (folder / name).write_text(text)
    flags = ("-std=c99", "-O0", "-fPIC", "-shared", "-Wall", "-Wextra", "-Werror", "-I", str(LAYER), "-I", str(folder))
    sources = [str(folder / name) for name in ("interface.c", "told.c")]
    done = subprocess.run(
        [*c_compiler(), *flags, *sources, "-lm", "-o", str(folder / "it.so")], capture_output=True, text=True
    )
    assert done.returncode == 0, done.stderr
    library = ctypes.CDLL(str(folder / "it.so"))
    for function in (library.started, library.read_back, library.sum_of):
        function.restype = ctypes.c_double
    return library


def heads(k: Kernel) -> list[int]:
    """Of each number: how many its FMI 3.0 variable has, 0 for the further items of an array."""
    groups = [n for part in ("Params", "Inputs", "Outputs") for n in sizes(getattr(k.module, part))]
    return [count for n in groups for count in ([n] + [0] * (n - 1) if n else [1])]


KERNELS = [*(Kernel(m) for m in MODELS), chain("TendonDrive", ("delay@x_out", "stribeck"))]


@pytest.mark.parametrize("k", KERNELS, ids=lambda k: k.name)
@pytest.mark.parametrize("fmi", [2, 3])
def test_every_variable_is_there_with_its_texts_kind_bounds_start_and_a_place_of_its_own(k, fmi, tmp_path) -> None:
    declared = (*k.parameters, *k.inputs, *k.outputs)
    given = {v.name: 1.25 * v.start + 0.0625 for v in k.parameters[:1] if v.kind is float}
    library = compiled(k, fmi, tmp_path, given)
    rows = (Row * len(declared)).in_dll(library, "model_variables")
    first_input, first_output = len(k.parameters), len(k.parameters) + len(k.inputs)
    places = {v.name: n for n, v in enumerate(declared)}
    slack = [places["T_in"], places["T_out"]] if {"T_in", "T_out"} <= set(places) else [-1, 0]
    layout = list((ctypes.c_int * 5).in_dll(library, "layout"))
    assert layout == [first_input, first_output, len(declared), *slack]
    assert ctypes.c_char_p(ctypes.addressof(ctypes.c_char.in_dll(library, "model_name"))).value == b"Named"
    for n, (v, row, head) in enumerate(zip(declared, rows, heads(k), strict=True)):
        q = v.quantity
        texts = (v.name, with_unit("", q.unit).rstrip(), q.meaning, bounds_in_words(q))
        assert tuple(t.decode() for t in (row.name, row.unit, row.meaning, row.expected)) == texts
        assert row.kind == (0 if v.kind is float else 2 if q.choices and fmi == 3 else 1)
        assert row.count == (head if fmi == 3 else 1)
        assert (row.lo, row.hi, row.open_lo, row.open_hi) == (q.lo, q.hi, q.open_lo, q.open_hi)
        start = given.get(v.name, v.start) if n < first_output else 0.0
        assert library.started(n) == float(start or 0)
        assert library.read_back(n, ctypes.c_double(3.0)) == 3.0
    outputs = np.random.default_rng(3).integers(1, 99, len(k.outputs)).astype(float)
    whole = np.ascontiguousarray(outputs)
    assert library.sum_of(whole.ctypes.data_as(ctypes.c_void_p)) == outputs.sum()


@pytest.mark.parametrize("k", KERNELS, ids=lambda k: k.name)
def test_the_compiler_is_told_of_exactly_the_parameters_that_are_never_zero(k) -> None:
    text = interface_files(k.module, interface(k, k.name, {}), 2)["interface.c"]
    told = [line.split("NEVER(p->")[1].split(" == 0.0")[0] for line in text.splitlines() if "NEVER(" in line]
    fields, places = k.module.Params, []
    for name, size in zip(fields._fields, sizes(fields), strict=True):
        places += [f"{c_variable(name)}.item[{n}]" for n in range(size)] if size else [c_variable(name)]
    declared = zip(k.parameters, places, strict=True)
    assert told == [place for v, place in declared if v.kind is float and not admits_zero(v.quantity)]


def admits_zero(quantity) -> bool:
    if quantity.lo > 0.0 or quantity.hi < 0.0:
        return False
    return not ((quantity.lo == 0.0 and quantity.open_lo) or (quantity.hi == 0.0 and quantity.open_hi))


@pytest.mark.parametrize("start", [math.inf, -math.inf, math.nan])
def test_a_start_value_that_is_no_number_is_refused(start: float) -> None:
    k = kernel("PairedTsmBacklash")
    with pytest.raises(ValueError, match=f"start of alpha = {start!r}"):
        interface_files(k.module, interface(k, k.name, {"alpha": start}), 2)
