"""The demo, whole: what it promises to leave behind, and that its report says what was computed."""

import json
import re

import pytest

from tsm_fmu.card import read_card
from tsm_fmu.cli.app import run
from tsm_fmu.fmu.validate import validate_fmu
from tsm_fmu.models import MODELS


@pytest.fixture(scope="module")
def demo(tmp_path_factory):
    out = tmp_path_factory.mktemp("demo") / "deep"
    assert run(["demo", "--out", str(out)]) == 0
    return out


def test_every_model_and_the_fitted_drive_are_built(demo):
    built = {path.stem for path in (demo / "fmus").glob("*.fmu")}
    assert built == {module.NAME for module in MODELS} | {"FittedDrive"}
    assert validate_fmu(demo / "fmus" / "FittedDrive.fmu") == []


def test_the_card_is_of_both_sample_runs(demo):
    card = read_card(demo / "card.toml")
    assert {(used.name, used.role) for used in card.provenance.records} == {
        ("sample_sine", "measured"),
        ("sample_multisine", "holdout"),
    }


def test_the_report_states_the_fit_and_the_loop(demo):
    text = (demo / "report.html").read_text(encoding="utf-8")
    summary = re.search(r'<p class="summary">(.*?)</p>', text, flags=re.DOTALL).group(1)
    fitted, line = map(
        float, re.search(r"fitted to ([\d.]+) deg RMSE where a straight line leaves\s+([\d.]+),", summary).groups()
    )
    assert fitted < 0.2 * line
    width = float(re.search(r"has\s+([\d.]+) deg of hysteresis", summary).group(1))
    assert width == pytest.approx(
        10.397, abs=0.05
    )  # 2 |beta|/alpha tanh(alpha A), MSSP 2015, plus the loop's own error
    for heading in (
        "measured and replayed through the FMU",
        "Fitted parameters",
        "Closed loop of MSSP 2015",
        "FMUs built",
    ):
        assert heading in text


def test_json_is_the_report_path_and_nothing_else(demo, capsys, monkeypatch):
    monkeypatch.setattr("tsm_fmu.verbs.demo.run_demo", lambda out, _said: out / "report.html")
    assert run(["demo", "--out", str(demo), "--json"]) == 0
    assert json.loads(capsys.readouterr().out) == {"report": str(demo / "report.html")}


def test_a_folder_that_is_a_file_is_refused(tmp_path, capsys):
    (tmp_path / "out").write_text("")
    assert run(["demo", "--out", str(tmp_path / "out")]) == 2
    assert "expected a folder" in capsys.readouterr().err
