"""What a program gets of a diagnosis: plain data, whose tables and figure show its numbers."""

from __future__ import annotations

import dataclasses
import re
from pathlib import Path
from typing import Any

import numpy as np
import pytest

import tsm_fmu.diagnosis as package
from tsm_fmu.card import ModelCard
from tsm_fmu.diagnosis.evidence import AnswerStep, Candidate, ChannelError, Gap
from tsm_fmu.diagnosis.result import Diagnosis

GAP = Gap("rad", 0.0131, 0.0024, 0.0121, 0.0023, 0.0019, 0.0011, 0.93, 0.91, None, 0.0122, 0.0120)
ALONE = Gap("N", 0.31, 0.04, None, None, 0.04, 0.009, 1.03, 0.96, None, 0.29, None)


def diagnosis(**more: Any) -> Diagnosis:
    listed = (
        Candidate("inertia", 7.123, 0.91, None, {"m": 0.043}),
        Candidate("creep@x_out", 1.2, 0.33, 0.31, {"c": 2.0}, testable=False),
    )
    values: dict[str, Any] = {
        "answer": "Inertia <explains> it.", "effects": ("inertia",), "equivalent": (("wear", "thermal"),),
        "candidates": listed, "gap": {"x_out": GAP, "F": ALONE}, "not_excited": ("slack",),
        "not_applicable": {"bend_angle": "no angle"}, "notes": ("the clock jitters",),
    }  # fmt: skip
    return Diagnosis("named", **{**values, **more})


def test_the_summary_has_the_answer_every_number_and_every_note() -> None:
    text = diagnosis().summary()
    assert text.startswith("Inertia <explains> it.\n")
    for part in (
        "0.0131",
        "0.0023",
        "7.12",
        "creep@x_out",
        "could not show: slack.",
        "not applicable): bend_angle.",
        "clock jitters.",
    ):
        assert part in text
    assert Diagnosis("not_excited", answer="No answer.").summary() == "No answer."


def test_tables_have_the_numbers_of_the_data() -> None:
    frame = diagnosis().to_frame()
    assert list(frame.index) == ["inertia", "creep@x_out"]
    assert frame.loc["creep@x_out", "closes, held out"] == 0.31
    assert list(frame["testable"]) == [True, False]
    gaps = diagnosis().gap_frame()
    assert gaps.loc["x_out [rad]", "answer, held out"] == 0.0023
    assert np.isnan(gaps.loc["F [N]", "given, held out"])
    assert diagnosis(candidates=(), gap={}).to_frame().empty


def test_the_figure_has_a_plot_for_each_channel_in_the_unit_of_people() -> None:
    figure = diagnosis().figure()
    _, angle, force = figure.panels
    assert np.allclose([*angle.bars.values()], np.degrees([0.0121, 0.0120, 0.0023, 0.0019]))
    assert np.allclose([*force.bars.values()], [0.31, 0.29, 0.04, 0.04])
    assert [p.title.partition(": ")[2] for p in figure.panels] == [
        "x_out [deg], measured",
        "x_out [deg], held out",
        "F [N], measured",
    ]


def test_the_figure_goes_from_the_model_as_given_past_other_effects_to_the_answer() -> None:
    listed = (
        Candidate("inertia", 9.0, 0.9, 0.9, {}, channels={"x_out": ChannelError(0.0024, holdout=0.0023)}),
        Candidate("delay@F", 3.0, 0.3, 0.3, {}, channels={"x_out": ChannelError(0.0077, holdout=0.0079)}),
        Candidate("creep@x_out", 2.0, 0.2, 0.1, {}, channels={"x_out": ChannelError(0.0101, holdout=None)}),
        Candidate("wear", 1.0, 0.2, 0.1, {}, channels={"x_out": ChannelError(0.0111, holdout=0.0113)}, testable=False),
    )
    step = AnswerStep(("inertia",), {"x_out": 0.0055}, {"x_out": 0.0056})
    effects = ("inertia", "creep@x_out")
    told = diagnosis(effects=effects, equivalent=(), candidates=listed, gap={"x_out": GAP}, steps=(step,))
    measured, held_out = told.figure().panels
    names = ["as given", "refitted", "delay@F alone", "+ inertia", "+ inertia + creep", "floor"]
    assert list(measured.bars) == names == list(held_out.bars)
    assert np.allclose([*measured.bars.values()], np.degrees([0.0131, 0.0122, 0.0077, 0.0055, 0.0024, 0.0019]))
    assert np.allclose([*held_out.bars.values()], np.degrees([0.0121, 0.0120, 0.0079, 0.0056, 0.0023, 0.0019]))
    assert set(measured.accent) == {"+ inertia", "+ inertia + creep"}


def test_a_notebook_shows_the_answer_as_text() -> None:
    shown = diagnosis()._repr_html_()
    assert "<b>Inertia &lt;explains&gt; it.</b>" in shown
    assert shown.count("<table") == 2


def test_hidden_are_those_with_a_place_and_the_answer_holds_its_sets() -> None:
    found = diagnosis()
    assert found.answered == {"inertia", "wear", "thermal"}
    assert diagnosis(model=ModelCard("LuGreFriction")).card == ModelCard("LuGreFriction")


def test_nothing_in_a_diagnosis_can_be_changed() -> None:
    with pytest.raises(dataclasses.FrozenInstanceError):
        setattr(diagnosis(), "verdict", "none")  # noqa: B010  a plain assignment is a type error already


def test_the_data_know_nothing_of_how_they_were_found() -> None:
    """The modules of the result import no other module of the package; nothing below the report imports the report."""
    root = Path(str(package.__file__)).parent
    for name in ("evidence.py", "improved.py", "result.py"):
        lines = [line for line in (root / name).read_text(encoding="utf-8").splitlines() if line.startswith("from .")]
        own = {line.split()[1] for line in lines if not line.startswith("from ..")}
        assert own <= {".evidence", ".improved"}
    order = {"runs": 0, "residual": 1, "fits": 1, "choice": 2, "answer": 3, "report": 4}
    for path in sorted(root.rglob("*.py")):
        text = re.sub("from ..choice.supported .*", "", path.read_text(encoding="utf-8"))
        assert "TYPE_CHECKING" not in text, path
        room = path.parent.name
        if room in order:
            for other, floor in order.items():
                upward = f"from ..{other}" in text.replace("from ..choice.supported", "")
                assert not upward or floor <= order[room], f"{path} imports {other}"
            assert "from ..workflow" not in text, path
