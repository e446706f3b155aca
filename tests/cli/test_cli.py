"""The command-line frame: exit codes, one-line errors, JSON and nothing but JSON."""

import json
import subprocess
import sys

import pytest

from tsm_fmu import InputError, __version__
from tsm_fmu.cli.app import app, run, settings
from tsm_fmu.effects import EFFECTS
from tsm_fmu.models import MODELS


def test_version_is_printed(capsys):
    assert run(["--version"]) == 0
    assert capsys.readouterr().out.strip() == __version__


@pytest.mark.parametrize(
    ("arguments", "named"),
    [
        (["frobnicate"], "frobnicate"),
        (["list", "--frobnicate"], "--frobnicate"),
        (["list", "extra"], "extra"),
    ],
)
def test_wrong_use_is_one_line_and_exit_code_2(arguments, named, capsys):
    assert run(arguments) == 2
    captured = capsys.readouterr()
    assert captured.out == ""
    assert captured.err.count("\n") == 1
    assert captured.err.startswith("tsm-fmu: ")
    assert named in captured.err


def test_list_json_is_one_object_with_the_promised_keys(capsys):
    assert run(["list", "--json"]) == 0
    listed = json.loads(capsys.readouterr().out)
    assert set(listed["models"]) == {module.NAME for module in MODELS}
    assert isinstance(listed["effects"], dict)
    for described in listed["models"].values():
        assert {"inputs", "outputs", "parameters", "presets"} <= set(described)


def test_list_is_an_overview_whose_names_are_never_cut(capsys, monkeypatch):
    monkeypatch.setenv("COLUMNS", "50")
    assert run(["list"]) == 0
    shown = capsys.readouterr().out
    first_words = {line.split()[0] for line in shown.splitlines() if line.strip()}
    assert first_words >= {module.NAME for module in (*MODELS, *EFFECTS)}
    assert "tsm-fmu list NAME" in shown
    monkeypatch.setenv("COLUMNS", "80")
    assert run(["list"]) == 0
    assert capsys.readouterr().out.count("\n") < 3 * (len(MODELS) + len(EFFECTS))


def test_list_of_a_model_names_every_variable_with_its_unit(capsys):
    assert run(["list", "PairedTsmBacklash"]) == 0
    shown = capsys.readouterr().out
    assert "1/rad" in shown


def test_list_of_one_model_or_effect_has_its_equations_and_nothing_else(capsys, monkeypatch):
    monkeypatch.setenv("COLUMNS", "50")
    assert run(["list", "TendonDrive"]) == 0
    shown = capsys.readouterr().out
    assert "tau_in = ratio tau_out + g_LuGre(v_in)" in shown
    assert "PairedTsmFriction" not in shown
    assert run(["list", "stiffness_hardening"]) == 0
    assert " stiffness_hardening " in capsys.readouterr().out  # not cut on a narrow screen
    assert run(["list", "inertia", "--json"]) == 0
    listed = json.loads(capsys.readouterr().out)
    assert (listed["models"], list(listed["effects"])) == ({}, ["inertia"])


def test_python_dash_m_is_the_same_program():
    done = subprocess.run([sys.executable, "-m", "tsm_fmu", "--version"], capture_output=True, text=True, check=False)
    assert (done.returncode, done.stdout.strip()) == (0, __version__)


@pytest.mark.parametrize("pairs", [["alpha"], ["=3"], ["alpha=1", "alpha=2"]])
def test_settings_refuse_what_is_not_one_name_and_one_value(pairs):
    with pytest.raises(InputError, match="expected name=value, each name once"):
        settings(pairs)


def test_settings_keep_everything_after_the_first_equals_sign():
    assert settings(["motor.u=3", "map=a=b"]) == {"motor.u": "3", "map": "a=b"}


@pytest.fixture
def failing_verb():
    """Register, for one test, a verb that fails in a way of ours."""

    @app.command("explode")
    def explode() -> None:
        raise RuntimeError("boiler")

    yield "explode"
    app.registered_commands.pop()


def test_a_defect_of_ours_is_exit_code_1_with_the_traceback(failing_verb, capsys):
    assert run([failing_verb]) == 1
    shown = capsys.readouterr().err
    assert "Traceback" in shown
    assert "a defect of ours" in shown


def test_list_shows_effects_with_units_in_brackets(capsys, monkeypatch):
    monkeypatch.setenv("COLUMNS", "200")
    assert run(["list", "sensor_lag"]) == 0
    shown = capsys.readouterr().out
    assert "sensor_lag" in shown
    assert "tau [s]" in shown  # a bracket is text here, not a style of the console


def test_a_bare_command_and_the_short_option_show_help(capsys):
    assert run([]) == 0
    bare = capsys.readouterr().out
    assert "identify" in bare
    assert run(["-h"]) == 0
    assert capsys.readouterr().out == bare


def test_a_verb_that_is_nearly_right_is_guessed(capsys):
    assert run(["identfy"]) == 2
    assert "Did you mean 'identify'?" in capsys.readouterr().err
