"""Every malformed file gives one line with file, row and column, and no traceback."""

import gzip

import numpy as np
import pyarrow as pa
import pyarrow.parquet as pq
import pytest

from tsm_fmu.cli.app import run
from tsm_fmu.logs.record import Record, read_record, write_record
from tsm_fmu.models.contract import InputError

HEAD = "time [s],x_in [rad],tau_in [N.m]\n"

CASES = {
    "empty": (b"", "is empty -- expected a header row"),
    "blank": (b" \n\n", "is empty -- expected a header row"),
    "blank_header": (b"\n0,1\n1,2\n", "row 1 is empty -- expected a header"),
    "no_header": (b"0,1,2\n1,2,3\n", "row 1 holds numbers -- expected a header such as"),
    "header_only": (HEAD.encode(), "has 0 samples -- expected 2 or more"),
    "one_row": (HEAD.encode() + b"0,1,2\n", "has 1 samples -- expected 2 or more"),
    "duplicated": (b"time [s],x [rad],x [deg]\n0,1,2\n1,2,3\n", "column 'x' appears 2 times -- expected once"),
    "no_unit": (b"time [s],x_in\n0,1\n1,2\n", "column 'x_in' has no unit -- expected 'name"),
    "blank_unit": (b"time [s],x_in []\n0,1\n1,2\n", r"column 'x_in \[\]' has no unit"),
    "blank_name": (b"time [s],[rad]\n0,1\n1,2\n", r"column '\[rad\]' has no unit -- expected 'name"),
    "prose": (
        b"dear all\nplease find below\nnothing\n",
        "no names over rows of numbers in rows 1 to 3 -- expected a header",
    ),
    "both_decimals": (b"time [s];x [rad]\n0,5;1.000,5\n1;2\n", "'0,5' in row 2, column 'time .*' -- expected a number"),
    "text_column": (b"time [s],x [rad]\n0,low\n1,high\n", r"column 'x \[rad\]' holds text \('low'\)"),
    "day_first": (b"time,x [rad]\n04.05.2026 13:00,1\n04.05.2026 13:01,2\n", "'04.05.2026 13:00' in row 2, .*ISO 8601"),
    "unknown_unit": (
        b"time [s],x [radians2go]\n0,1\n1,2\n",
        "column 'x': unit 'radians2go' -- expected a unit that pint",
    ),
    "ambiguous_unit": (
        b"time [s],T [oz.in]\n0,1\n1,2\n",
        r"column 'T': unit 'oz\.in' -- expected one meaning -- write ozf\.in",
    ),
    "no_time": (b"x [rad],clock [s]\n0,1\n1,2\n", r"first column is 'x' -- expected 'time \[s\]'"),
    "time_unit": (b"time [m],x [rad]\n0,1\n1,2\n", "time in 'm' -- expected a unit of time"),
    "text": (HEAD.encode() + b"0,1,2\n1,2,oops\n2,3,4\n", "'oops' in row 3, column 'tau_in.*' -- expected a number"),
    "comma_decimal": (HEAD.encode() + b"0,1,2\n1,2,3,5\n", "4 cells in row 3 -- expected 3 as in the header"),
    "short_row": (HEAD.encode() + b"0,1,2\n1,2\n2,3,4\n", "2 cells in row 3 -- expected 3"),
    "nan": (
        HEAD.encode() + b"0,1,2\n1,2,NaN\n2,3,nan\n",
        r"NaN or empty cell in row 3, column 'tau_in' \(t = 1 s\), 2 such",
    ),
    "cell_empty": (HEAD.encode() + b"0,1,2\n1,,3\n", "NaN or empty cell in row 3, column 'x_in'"),
    "infinite": (HEAD.encode() + b"0,1,2\n1,inf,3\n", "infinite cell in row 3, column 'x_in'"),
    "blank_row": (HEAD.encode() + b"0,1,2\n\n2,3,4\n", "time is nan in row 3 -- expected a number"),
    "repeated": (HEAD.encode() + b"0,1,2\n1,2,3\n1,2,4\n", r"time repeats in row 4: 1 s after 1 s -- expected"),
    "backward": (HEAD.encode() + b"0,1,2\n1,2,3\n0.75,2,4\n2,3,4\n", r"time goes back in row 4: 0\.75 s after 1 s"),
    "time_without_unit": (b"time,x [rad]\n0,1\n1,2\n", r"column 'time' has no unit .* --map \"time=time \[UNIT\]\""),
    "utf16_cut": (b"\xff\xfe" + HEAD.encode("utf-16-le")[:-1], "is not UTF-16, as its byte-order mark says"),
    "zero_bytes": (HEAD.encode() + b"0,1,\x00\n", "holds zero bytes"),
}


@pytest.mark.parametrize("case", CASES)
def test_csv(tmp_path, case):
    content, message = CASES[case]
    path = tmp_path / "run.csv"
    path.write_bytes(content)
    with pytest.raises(InputError, match=message) as caught:
        read_record(path)
    assert "run.csv" in str(caught.value)
    assert "\n" not in str(caught.value)


def test_missing_file_and_folder(tmp_path):
    with pytest.raises(InputError, match=r"nowhere\.csv does not exist -- expected a measured run"):
        read_record(tmp_path / "nowhere.csv")
    with pytest.raises(InputError, match="directory -- expected a readable file"):
        read_record(tmp_path)


def test_damaged_gzip(tmp_path):
    path = tmp_path / "run.csv.gz"
    whole = gzip.compress((HEAD + "".join(f"{k},{k * 0.37},{k * k}\n" for k in range(500))).encode())
    path.write_bytes(whole)
    assert read_record(path).time.size == 500
    path.write_bytes(whole[: len(whole) // 2])
    with pytest.raises(InputError, match=r"run\.csv\.gz: .* -- expected a whole gzip file -- copy it again"):
        read_record(path)
    broken = bytearray(whole)
    broken[len(whole) // 2] ^= 0x5A
    path.write_bytes(bytes(broken))
    with pytest.raises(InputError, match="expected a whole gzip file"):
        read_record(path)
    path.write_bytes(HEAD.encode())
    with pytest.raises(InputError, match="does not start as gzip"):
        read_record(path)


def test_damaged_parquet_and_columns_of_text(tmp_path):
    path = tmp_path / "run.parquet"
    pq.write_table(pa.table({"time [s]": [0.0, 1.0], "x [rad]": ["a", "b"]}), path)
    with pytest.raises(InputError, match=r"column 'x \[rad\]' holds text .* -- expected numbers"):
        read_record(path)
    pq.write_table(pa.table({"time [ms]": [0, 10], "x [rad]": [1.5, None]}), path)
    with pytest.raises(InputError, match=r"NaN or empty cell in row 3, column 'x' \(t = 0\.01 s\)"):
        read_record(path)
    path.write_bytes(path.read_bytes()[:-20])
    with pytest.raises(InputError, match="expected a whole Parquet file"):
        read_record(path)


def test_command_line_says_it_in_one_line_and_exits_with_2(tmp_path, capsys):
    path = tmp_path / "run.csv"
    path.write_bytes(HEAD.encode() + b"0,1,2\n1,2,oops\n")
    assert run(["check", str(path)]) == 2
    said = capsys.readouterr()
    assert said.out == ""
    assert said.err.count("\n") == 1
    assert "'oops' in row 3" in said.err


@pytest.mark.parametrize("suffix", [".csv", ".csv.gz", ".parquet"])
def test_damaged_bytes_are_read_or_refused_never_a_crash(tmp_path, suffix):
    noise = np.random.default_rng(20)
    time = np.arange(40) / 7.0
    path = write_record(tmp_path / f"run{suffix}", time, {"x": np.sin(time)}, {"x": "rad"})
    whole = path.read_bytes()
    refused = []
    for _ in range(300):
        damaged = bytearray(whole)
        for at in noise.integers(0, len(whole), noise.integers(1, 4)):
            damaged[at] = noise.integers(0, 256)
        path.write_bytes(bytes(damaged[: noise.integers(len(whole) // 2, len(whole) + 1)]))
        try:
            run = read_record(path)
        except InputError as wrong:
            refused.append(str(wrong))
        else:
            assert isinstance(run, Record)
    assert len(refused) > 100
    assert not [message for message in refused if "\n" in message or " -- expected " not in message]
