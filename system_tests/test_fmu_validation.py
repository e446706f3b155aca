"""Every FMU is without a problem in independent checkers: schema, variable rules, model structure."""

import subprocess
import sys

import pytest
from fmpy.validation import validate_fmu as fmpy_validation

from tsm_fmu.fmu.validate import tools, validate_fmu
from tsm_fmu.models import MODELS

NAMES = [module.NAME for module in MODELS]


@pytest.mark.parametrize("name", NAMES)
def test_no_checker_finds_a_problem(fmus, name):
    assert tools() == ("FMPy", "fmu-manipulation-toolbox", "tsm-fmu")
    assert fmpy_validation(str(fmus(name))) == []
    assert validate_fmu(fmus(name)) == []


def test_the_command_lines_of_both_tools_agree(fmus):
    for command in (["fmpy", "validate"], ["fmu_manipulation_toolbox", "-check", "-input"]):
        path = str(fmus("PairedTsmBacklash"))
        done = subprocess.run([sys.executable, "-m", *command, path], capture_output=True, text=True)
        said = done.stdout + done.stderr
        assert done.returncode == 0, said
        assert "No problems found" in said or "No semantic error" in said
        assert "ERROR" not in said
