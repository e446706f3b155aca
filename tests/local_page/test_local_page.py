"""The local page: its routes without a browser, and the whole way from drop to download in headless Chromium."""

from __future__ import annotations

import json
import socket
import subprocess
import sys
import time
import zipfile

import numpy as np
import pytest

import tsm_fmu as tsm
from tests.browser import barriers, launched, needs_chromium
from tsm_fmu.cli.app import run
from tsm_fmu.local_page.job import NOTHING_KEPT
from tsm_fmu.local_page.session import Session

UNITLESS = "t,motor,joint\n"
MAPPING = {"t": "time [s]", "motor": "x_in [deg]", "joint": "x_out [deg]"}


@pytest.fixture(scope="module")
def log(tmp_path_factory):
    """A log of the sample drive whose columns say neither what they are nor in what unit; degrees and seconds."""
    record = tsm.sample("sine")
    path = tmp_path_factory.mktemp("lab") / "lab <1>.csv"
    rows = np.column_stack([record.time, *(np.degrees(record.columns[n]) for n in ("x_in", "x_out"))])[::5]
    path.write_text(UNITLESS + "\n".join(",".join(f"{v:.9g}" for v in row) for row in rows), encoding="utf-8")
    return path


@pytest.fixture(scope="module")
def address():
    command = [sys.executable, "-m", "tsm_fmu", "app", "--port", "0", "--no-browser"]
    with subprocess.Popen(command, stdout=subprocess.PIPE, text=True) as server:
        assert server.stdout is not None
        yield server.stdout.readline().split()[0]
        server.terminate()
        assert server.wait(20) in (0, 130, -15)


def test_a_mapping_gives_the_record_that_read_record_gives(log, tmp_path):
    session = Session(tmp_path)
    made = session.add_log(log.name, log.read_bytes())
    assert made["columns"] == [{"name": name, "unit": ""} for name in ("t", "motor", "joint")]
    seen = session.map_log(log.name, MAPPING)
    assert seen["channels"] == {"time": "s", "x_in": "rad", "x_out": "rad"}
    assert seen["summary"] == tsm.check(tsm.read_record(log, mapping=MAPPING)).summary()
    with pytest.raises(tsm.InputError, match="new name"):
        session.add_log(f"../{log.name}", b"")
    with pytest.raises(tsm.InputError, match="has no column"):
        session.map_log(log.name, {"ghost": "x_in [deg]"})
    for mapping in ({}, {"t": "time"}, {"t": "time [V]"}, {"t": " [s]"}, {"t": "joint"}, {"ghost": "x_in [deg]"}):
        with pytest.raises(tsm.InputError) as refused:
            session.map_log(log.name, mapping)
        assert "--" not in str(refused.value).replace(" -- ", "")  # a person with a mouse has no options
        assert str(refused.value).count(" -- ") == 2
    assert session.maps[log.name] == MAPPING
    assert {p.name for p in tmp_path.rglob("*") if p.is_file()} == {log.name}


@pytest.mark.parametrize("name", ["", "..", "a\0b.csv", "log.toml", "a/..", "C:\\x\\log.toml"])
def test_names_that_lead_elsewhere_are_refused(name, tmp_path):
    with pytest.raises(tsm.InputError, match="expected"):
        Session(tmp_path).add_log(name, b"time [s]\n1\n2\n")
    assert not [p for p in tmp_path.rglob("*") if p.is_file()]


def test_it_answers_to_this_machine_and_this_page_only(address):
    host, port = address.removeprefix("http://").rstrip("/").split(":")
    assert host == "127.0.0.1"

    def status(*lines, first="GET / HTTP/1.0"):
        with socket.create_connection((host, int(port))) as there:
            there.sendall("\r\n".join([first, *lines, "", ""]).encode())
            return int(there.makefile("rb").readline().split()[1])

    assert status(f"Host: {host}:{port}") == 200
    assert status("Host: evil.example") == 400
    assert status(f"Host: {host}:{port}", "Origin: http://evil.example") == 403
    assert status(f"Host: {host}:{port}", first="GET /jobs/7/card.toml HTTP/1.0") == 400
    assert status(f"Host: {host}:{port}", first="GET /logs/..%2f..%2fetc/picture HTTP/1.0") in (400, 404)


def test_a_taken_port_and_a_missing_extra_are_one_line(capsys, monkeypatch):
    with socket.socket() as taken:
        taken.bind(("127.0.0.1", 0))
        taken.listen()
        assert run(["app", "--port", str(taken.getsockname()[1]), "--no-browser"]) == 2
    assert "expected a free port" in capsys.readouterr().err
    for name in [n for n in sys.modules if n.startswith("tsm_fmu.local_page")]:
        monkeypatch.delitem(sys.modules, name)
    monkeypatch.setitem(sys.modules, "uvicorn", None)
    assert run(["app"]) == 2
    said = capsys.readouterr().err
    assert said.count("\n") == 1
    assert "pip install 'tsm-fmu[app]'" in said


def ended(job, cancel_at=None):
    """The job once it is over; cancelled as soon as a step says ``cancel_at``."""
    until = time.monotonic() + 180
    while job.state in ("running", "stopping"):
        assert time.monotonic() < until, job
        if cancel_at is not None and any(cancel_at in step for step in job.steps):
            job.cancel()
        time.sleep(0.01)
    return job.as_json()


@pytest.mark.parametrize(
    ("verb", "cancel_at", "kept"),
    [
        ("identify", "reading", []),
        ("identify", "several starts", ["card.toml", "model.fmu", "report.html"]),
        ("diagnose", "refit with", ["card.incomplete.toml"]),
    ],
)
def test_what_was_found_before_a_cancel_is_kept(log, tmp_path, verb, cancel_at, kept):
    session = Session(tmp_path)
    session.add_log(log.name, log.read_bytes())
    session.map_log(log.name, MAPPING)
    job = session.start(verb, "PairedTsmBacklash+creep", [log.name], [])
    seen = ended(job, cancel_at)
    assert seen["state"] == "cancelled"
    assert seen["files"] == kept
    assert str(tmp_path) not in seen["answer"]
    for name in kept[:1]:
        assert np.isfinite(tsm.read_card(job.request.folder / name).parameters["c"].value)
        assert name in seen["answer"] or "interrupted" in seen["answer"]
    if not kept:
        assert seen["answer"] == NOTHING_KEPT


def test_a_process_that_dies_is_a_failed_job_with_words(log, tmp_path):
    session = Session(tmp_path)
    session.add_log(log.name, log.read_bytes())
    session.map_log(log.name, MAPPING)
    job = session.start("diagnose", "PairedTsmBacklash", [log.name], [])
    job._process.kill()
    assert ended(job)["state"] == "failed"
    assert "try again" in job.result["error"]


@pytest.fixture(scope="module")
def browser():
    with launched() as chromium:
        yield chromium


@needs_chromium
def test_from_drop_to_download(address, log, browser, tmp_path):
    page = browser.new_page(viewport={"width": 400, "height": 900})
    page.set_default_timeout(120_000)  # a busy machine, whose first fit compiles
    asked: list[str] = []
    page.on("request", lambda request: asked.append(request.url))
    page.goto(address)
    page.get_by_label("Model", exact=True).select_option("PairedTsmBacklash")
    transfer = page.evaluate_handle(
        "([name, text]) => { const d = new DataTransfer(); d.items.add(new File([text], name)); return d; }",
        [log.name, log.read_text(encoding="utf-8")],
    )
    page.dispatch_event("#drop", "drop", {"dataTransfer": transfer})
    page.get_by_role("heading", name=log.name).wait_for()
    page.get_by_role("alert").filter(has_text="expected").wait_for()  # what the log does not say is asked for
    assert not page.locator("iframe").is_visible()  # nothing to show yet: no blank
    assert page.get_by_label("what column t is").input_value() == "time"  # proposed without being asked
    for column, name, unit in (("t", "time", "s"), ("motor", "x_in", "deg"), ("joint", "x_out", "deg")):
        page.get_by_label(f"what column {column} is").select_option(name)
        page.get_by_label(f"unit of column {column}").fill(unit)
    page.get_by_label("unit of column joint").press("Tab")
    page.locator("pre", has_text="what this log cannot show").wait_for()
    picture = page.frame_locator(f'iframe[title="channels of {log.name}"]')
    picture.locator("[data-drawn]").wait_for()
    assert page.evaluate("document.documentElement.scrollWidth") <= 400
    page.get_by_role("button", name="Fit the model").press("Enter")
    page.locator("#job-0 pre", has_text="alpha").wait_for(timeout=60_000)
    assert page.locator("#job-0 li").count() >= 2
    with page.expect_download() as taken:
        page.get_by_role("link", name="card.toml").click()
    card = tmp_path / "card.toml"
    taken.value.save_as(card)
    expected = tsm.identify(
        "PairedTsmBacklash",
        tsm.read_record(log, mapping=MAPPING),
    )
    assert tsm.read_card(card).parameters["c"].value == expected.parameters["c"]
    with page.expect_download() as taken:
        page.get_by_role("link", name="model.fmu").click()
    taken.value.save_as(tmp_path / "model.fmu")
    assert "modelDescription.xml" in zipfile.ZipFile(tmp_path / "model.fmu").namelist()
    assert page.locator("#compare tbody tr").count() == 1
    page.get_by_role("button", name="Diagnose").click()
    page.locator("#job-1 p", has_text="done").wait_for()
    assert "x_out" in page.locator("#job-1 pre").inner_text()
    with page.expect_download() as taken:
        page.locator("#job-1").get_by_role("link", name="diagnosis.json").click()
    taken.value.save_as(tmp_path / "diagnosis.json")
    found = json.loads((tmp_path / "diagnosis.json").read_text(encoding="utf-8"))
    assert page.locator("#job-1 pre").inner_text() == found["answer"]
    assert page.locator("#compare tbody tr").count() == 2
    page.get_by_role("button", name="Diagnose").click()
    page.locator("#job-2 li").first.wait_for()
    page.get_by_role("button", name="Cancel number 2").click()
    page.locator("#job-2 p", has_text="cancelled").wait_for()
    assert "cancelled" in page.get_by_role("status").inner_text()
    assert all(url.startswith((address, "data:", "blob:")) for url in asked)
    for scheme in ("light", "dark"):
        page.emulate_media(color_scheme=scheme)
        assert barriers(page) == []
