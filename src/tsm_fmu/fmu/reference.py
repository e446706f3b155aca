"""Reference results inside an FMU, after the FMI layered standard for references (FMI-LS-REF 1.0.0-beta).

``extra/org.fmi-standard.fmi-ls-ref/`` holds a manifest with a checksum of each file, two experiments (a short
smoke test and the whole validation), the parameter set that they use, the stimuli and the results. The results are
the kernel's, in plain Python, not those of an FMU.

A kernel's input row k+1 belongs to the step from t_k to t_k+1, while FMPy's ``simulate_fmu`` sets row k of the
stimuli before that step. The stimuli are therefore one row early: their row k is the kernel's row k+1. Row 0 must also
be the kernel's row 0, where the motion starts, so those two are equal; the last row is written twice.
"""

from __future__ import annotations

import hashlib
from collections.abc import Iterable, Mapping
from dataclasses import dataclass
from typing import Any
from xml.etree.ElementTree import Element, SubElement

import numpy as np

from ..kernels.arrays import FloatArray
from ..kernels.kernel import Kernel
from ..models.contract import InputError
from .accompanying import document
from .description import Interface, number_text
from .stimuli import ROWS, STEP, stimuli

FOLDER = "extra/org.fmi-standard.fmi-ls-ref"
MANIFEST = f"{FOLDER}/fmi-ls-manifest.xml"
TOLERANCE = 1e-9
"""Of a result, as a part of the largest magnitude in its column: it leaves room for another libm."""
SMOKE_ROWS = 65

MANIFEST_NAMESPACE = "http://fmi-standard.org/fmi-ls-manifest"
PARAMETER_TYPE = "application/x-ssp-parameter-set"
EXPERIMENT_TYPE = "application/x-ma-hs-experiments"
_SSP = "http://ssp-standard.org/SSP1/SystemStructure"
_DIGITS = {"stimuli": 9, "result": 13}


@dataclass(frozen=True)
class Reference:
    """The reference experiment of a kernel with the parameters of an FMU.

    Attributes
    ----------
    kernel : Kernel
        What was simulated.
    inputs : list of list of str
        Stimuli as they are printed, row by row, not shifted.
    results : FloatArray
        Outputs, row by row.
    """

    kernel: Kernel
    inputs: list[list[str]]
    results: FloatArray

    def largest(self) -> dict[str, float]:
        """Largest magnitude of each input and output."""
        names = [v.name for v in (*self.kernel.inputs, *self.kernel.outputs)]
        columns = [*np.abs(np.array(self.inputs, dtype=float)).T, *np.abs(self.results).T]
        return {name: float(column.max()) for name, column in zip(names, columns, strict=True)}


def reference_files(fmu: Interface, reference: Reference, arrays: bool = False) -> dict[str, str]:
    """Files of the reference by archive path, for an FMU with this name and variable table.

    Where its arrays are one variable each (``arrays``), they are not in the parameter set: SSP 1.0 has none.
    """
    kernel, inputs, results = reference.kernel, reference.inputs, reference.results
    parameters, given, expected = "parameters.ssv", f"{fmu.name}_in.csv", f"{fmu.name}_out.csv"
    texts = {
        parameters: document(_parameter_set(fmu, arrays)),
        expected: _csv([v.name for v in kernel.outputs], _result_rows(kernel, results)),
    }
    if kernel.inputs:
        shifted = [*inputs[1:], inputs[-1]]
        texts[given] = _csv([v.name for v in kernel.inputs], shifted)
    related = {
        parameters: ("parameter", PARAMETER_TYPE, "Start values of the FMU"),
        given: ("other", "text/csv", "Stimuli: row k holds from its time to that of row k+1"),
        expected: ("result", "text/csv", "Results of the kernel at the times of the stimuli"),
    }
    for file, role, rows in (
        ("smoke_test.exp", "experiment/smoke-test", SMOKE_ROWS),
        ("validation.exp", "experiment/validation", ROWS),
    ):
        texts[file] = document(_experiment(role, rows, parameters, given if given in texts else "", expected))
        related[file] = (role, EXPERIMENT_TYPE, f"The first {rows} rows of stimuli and results")
    manifest = _manifest({file: (*related[file], text) for file, text in sorted(texts.items())})
    return {f"{FOLDER}/{file}": text for file, text in texts.items()} | {
        MANIFEST: document(manifest),
        "documentation/fmi-ls-ref.html": _DOCUMENTATION.format(name=fmu.name, tolerance=TOLERANCE, step=STEP),
    }


def reference_run(kernel: Kernel, params: Any) -> Reference:
    """Simulate the reference experiment; with smaller stimuli where a fitted model fails on the usual ones.

    Raises
    ------
    InputError
        If the kernel fails with these parameters however small the stimuli are.
    """
    time = STEP * np.arange(ROWS)
    reason = "its outputs are not finite"
    for halvings in range(10):
        printed = [[_number(x, "stimuli") for x in row] for row in stimuli(kernel, 0.5**halvings)]
        u = np.array(printed, dtype=float).reshape(ROWS, len(kernel.inputs))
        try:
            results = kernel.simulate(params, time, u, compiled=False)
        except InputError as failure:
            reason = str(failure)
            continue
        if np.isfinite(results).all():
            return Reference(kernel, printed, results)
    raise InputError(
        f"{kernel.name} fails on its reference experiment, however small the inputs ({reason}) -- expected parameters "
        "that simulate -- change the start values"
    )


def _number(x: float, kind: str) -> str:
    return format(x + 0.0, f".{_DIGITS[kind]}g")  # + 0.0: no minus zero


def _result_rows(kernel: Kernel, results: FloatArray) -> list[list[str]]:
    kinds = [v.kind for v in kernel.outputs]
    return [
        [str(int(x)) if k is int else _number(x, "result") for k, x in zip(kinds, row, strict=True)] for row in results
    ]


def _csv(names: Iterable[str], rows: Iterable[Iterable[str]]) -> str:
    """The form of the FMI cross-check rules, which FMPy and other tools read."""
    lines = [",".join(f'"{name}"' for name in ("time", *names))]
    lines += [",".join((repr(k * STEP), *row)) for k, row in enumerate(rows)]
    return "\n".join(lines) + "\n"


def _parameter_set(fmu: Interface, arrays: bool) -> Element:
    root = Element(
        "ssv:ParameterSet",
        {"xmlns:ssv": f"{_SSP}ParameterValues", "xmlns:ssc": f"{_SSP}Common", "version": "1.0", "name": "start values"},
    )
    listed = SubElement(root, "ssv:Parameters")
    items = {f"{name}_{n + 1}" for name, size in fmu.arrays.values() for n in range(size)} if arrays else set()
    for entry in fmu.entries:
        if entry.causality == "parameter" and entry.variable.name not in items:
            node = SubElement(listed, "ssv:Parameter", name=entry.variable.name)
            kind = entry.variable.kind
            SubElement(node, "ssv:Integer" if kind is int else "ssv:Real", value=number_text(kind, entry.start))
    return root


def _experiment(role: str, rows: int, parameters: str, given: str, expected: str) -> Element:
    name = role.partition("/")[2]
    root = Element("Experiments", name=name)
    node = SubElement(
        root,
        "Experiment",
        name=name,
        description=(
            "A result may differ from its reference by the tolerance times the largest magnitude in its column"
        ),
        startTime="0.0",
        stopTime=repr((rows - 1) * STEP),
        stepSize=repr(STEP),
        tolerance=repr(TOLERANCE),
    )
    SubElement(node, "Parameters", source=parameters, type=PARAMETER_TYPE)
    if given:
        SubElement(node, "Stimuli", source=given, type="text/csv")
    SubElement(node, "References", source=expected, type="text/csv")
    return root


def _manifest(related: Mapping[str, tuple[str, str, str, str]]) -> Element:
    root = Element(
        "fmiReferences",
        {
            "xmlns:fmi-ls": MANIFEST_NAMESPACE,
            "fmi-ls:fmi-ls-name": "org.fmi-standard.fmi-ls-ref",
            "fmi-ls:fmi-ls-version": "1.0.0-beta",
            "fmi-ls:fmi-ls-description": (
                "Layered Standard providing information on related files included in an FMU."
            ),
        },
    )
    for file, (role, kind, description, text) in related.items():
        SubElement(
            root,
            "Related",
            type=kind,
            source=file,
            role=role,
            description=description,
            checksum=checksum(text.encode()),
            checksumType="SHA3-256",
        )
    return root


def checksum(data: bytes) -> str:
    """Checksum of a related file as the manifest has it."""
    return hashlib.sha3_256(data).hexdigest()


_DOCUMENTATION = """<!DOCTYPE html>
<meta charset="utf-8">
<title>Reference results of {name}</title>
<h1>Reference results of {name}</h1>
<p>The folder <code>extra/org.fmi-standard.fmi-ls-ref</code> holds what a regression test needs, after the FMI layered
standard for references: stimuli, results, parameter set and the experiments that tie them together.
<code>smoke_test.exp</code> is the beginning of <code>validation.exp</code>.</p>
<p>The results were computed from the model's equations without an FMU. A result may differ from its reference by
{tolerance} times the largest magnitude in its column.</p>
<p><b>Which row belongs to which step.</b> Inputs hold over a step, and a position input is the value reached at the end
of the step. Row k of the stimuli is set before the step from its time to that of row k+1, of {step} s, as FMPy's
<code>simulate_fmu</code> does with its input; so the stimuli are one row early against the signals that they stand for.
To replay a measured log, whose row k+1 is where step k ends, set row k+1 before that step.</p>
<p>With FMPy:</p>
<pre>from fmpy import read_csv, simulate_fmu
simulate_fmu("{name}.fmu", input=read_csv("{name}_in.csv"), step_size={step}, output_interval={step}, stop_time=...)
</pre>
"""
