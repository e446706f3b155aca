"""Binary logs give the numbers that were written, to the last bit; a reader that is missing is named."""

import sys

import numpy as np
import pytest
from scipy.io import savemat

from tsm_fmu.logs.record import read_record
from tsm_fmu.models.contract import InputError

TIME = np.arange(211) / 250.0
NOISE = np.random.default_rng(88)
X = np.sin(7.3 * TIME) + 1e-3 * NOISE.standard_normal(TIME.size)
TAU = 0.3 * np.cos(7.3 * TIME) + 0.1
MAPPING = {"t": "time [s]", "x": "x_in [rad]", "tau": "tau_in [N.m]"}


def same(path, mapping=None, time=TIME, x=X, tau=TAU):
    run = read_record(path, mapping=mapping)
    np.testing.assert_array_equal(run.time, time)
    np.testing.assert_array_equal(run.columns["x_in"], x)
    np.testing.assert_array_equal(run.columns["tau_in"], tau)
    assert dict(run.units) == {"x_in": "rad", "tau_in": "N.m"}
    return run


def test_excel_with_title_and_row_of_units(tmp_path):
    import openpyxl

    time, x, tau = (np.array([float(f"{v:.12f}") for v in column]) for column in (TIME, X, TAU))
    book = openpyxl.Workbook()
    sheet = book.create_sheet("samples")
    for row in (["Rig 3"], ["time", "x_in", "tau_in"], ["s", "rad", "N.m"]):
        sheet.append(row)
    for row in zip(time, x, tau, strict=True):
        sheet.append([float(value) for value in row])
    book.save(tmp_path / "own.xlsx")
    run = same(tmp_path / "own.xlsx", None, time, x, tau)
    assert run.row(0) == 4
    assert {"sheet 'samples' of 2", "units in row 3"} <= set(run.notes)
    sheet["B9"] = "oops"
    book.save(tmp_path / "own.xlsx")
    with pytest.raises(InputError, match="'oops' in row 9, column 'x_in' -- expected a number"):
        read_record(tmp_path / "own.xlsx")


def test_matlab_structures_and_version_7_3(tmp_path):
    import h5py

    savemat(tmp_path / "own.mat", {"log": {"t": TIME, "x": X, "tau": TAU}, "fs": 250.0, "note": "rig 3"})
    same(tmp_path / "own.mat", MAPPING)
    with pytest.raises(InputError, match="column 't' has no unit"):
        read_record(tmp_path / "own.mat")
    with h5py.File(tmp_path / "new.mat", "w", userblock_size=512) as file:
        for name, values in (("t", TIME), ("x", X), ("tau", TAU)):
            file.create_dataset(name, data=values[None, :])
    content = bytearray((tmp_path / "new.mat").read_bytes())
    content[:19] = b"MATLAB 7.3 MAT-file"
    (tmp_path / "new.mat").write_bytes(content)
    same(tmp_path / "new.mat", MAPPING)


def test_hdf5_with_units_as_attributes(tmp_path):
    import h5py

    with h5py.File(tmp_path / "own.h5", "w") as file:
        for name, values, unit in (("time", TIME, "s"), ("x_in", X, "rad"), ("tau_in", TAU, b"N.m")):
            file.create_dataset(f"run/{name}", data=values).attrs["units"] = unit
        file["other"] = np.zeros(3)
    assert "other: not 211 samples long, left out" in same(tmp_path / "own.h5").notes


def test_tdms_with_the_time_of_its_increment(tmp_path):
    from nptdms import ChannelObject, TdmsWriter

    with TdmsWriter(tmp_path / "own.tdms") as writer:
        writer.write_segment([
            ChannelObject("g", name, values, properties={"unit_string": unit, "wf_increment": 1 / 256})
            for name, values, unit in (("x_in", X, "rad"), ("tau_in", TAU, "N.m"))
        ])  # fmt: skip
    same(tmp_path / "own.tdms", None, np.arange(TIME.size) / 256)


@pytest.mark.parametrize("storage", ["MCAP", "SQLITE3"])
def test_ros_joint_states(tmp_path, storage):
    from rosbags.rosbag2 import StoragePlugin, Writer
    from rosbags.typesys import Stores, get_typestore

    store = get_typestore(Stores.LATEST)
    joint, header, stamp = (
        store.types[f"{name}"]
        for name in ("sensor_msgs/msg/JointState", "std_msgs/msg/Header", "builtin_interfaces/msg/Time")
    )
    bag = tmp_path / "bag"
    with Writer(bag, version=9, storage_plugin=StoragePlugin[storage]) as writer:
        topic = writer.add_connection("/joint_states", joint.__msgtype__, typestore=store)
        for t, x, tau in zip(TIME, X, TAU, strict=True):
            ns = 1_700_000_000_000_000_000 + round(t * 1e9)
            message = joint(
                header=header(stamp=stamp(sec=ns // 10**9, nanosec=ns % 10**9), frame_id=""), name=["motor"],
                position=np.array([x]), velocity=np.zeros(0), effort=np.array([tau]),
            )  # fmt: skip
            writer.write(topic, ns + 12345, store.serialize_cdr(message, joint.__msgtype__))
    file = next(p for p in bag.iterdir() if p.suffix in (".mcap", ".db3"))
    same(file, {"position.motor": "x_in [rad]", "effort.motor": "tau_in [N.m]"})


def test_a_bag_of_ros_1(tmp_path):
    from rosbags.rosbag1 import Writer
    from rosbags.typesys import Stores, get_typestore

    store = get_typestore(Stores.ROS1_NOETIC)
    joint, header, stamp = (
        store.types[name]
        for name in ("sensor_msgs/msg/JointState", "std_msgs/msg/Header", "builtin_interfaces/msg/Time")
    )
    bag = tmp_path / "own.bag"
    with Writer(bag) as writer:
        topic = writer.add_connection("/joint_states", joint.__msgtype__, typestore=store)
        for k, (t, x, tau) in enumerate(zip(TIME, X, TAU, strict=True)):
            ns = 1_500_000_000_000_000_000 + round(t * 1e9)
            message = joint(
                header=header(seq=k, stamp=stamp(sec=ns // 10**9, nanosec=ns % 10**9), frame_id=""), name=["motor"],
                position=np.array([x]), velocity=np.zeros(0), effort=np.array([tau]),
            )  # fmt: skip
            writer.write(topic, ns + 777, store.serialize_ros1(message, joint.__msgtype__))
    run = same(bag, {"position.motor": "x_in [rad]", "effort.motor": "tau_in [N.m]"})
    assert any("/joint_states" in note for note in run.notes)


@pytest.mark.parametrize(
    ("suffix", "module", "extra"),
    [
        (".xlsx", "openpyxl", "excel"),
        (".h5", "h5py", "hdf5"),
        (".tdms", "nptdms", "tdms"),
        (".mcap", "rosbags", "ros"),
        (".bag", "rosbags", "ros"),
    ],
)
def test_a_missing_reader_and_a_damaged_file_are_one_line(tmp_path, monkeypatch, suffix, module, extra):
    path = tmp_path / f"own{suffix}"
    path.write_bytes(b"no such thing " * 20)
    with pytest.raises(InputError, match=r"-- expected a whole .* file -- copy or save it again"):
        read_record(path)
    monkeypatch.setitem(sys.modules, module, None)
    for name in [name for name in sys.modules if name.startswith(f"{module}.")]:
        monkeypatch.setitem(sys.modules, name, None)
    with pytest.raises(InputError, match=rf"{module} is not installed .* pip install 'tsm-fmu\[{extra}\]'"):
        read_record(path)


@pytest.mark.parametrize("turned", [False, True])
def test_a_matrix_is_its_columns_by_number_whichever_way_it_lies(tmp_path, turned):
    whole = np.column_stack([TIME, X, TAU])
    savemat(tmp_path / "own.mat", {"log": {"M": whole.T if turned else whole}})
    same(tmp_path / "own.mat", {"M(1)": "time [s]", "M(2)": "x_in [rad]", "M(3)": "tau_in [N.m]"})
