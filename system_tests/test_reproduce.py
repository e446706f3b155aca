"""``tsm-fmu reproduce`` as a user runs it: one command, files, a browser."""

import json
import re
import shutil
import subprocess
import sys

import pytest

from tests.browser import assert_readable
from tsm_fmu.cli.app import run
from tsm_fmu.reproduction.verdict import Verdict

CHROMIUM = shutil.which("chromium") or shutil.which("chromium-browser")


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


def test_the_table_is_printed_for_people(tmp_path, capsys):
    assert run(["reproduce", "--paper", "icinco2013", "--quick", "--out", str(tmp_path)]) == 0
    shown = capsys.readouterr().out
    assert "internal error" in shown
    assert "from FMUs in co-simulation" in shown
    assert str(tmp_path / "report.html") in shown.replace("\n", "")


@pytest.mark.parametrize(
    ("arguments", "message"),
    [
        (["--out", "{file}"], "is a file -- expected a folder -- choose another"),
        (["--out", "{file}/below", "--paper", "icinco2013"], "is no writable folder"),
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


@pytest.fixture
def browser(tmp_path):
    """``browser(width, *more)``: what headless Chromium prints for the page of that width."""

    def open_(page, width, *more):
        command = [
            str(CHROMIUM), "--headless", "--no-sandbox", "--disable-gpu", "--disable-quic", "--no-first-run",
            "--disable-background-networking", "--disable-component-update", "--disable-sync",
            "--host-resolver-rules=MAP * ~NOTFOUND", f"--user-data-dir={tmp_path / 'profile'}",
            f"--window-size={width},2000", "--virtual-time-budget=8000", "--dump-dom", *more, page.as_uri(),
        ]  # fmt: skip
        return subprocess.run(command, capture_output=True, text=True, timeout=120, check=True).stdout

    return open_


@pytest.mark.skipif(CHROMIUM is None, reason="chromium is not installed (Debian package chromium)")
def test_a_browser_draws_the_panels_offline_on_a_phone(one_paper, tmp_path):
    _, out = one_paper
    assert assert_readable(out / "report.html", tmp_path)["frames"] >= 6


@pytest.mark.skipif(CHROMIUM is None, reason="chromium is not installed (Debian package chromium)")
@pytest.mark.parametrize("width", [1000, 500])
def test_the_verdict_of_every_row_is_in_view_without_scrolling(one_paper, browser, tmp_path, width):
    """A script appended to the page measures the badges of the rows, and what the filter leaves."""
    _, out = one_paper
    probe = """
<script>window.addEventListener("load", () => {
  const badges = [...document.querySelectorAll("tr[data-verdict] .badge")].map(b => b.getBoundingClientRect());
  document.body.dataset.right = Math.max(...badges.map(b => b.right));
  document.body.dataset.left = Math.min(...badges.map(b => b.left));
  document.body.dataset.inner = innerWidth;
  document.getElementById("by-verdict").value = "internal-error";
  document.getElementById("by-verdict").dispatchEvent(new Event("change"));
  const rows = [...document.querySelectorAll("tr[data-verdict]:not(.hidden)")];
  document.body.dataset.kept = rows.map(r => r.dataset.verdict).join(" ");
});</script></body>"""
    page = tmp_path / "probe.html"
    page.write_text((out / "report.html").read_text(encoding="utf-8").replace("</body>", probe), encoding="utf-8")
    found = dict(re.findall(r'data-(right|left|inner|kept)="([^"]*)"', browser(page, width)))
    assert float(found["left"]) >= 0.0
    assert float(found["right"]) <= float(found["inner"])
    assert set(found["kept"].split()) == {"internal-error"}
