"""``tsm-fmu reproduce`` as a user runs it: one command, files, a browser."""

import json
import subprocess
import sys

import pytest

from tests.browser import assert_readable, needs_chromium, opened
from tsm_fmu.cli.app import run
from tsm_fmu.reproduction.verdict import Verdict


@pytest.fixture(scope="module")
def one_paper(tmp_path_factory):
    """JSON of the command for the quickest paper, in a process of its own."""
    out = tmp_path_factory.mktemp("reproduce") / "new"
    command = [
        sys.executable,
        "-m",
        "tsm_fmu",
        "reproduce",
        "--paper",
        "icinco2013",
        "--quick",
        "--out",
        str(out),
        "--json",
    ]
    finished = subprocess.run(command, capture_output=True, text=True, check=True)
    assert finished.stderr == ""
    return json.loads(finished.stdout), out


def test_json_is_one_object_with_the_claims_and_the_paths(one_paper):
    found, out = one_paper
    assert set(found["counts"]) == {verdict.value for verdict in Verdict}
    assert sum(found["counts"].values()) == len(found["claims"])
    assert {claim["paper"] for claim in found["claims"]} == {"icinco2013"}
    assert {"id", "item", "printed", "ours", "verdict", "reason", "assumed", "code"} <= set(found["claims"][0])
    for kind, name in (("report", "report.html"), ("csv", "claims.csv"), ("json", "claims.json")):
        assert found[kind] == str(out / name)
        assert (out / name).stat().st_size > 0


def test_native_units_give_the_same_table_which_is_printed_for_people(one_paper, tmp_path, capsys):
    line = ["reproduce", "--paper", "icinco2013", "--quick", "--flavour", "native", "--out", str(tmp_path)]
    assert run(line) == 0
    shown = capsys.readouterr().out
    assert "internal error" in shown
    assert "from FMUs in co-simulation" in shown
    assert str(tmp_path / "report.html") in shown.replace("\n", "")
    native = json.loads((tmp_path / "claims.json").read_text())
    assert (one_paper[0]["flavour"], native["flavour"]) == ("python", "native")
    assert native["claims"] == one_paper[0]["claims"]


@pytest.mark.parametrize(
    ("arguments", "message"),
    [
        (["--out", "{file}"], "is a file -- expected a folder -- choose another"),
        (["--out", "{file}/below", "--paper", "icinco2013"], "is no writable folder"),
        (["--out", "{folder}", "--paper", "do2015"], "paper 'do2015' -- expected one of iftomm2013"),
        (["--out", "{folder}", "--flavour", "both"], "flavour 'both' -- expected one of native, python -- choose one"),
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


@needs_chromium
def test_a_browser_draws_the_panels_offline_on_a_phone(one_paper):
    _, out = one_paper
    assert assert_readable(out / "report.html")["frames"] >= 6


@needs_chromium
@pytest.mark.parametrize("width", [1000, 500])
def test_the_verdict_of_every_row_is_in_view_without_scrolling(one_paper, width):
    _, out = one_paper
    with opened(out / "report.html", width=width) as window:
        left, right = window.evaluate(
            """() => {
            const badges = [...document.querySelectorAll("tr[data-verdict] .badge")]
              .map(b => b.getBoundingClientRect());
            return [Math.min(...badges.map(b => b.left)), Math.max(...badges.map(b => b.right))];
            }"""
        )
        window.locator("#by-verdict").select_option("internal-error")
        rows = window.locator("tr[data-verdict]:not(.hidden)")
        kept = {row.get_attribute("data-verdict") for row in rows.all()}
    assert left >= 0.0
    assert right <= width
    assert kept == {"internal-error"}
