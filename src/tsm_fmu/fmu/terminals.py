"""Folder ``terminalsAndIcons`` of an FMU: which variables are connected together, and the picture on the block.

FMI 3.0, 2.4.9; FMI 2.0 has the same folder from 2.0.4 on, and the picture as ``model.png`` too (2.3).
"""

from __future__ import annotations

from importlib import resources
from xml.etree.ElementTree import Element, SubElement

from .accompanying import document
from .description import Interface

TERMINALS = {
    "drive": (
        "x_in",
        "x",
        "v",
        "a",
        "v_in",
        "theta_in",
        "tau_in",
        "tau_drive",
        "T_in",
        "T_drive",
        "u",
        "x_r",
        "theta_r",
    ),
    "distal": ("x_out", "theta_out", "tau_out", "T_out", "phi", "omega", "domega"),
    "load": ("tau_load", "T_load", "T_measured"),
}
"""Variables that belong to one connector, by its name; a model has those of its own."""


def terminals_and_icons(fmu: Interface, fmi: int) -> dict[str, bytes]:
    """Files by archive path."""
    icon = resources.files("tsm_fmu").joinpath("data/icon.png").read_bytes()
    files = {
        "terminalsAndIcons/terminalsAndIcons.xml": document(_terminals(fmu)).encode(),
        "terminalsAndIcons/icon.png": icon,
    }
    return files | ({"model.png": icon} if fmi == 2 else {})


def _terminals(fmu: Interface) -> Element:
    root = Element("fmiTerminalsAndIcons", fmiVersion="3.0")  # of this file's form, whatever that of the FMU
    listed = SubElement(root, "Terminals")
    present = [e.variable.name for e in fmu.entries if e.causality != "parameter"]
    for name, members in TERMINALS.items():
        found = [m for m in members if m in present]
        if found:
            terminal = SubElement(listed, "Terminal", name=name, matchingRule="bus")
            for member in found:
                attributes = {"variableName": member, "memberName": member, "variableKind": "signal"}
                SubElement(terminal, "TerminalMemberVariable", attributes)
    return root
