"""What makes up for PythonFMU's library, against memory laid out as that library has it."""

import ctypes
import sys
import threading

import pytest

from tsm_fmu.fmu import library_faults
from tsm_fmu.fmu.library_faults import _LOG, HostLog, _Callbacks, _Logger, give_back, keep_thread_state

pytestmark = pytest.mark.skipif(sys.platform != "linux", reason="the layout is that of the Linux library")


class Library:
    """A logger of the library for an instance, and what the host was told."""

    def __init__(self, name: str, on: bool = False, with_logger: bool = True) -> None:
        self.told: list[tuple[int | None, bytes, int, bytes, bytes]] = []
        self.log = _LOG(lambda *message: self.told.append(message))
        logger = ctypes.cast(self.log, ctypes.c_void_p) if with_logger else None
        self.callbacks = _Callbacks(logger=logger, environment=4711)
        self.text = ctypes.create_string_buffer(name.encode())
        self.logger = _Logger(
            on=on,
            name=ctypes.addressof(self.text),
            name_length=len(name.encode()),
            callbacks=ctypes.pointer(self.callbacks),
        )
        self.address = ctypes.addressof(self.logger)


def test_the_offsets_are_those_of_the_library():
    """Of Fmi2Logger in PythonFMU 0.7.0 and of fmi2CallbackFunctions, in bytes."""
    logger = [_Logger.on.offset, _Logger.name.offset, _Logger.name_length.offset, _Logger.callbacks.offset]
    assert logger == [8, 16, 24, 72]
    assert [_Callbacks.logger.offset, _Callbacks.environment.offset] == [0, 32]


def test_a_message_goes_to_the_host_with_its_environment_name_status_and_category():
    library = Library("drive 1")
    log = HostLog(library.address, "drive 1")
    assert log.is_shut()
    assert not log.is_missing()
    log.tell(3, "logStatusError", "too steep, 2 µm")
    assert library.told == [(4711, b"drive 1", 3, b"logStatusError", "too steep, 2 µm".encode())]


def test_the_switch_is_read_when_it_is_asked_for():
    library = Library("one", on=True)
    log = HostLog(library.address, "one")
    assert not log.is_shut()
    library.logger.on = False
    assert log.is_shut()


@pytest.mark.parametrize("name", ["another", "on", "ona", ""])
def test_memory_that_does_not_hold_the_instance_name_is_left_alone(name):
    library = Library("one")
    log = HostLog(library.address, name)
    assert not log.is_shut()
    assert not log.is_missing()
    log.tell(3, "logStatusError", "text")
    assert library.told == []


def test_without_a_library_nothing_is_shut_and_nothing_is_told():
    log = HostLog(0, "one")
    assert (log.is_shut(), log.is_missing()) == (False, False)
    log.tell(3, "logStatusError", "text")


def test_a_host_without_a_logger_is_known():
    library = Library("one", with_logger=False)
    log = HostLog(library.address, "one")
    assert log.is_missing()
    log.tell(3, "logStatusError", "text")
    assert library.told == []


def test_a_reference_that_the_library_forgot_is_given_back_and_no_other():
    texts = ["text " * n for n in (3, 4)]  # made at run time: constants have references of their own
    counts = [sys.getrefcount(text) for text in texts]
    ctypes.pythonapi.Py_IncRef(ctypes.py_object(texts[0]))
    for _ in range(3):
        for text in texts:
            give_back(text)
    del text
    assert [sys.getrefcount(text) for text in texts] == counts


def in_threads(many: int) -> None:
    for _ in range(many):
        thread = threading.Thread(target=lambda: [keep_thread_state() for _ in range(5)])
        thread.start()
        thread.join()


def test_each_thread_keeps_its_state_once_and_no_more_than_some(monkeypatch):
    monkeypatch.setattr(library_faults, "_n_kept", 0)
    monkeypatch.setattr(library_faults, "KEPT_THREADS", 7)
    in_threads(3)
    assert library_faults._n_kept == 3
    in_threads(9)
    assert library_faults._n_kept == 7
