"""Logs as other programs write them are the canonical log, to the last bit."""

import datetime
import io

import numpy as np
import pandas as pd
import pytest

from tsm_fmu.logs.record import read_record
from tsm_fmu.models.contract import InputError

N = 137
NOISE = np.random.default_rng(1709)
TIME = np.array([float(f"{0.004 * k:.3f}") for k in range(N)])
X = np.array([float(f"{v:.5f}") for v in np.sin(7.1 * TIME) + 3e-3 * NOISE.standard_normal(N)])
TAU = np.array([float(f"{v:.4f}") for v in 0.31 * np.cos(7.1 * TIME) - 0.1])


def rows(separator=",", decimal=".", times=None, ends="\n"):
    times = [f"{t:.3f}" for t in TIME] if times is None else times
    lines = [separator.join((t, f"{x:.5f}", f"{f:.4f}")) for t, x, f in zip(times, X, TAU, strict=True)]
    return ends.join(line.replace(".", decimal) if decimal != "." else line for line in lines) + ends


def iso(offset=""):
    start = datetime.datetime(2026, 5, 4, 23, 59, 59, 125000)
    return [
        (start + datetime.timedelta(milliseconds=4 * k)).isoformat(timespec="milliseconds") + offset for k in range(N)
    ]


HEAD = "time [s],x_in [rad],tau_in [N.m]\n"
SEMICOLONS = "time [s];x_in [rad];tau_in [N.m]\n" + rows(";", ",")
VARIANTS = {
    "plain": (HEAD + rows(), ()),
    "semicolons and decimal commas": (SEMICOLONS, ("separated by semicolons", "decimal commas")),
    "semicolons and points": (SEMICOLONS.replace(",", "."), ("separated by semicolons",)),
    "quoted decimal commas": (
        HEAD + "".join(f'"{line.replace(".", ",")}"\n'.replace(";", '","') for line in rows(";").splitlines()),
        ("decimal commas",),
    ),
    "tabs": (HEAD.replace(",", "\t") + rows("\t"), ("separated by tabs",)),
    "bars": (HEAD.replace(",", " | ") + rows(" | "), ("separated by bars",)),
    "spaces": ("# time [s]  x_in [rad] tau_in [N.m]\n" + rows("   "), ("separated by spaces",)),
    "byte-order mark": (("﻿" + HEAD + rows()).encode(), ("byte-order mark: text in UTF-8",)),
    "UTF-16": ((HEAD + rows()).encode("utf-16"), ("byte-order mark: text in UTF-16",)),
    "UTF-16, the other order": (("﻿" + HEAD + rows()).encode("utf-16-be"), ("UTF-16",)),
    "UTF-16 without a mark": ((HEAD + rows()).encode("utf-16-le"), ("without a byte-order mark",)),
    "Excel in Europe": (("﻿" + SEMICOLONS.replace("\n", "\r\n")).encode(), ("semicolons", "commas", "mark")),
    "carriage returns": ((HEAD + rows()).replace("\n", "\r"), ("carriage returns",)),
    "parentheses": ("Time (s),x_in (rad),tau_in (N.m)\n" + rows(), ()),
    "row of units": ("time,x_in,tau_in\ns,rad,N.m\n" + rows(), ("units in row 2",)),
    "row of units in brackets": ("Time;x_in;tau_in\n[s];[rad];[Nm]\n" + rows(";", ","), ("units in row 2",)),
    "preamble": ("# rig 3, 4 May\n# a, b\n" + HEAD + rows(), ("header in row 3; 2 rows above it left out",)),
    "preamble without marks": ("Operator,M. Weiß\nRate;250\n\n" + HEAD + rows(), ("header in row 4",)),
    "preamble and row of units": ("LabLog 2.1\n\ntime\tx_in\ttau_in\ns\trad\tN.m\n" + rows("\t"), ("units in row 4",)),
    "names in a comment": ("# time [s],x_in [rad],tau_in [N.m]\n" + rows(), ()),
    "pandas index": (
        "," + HEAD + "".join(f"{k},{line}\n" for k, line in enumerate(rows().splitlines())),
        ("counts the rows: left out",),
    ),
    "separator at the end": ((HEAD + rows()).replace("\n", ",\n"), ("column 4 is empty: left out",)),
    "text column": (
        HEAD.replace("\n", ",state\n") + rows().replace("\n", ",RUN\n"),
        ("state: text, left out",),
    ),
    "time stamps": ("time,x_in [rad],tau_in [N.m]\n" + rows(times=iso()), ("counted from the first, 2026",)),
    "time stamps with a zone": ("timestamp,x_in [rad],tau_in [N.m]\n" + rows(times=iso("+02:00")), ("time stamps",)),
    "time stamps, decimal commas": (
        "time;x_in;tau_in\n;rad;Nm\n" + rows(";", ",", iso()), ("time stamps", "decimal commas", "units in row 2"),
    ),
    "times of day": (
        "time,x_in [rad],tau_in [N.m]\n" + rows(times=[f"0:{9 + k // 250:02}:59.{4 * k:03}" for k in range(N)]),
        ("time stamps",),
    ),
    "t": ("t [s],x_in [rad],tau_in [N.m]\n" + rows(), ()),
    "time not first": (
        "x_in [rad],tau_in [N.m],time [s]\n"
        + "".join(f"{x:.5f},{f:.4f},{t:.3f}\n" for t, x, f in zip(TIME, X, TAU, strict=True)),
        (),
    ),
    "seconds since 1970": (
        HEAD + rows(times=[f"{1777896000 + k * 0.00390625:.8f}" for k in range(N)]), ("a date: counted from there",),
    ),
}  # fmt: skip


@pytest.mark.parametrize("variant", VARIANTS)
def test_a_variant_is_the_canonical_log(tmp_path, variant):
    content, said = VARIANTS[variant]
    path = tmp_path / "own.csv"
    path.write_bytes(content if isinstance(content, bytes) else content.encode())
    run = read_record(path)
    time = np.arange(N) * 0.00390625 if variant == "seconds since 1970" else TIME
    np.testing.assert_array_equal(run.time, time)
    assert dict(run.units) == {"x_in": "rad", "tau_in": "N.m"}
    np.testing.assert_array_equal(run.columns["x_in"], X)
    np.testing.assert_array_equal(run.columns["tau_in"], TAU)
    assert all(any(words in note for note in run.notes) for words in said), run.notes
    assert bool(run.notes) >= bool(said)
    assert variant != "plain" or run.notes == ()


@pytest.mark.parametrize("variant", ["preamble and row of units", "row of units", "carriage returns", "UTF-16"])
def test_rows_in_messages_are_rows_of_the_file(tmp_path, variant):
    content = VARIANTS[variant][0]
    text = content.decode("utf-16") if isinstance(content, bytes) else content
    lines = text.replace("\r", "\n").splitlines()
    lines[40] = lines[40].replace(lines[40].replace("\t", ",").split(",")[1], "oops")
    path = tmp_path / "own.csv"
    path.write_bytes(("\r" if "\r" in text else "\n").join(lines).encode("utf-16" if variant == "UTF-16" else "utf-8"))
    with pytest.raises(InputError, match="'oops' in row 41, column 'x_in"):
        read_record(path)


def test_latin_1_units(tmp_path):
    path = tmp_path / "own.csv"
    path.write_bytes(("Zeit [s];Weg [µm];Winkel [°]\n" + rows(";", ",")).encode("latin-1"))
    run = read_record(path, mapping={"Zeit": "time"})
    np.testing.assert_array_equal(run.columns["Weg"], X * 1e-6)
    np.testing.assert_array_equal(run.columns["Winkel"], TAU * (np.pi / 180))
    assert any("no UTF-8 (row 1): read as" in note for note in run.notes)


def test_milliseconds_since_1970_keep_their_milliseconds(tmp_path):
    path = tmp_path / "own.csv"
    path.write_text("time [ms],x [m]\n" + "".join(f"{1777896000123 + 4 * k},{k}\n" for k in range(N)))
    run = read_record(path, start=0.02)
    np.testing.assert_array_equal(run.time, 4.0 * np.arange(5, N) * 1e-3)
    assert run.row(0) == 7


def test_units_that_are_missing_are_asked_for_with_the_option(tmp_path):
    path = tmp_path / "own.csv"
    path.write_text("t,angle_motor_deg,enc,spare\n" + "".join(f"{k},{k * k},{3 * k},{k}\n" for k in range(9)))
    for mapping in ({}, {"t": "time"}):
        with pytest.raises(InputError, match=r'column \'t\' has no unit -- .* --map "t=time \[UNIT\]"'):
            read_record(path, mapping=mapping)
    path.write_text(path.read_text().replace("t,", "time [ms],", 1))
    with pytest.raises(InputError) as caught:
        read_record(path)
    assert "'angle_motor_deg' has no unit (nor have 2 more: enc, spare)" in str(caught.value)
    assert '--map "angle_motor_deg=angle_motor_deg [UNIT]" --map "enc=enc [UNIT]"' in str(caught.value)
    run = read_record(
        path, mapping={"angle_motor_deg": "x_in [deg]", "enc": "x_out [360/4096 deg]"}, scales={"enc": -1}
    )
    np.testing.assert_array_equal(run.time, np.arange(9) * 1e-3)
    np.testing.assert_allclose(run.columns["x_in"], np.radians(np.arange(9.0) ** 2), rtol=1e-15)
    np.testing.assert_allclose(run.columns["x_out"], -2 * np.pi / 4096 * 3 * np.arange(9.0), rtol=1e-15)
    assert "spare: no unit given, left out" in run.notes


def test_a_unit_in_the_mapping_counts_before_the_header_and_that_is_said(tmp_path):
    path = tmp_path / "own.csv"
    path.write_text("time [s],x [rad]\n0,1\n1,2\n")
    run = read_record(path, mapping={"x": "x_in [deg]"})
    np.testing.assert_array_equal(run.columns["x_in"], np.array([1.0, 2.0]) * (np.pi / 180))
    assert "x_in: unit deg as it was given, the header says rad" in run.notes
    for text in ("x_in [0 deg]", "x_in [1/0 deg]", "x_in [parsnips]", "[deg]", "x_in [9**9**9 deg]"):
        with pytest.raises(InputError):
            read_record(path, mapping={"x": text})


def test_log_toml_beside_the_log(tmp_path):
    path = tmp_path / "own.csv"
    path.write_text("t,m,o\n" + "".join(f"{k},{k * k},{3 * k}\n" for k in range(9)))
    beside = tmp_path / "log.toml"
    beside.write_text('[map]\nt = "time [s]"\nm = "x_in [deg]"\nother = "tau_in [N.m]"\n[scale]\nx_in = -1\n')
    run = read_record(path)
    given = read_record(path, mapping={"t": "time [s]", "m": "x_in [deg]"}, scales={"m": -1})
    np.testing.assert_array_equal(run.columns["x_in"], given.columns["x_in"])
    assert any("log.toml: m is x_in [deg]" in note for note in run.notes)
    assert any("names other, which this log has not" in note for note in run.notes)
    assert dict(read_record(path, mapping={"m": "x_out [rad]"}, scales={"m": 2}).units) == {"x_out": "rad"}
    for text, message in (
        ("[map", "expected TOML"),
        ("[maps]\n", "'maps' -- expected the tables map and scale"),
        ("map = 3\n", "map is 3 -- expected a table"),
        ("[scale]\nm = 'two'\n", "scale.m = two -- expected a number"),
        ("[map]\nm = 2\n", "map.m = 2 -- expected a text"),
        ("a=" + "[" * 5000, "expected TOML"),
    ):
        beside.write_text(text)
        with pytest.raises(InputError, match=message):
            read_record(path)


def test_frames_and_parquet_take_the_same_mapping_and_time_stamps(tmp_path):
    frame = pd.DataFrame({"when": pd.to_datetime(iso()), "m": X, "state": "RUN"})
    mapping = {"when": "time", "m": "x_in [rad]"}
    frame.to_parquet(tmp_path / "own.parquet")
    for source in (frame, tmp_path / "own.parquet"):
        run = read_record(source, mapping=mapping)
        np.testing.assert_array_equal(run.time, TIME)
        np.testing.assert_array_equal(run.columns["x_in"], X)
        assert "state: text, left out" in run.notes
    stream = io.StringIO()
    frame.to_csv(stream)
    (tmp_path / "own.csv").write_text(stream.getvalue())
    np.testing.assert_array_equal(read_record(tmp_path / "own.csv", mapping=mapping).time, TIME)


def test_a_window_that_removes_nothing_is_said(tmp_path):
    path = tmp_path / "own.csv"
    path.write_text(HEAD + rows())
    assert read_record(path, start=-1.0, stop=7.0).notes == (
        "--from -1 removes nothing: the run begins at 0 s",
        f"--to 7 removes nothing: the run ends at {TIME[-1]:g} s",
    )
    assert read_record(path, start=0.1).notes == ()
