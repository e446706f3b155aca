"""``tsm-fmu reproduce`` as a user runs it: one command, files, a browser; and the closed loops by FMUs."""

import json
import re
import shutil
import subprocess
import sys

import pytest

from tsm_fmu.cli.app import run
from tsm_fmu.reproduction.closed_loops import closed_loop_claims
from tsm_fmu.reproduction.verdict import Verdict

CHROMIUM = shutil.which("chromium") or shutil.which("chromium-browser")


@pytest.fixture(scope="module")
def one_paper(tmp_path_factory):
    """JSON of the command for the quickest paper, in a process of its own."""
    out = tmp_path_factory.mktemp("reproduce") / "new"
    command = [sys.executable, "-m", "tsm_fmu", "reproduce", "--paper", "icinco2013", "--out", str(out), "--json"]
    finished = subprocess.run(command, capture_output=True, text=True, check=True)
    assert finished.stderr == ""
    return json.loads(finished.stdout), out


def test_json_is_one_object_with_the_claims_and_the_paths(one_paper):
    found, out = one_paper
    assert set(found["counts"]) == {verdict.value for verdict in Verdict}
    assert sum(found["counts"].values()) == len(found["claims"])
    assert {claim["paper"] for claim in found["claims"]} == {"icinco2013"}
    assert {"id", "item", "reported", "ours", "verdict", "reason", "rule"} <= set(found["claims"][0])
    for kind, name in (("report", "report.html"), ("csv", "claims.csv"), ("json", "claims.json")):
        assert found[kind] == str(out / name)
        assert (out / name).stat().st_size > 0


def test_the_table_is_printed_for_people(tmp_path, capsys):
    assert run(["reproduce", "--paper", "icinco2013", "--out", str(tmp_path)]) == 0
    shown = capsys.readouterr().out
    assert "contradicts the paper's own equations" in shown
    assert "icinco2013" in shown
    assert str(tmp_path / "report.html") in shown.replace("\n", "")


@pytest.mark.parametrize(
    ("arguments", "message"),
    [
        (["--out", "{file}"], "is a file -- expected a folder -- choose another"),
        (["--out", "{file}/below", "--paper", "icinco2013"], "could not be written"),
        (["--out", "{folder}", "--paper", "do2015"], "paper 'do2015' -- expected one of iftomm2013"),
    ],
)
def test_bad_input_is_one_line_and_exit_code_2(arguments, message, tmp_path, capsys):
    (tmp_path / "file").write_text("kept")
    places = {"file": tmp_path / "file", "folder": tmp_path / "folder"}
    assert run(["reproduce", *(argument.format(**places) for argument in arguments)]) == 2
    captured = capsys.readouterr()
    assert captured.out == ""
    assert captured.err.startswith("tsm-fmu: ")
    assert message in captured.err
    assert captured.err.count("\n") == 1
    assert (tmp_path / "file").read_text() == "kept"


@pytest.mark.skipif(CHROMIUM is None, reason="chromium is not installed (Debian package chromium)")
def test_a_browser_draws_the_panels_offline(one_paper, tmp_path):
    _, out = one_paper
    command = [
        str(CHROMIUM), "--headless", "--no-sandbox", "--disable-gpu", "--no-first-run", "--disable-sync",
        "--disable-background-networking", "--disable-component-update", "--host-resolver-rules=MAP * ~NOTFOUND",
        f"--user-data-dir={tmp_path / 'profile'}", "--window-size=1000,2000", "--virtual-time-budget=8000",
        "--dump-dom", (out / "report.html").as_uri(),
    ]  # fmt: skip
    dom = subprocess.run(command, capture_output=True, text=True, timeout=120, check=True).stdout
    body = re.sub(r"<script.*?</script>", "", dom, flags=re.DOTALL)
    assert len(re.findall(r'class="scatterlayer', body)) == 6  # three panels for Fig. 6 and three for Fig. 7
    assert body.count("contradicts the paper's own equations") >= 2


def test_closed_loops_by_fmus_agree_with_the_closed_forms():
    """Motor and controller follow well: the loop shows what the backlash leaves, and no more than 3 % beside it."""
    claims = {claim.key: claim for claim in closed_loop_claims()}
    for motion in ("periodic", "non_periodic"):
        width, residual = (claims[f"mssp2015.loop_{motion}_{name}"] for name in ("width", "residual"))
        assert width.numbers["ours"][0] == pytest.approx(10.406, rel=0.03)
        assert residual.numbers["ours"][0] == pytest.approx(6.481, rel=0.03)
        assert residual.verdict is Verdict.CONTRADICTS
    assert claims["mssp2015.loop_periodic_width"].verdict is Verdict.REPRODUCED
    assert claims["mssp2015.loop_non_periodic_width"].verdict is Verdict.CONTRADICTS
