"""Damaged FMUs, SSPs and cards, random options and paths: no traceback, no hang, one line and exit code 2."""

from __future__ import annotations

import io
import time
import zipfile

import pytest
from hypothesis import given, seed, settings
from hypothesis import strategies as st

import tsm_fmu as tsm
from tests.cli.test_fuzz import FEW, answered
from tsm_fmu.cosim.ssp import write_ssp
from tsm_fmu.cosim.system import Component, Connection, Experiment, System

LOG = "time [s],x_in [rad],x_out [rad]\n" + "".join(f"{k / 10},{k % 7},{k % 5}\n" for k in range(40))
FORTY = settings(FEW, max_examples=40)
TWENTY = settings(FEW, max_examples=20)  # each may start a process of its own
bits = st.tuples(st.integers(0, 10**6), st.integers(0, 255))
places = st.sampled_from(["xml", "archive", "lost", "emptied", "doubled", "grown", "cut"])


@pytest.fixture(scope="module")
def folder(tmp_path_factory):
    made = tmp_path_factory.mktemp("fuzz")
    (made / "log.csv").write_text(LOG)
    tsm.export("PairedTsmBacklash", made / "good.fmu")
    tsm.identify("PairedTsmBacklash", made / "log.csv", single_start=True).write_card(made / "good.toml")
    unit = tsm.export("ReferenceSignal", made / "reference.fmu")
    parts = (Component("r", unit, {}), Component("b", made / "good.fmu", {}))
    system = System(parts, (Connection("r.y", "b.x_in"),))
    write_ssp(made / "good.ssp", (system, Experiment(stop=0.02, step=0.01)))
    return made


def damaged(data: bytes, place: str, changes: list[tuple[int, int]], pick: int) -> bytes:
    """An archive with bytes of its XML or of itself changed, a member lost, emptied, doubled or grown, or cut short."""
    if place == "cut":
        return data[: pick % len(data)]
    if place == "archive":
        return _changed(data, changes)
    out = io.BytesIO()
    with zipfile.ZipFile(io.BytesIO(data)) as old, zipfile.ZipFile(out, "w", zipfile.ZIP_DEFLATED) as new:
        names = old.namelist()
        hit = names[pick % len(names)]
        for name in names:
            content = old.read(name)
            if place == "xml" and name.endswith((".xml", ".ssd", ".ssv")):
                content = _changed(content, changes)
            if name == hit:
                if place == "lost":
                    continue
                content = {"emptied": b"", "grown": content + b"\0" * 5000}.get(place, content)
            new.writestr(name, content)
            if name == hit and place == "doubled":
                with pytest.warns(UserWarning, match="Duplicate name"):
                    new.writestr(name, content[:5])
    return out.getvalue()


def _changed(data: bytes, changes: list[tuple[int, int]]) -> bytes:
    mutable = bytearray(data)
    for at, value in changes:
        mutable[at % len(mutable)] = value
    return bytes(mutable)


def test_damaged_fmus(folder, capfd):
    good, bad = (folder / "good.fmu").read_bytes(), folder / "bad.fmu"

    @seed(1718)
    @TWENTY
    @given(places, st.lists(bits, min_size=1, max_size=4), st.integers(0, 10**6))
    def fuzz(place, changes, pick):
        bad.write_bytes(damaged(good, place, changes, pick))
        answered(["validate", bad], capfd)
        answered(["simulate", bad, "--input", folder / "log.csv", "--out", folder / "s.csv"], capfd)

    fuzz()


def test_damaged_systems(folder, capfd):
    good, bad = (folder / "good.ssp").read_bytes(), folder / "bad.ssp"

    @seed(1719)
    @TWENTY
    @given(places, st.lists(bits, min_size=1, max_size=4), st.integers(0, 10**6))
    def fuzz(place, changes, pick):
        bad.write_bytes(damaged(good, place, changes, pick))
        answered(["run", bad, "--stop", "0.02", "--out", folder / "out"], capfd)

    fuzz()


def test_damaged_cards(folder, capfd):
    lines, bad = (folder / "good.toml").read_text().splitlines(), folder / "bad.toml"
    values = st.sampled_from([
        "1e300", "-1e300", "nan", "inf", "0", "-1", "true", '""', "[]", "{}", "1979-05-27", '"x"', "9" * 400, "[[1]]",
    ])  # fmt: skip

    @seed(1720)
    @FORTY
    @given(st.lists(st.tuples(st.integers(0, 10**6), values), min_size=1, max_size=3), st.booleans())
    def fuzz(changes, lost):
        made = list(lines)
        for at, value in changes:
            line = made[at % len(made)]
            made[at % len(made)] = "" if lost else f"{line.partition('=')[0]}= {value}" if "=" in line else line
        bad.write_text("\n".join(made))
        answered(["simulate", bad, "--input", folder / "log.csv", "--out", folder / "s.csv"], capfd)

    fuzz()


def test_random_options_and_paths(folder, capfd, tmp_path, monkeypatch):
    monkeypatch.chdir(tmp_path)  # what they may write, they write here
    verbs = st.sampled_from(["check", "validate", "simulate", "export", "list", "report", "sample"])
    words = st.one_of(
        st.sampled_from([
            "--set", "--set=alpha=1e300", "--set=alpha", "--stop", "-1", "1e400", "nan", "--cutoff=0", "--from=9",
            "--seed=-1", "--json", "--map=x_in=", "--map==[rad]", "--scale=x_in=0", "--help", "--",
            "--out=/", "--out=/proc/x.csv", "--out=", "/dev/null", "PairedTsmBacklash:ghost", "SingleTsmDahl+ghost+",
            str(folder / "log.csv"), str(folder / "good.toml"), str(folder), "\u202e", "a" * 300,
        ]),
        st.text(max_size=8).filter(lambda text: "\0" not in text),
    )  # fmt: skip

    @seed(1721)
    @settings(FEW, max_examples=80)
    @given(verbs, st.lists(words, max_size=4))
    def fuzz(verb, arguments):
        answered([verb, *arguments], capfd)

    fuzz()


@pytest.mark.parametrize(
    "text",
    [
        "a." * 400_000 + "a = 1\n",
        "[" + '"a" . ' * 100_000 + "a]\n",
        "x = 1 # " + "y" * 1_100_000,
        "\n".join(f"k{k}.a.b = {k}" for k in range(40_000)),
        "a." * 29 + "a = 1\n",
    ],
)
def test_toml_takes_no_time_that_grows_with_the_square_of_its_size(folder, capfd, text):
    card = folder / "deep.toml"
    card.write_text(text)
    begun = time.process_time()
    answered(["simulate", card, "--input", folder / "log.csv", "--out", folder / "s.csv"], capfd)
    assert time.process_time() - begun < 20.0  # minutes before there was a limit
