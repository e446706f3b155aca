"""Work in processes of this machine: which process does what, what one that dies costs, and what is left behind."""

from __future__ import annotations

import multiprocessing
import os
import signal
import sys
from multiprocessing.connection import Connection
from pathlib import Path

import pytest

from tsm_fmu.batching import processes as module
from tsm_fmu.batching.mapped import here
from tsm_fmu.batching.processes import cores, exit_in_words, processes, without_main
from tsm_fmu.batching.run import run_batch
from tsm_fmu.models.contract import InputError

LOST = "{}: {}".format  # what goes to other processes is importable there; so is eval
ITS_TRY = "(lambda f: (f.write(b'.'), f.flush(), f.tell())[2])(open({!r}, 'ab', 0))"
"""Counts in a file how often an item was begun: 1 at the first try."""


def test_each_item_is_done_once_or_lost_in_words_and_no_process_stays(tmp_path: Path) -> None:
    """Items that work, that die once or always, that raise, that send Ctrl-C: each costs itself alone."""
    once, always, dozes = (str(tmp_path / name) for name in ("once", "always", "dozes"))
    items = [
        "2**7",
        f"{ITS_TRY.format(always)} and __import__('os')._exit(3)",
        "1/0",
        f"'second' if {ITS_TRY.format(once)} == 2 else __import__('os').kill(__import__('os').getpid(), 9)",
        "(_ for _ in ()).throw(KeyboardInterrupt)",
        "__import__('signal').getsignal(__import__('signal').SIGINT).name",
        f"{ITS_TRY.format(dozes)}, __import__('time').sleep(0.3)",
        "3**5",
    ]
    done: dict[int, object] = {7: "kept from before"}
    counts: list[int] = []
    told: list[tuple[int, object]] = []
    run_batch(eval, items, done, lost=LOST, keep=lambda *new: told.append(new), workers=2, advance=counts.append)
    assert (done[0], done[3], done[5], done[7]) == (128, "second", "SIG_IGN", "kept from before")
    assert done[1] == f"{items[1]}: it ended its process with exit code 3, 2 times"
    assert done[4] == f"{items[4]}: it ended its process with exit code 0, 2 times"
    assert str(done[2]).startswith("1/0: internal error: ZeroDivisionError")
    assert [Path(p).stat().st_size for p in (once, always, dozes)] == [2, 2, 1]
    assert counts == list(range(2, 9))
    assert {number: done[number] for number in range(7)} == dict(told)
    assert len(told) == 7
    assert not multiprocessing.active_children()


def test_as_many_processes_work_as_are_asked_for_and_all_end_with_who_asked():
    slow = "(__import__('time').sleep(0.4), __import__('os').getpid())[1]"
    mapped = processes(3, 9)
    results = mapped(eval, ((10 + k, slow) for k in range(9)), LOST)
    first = [next(results) for _ in range(3)]
    assert len({process for _, process in first} - {os.getpid()}) == 3
    assert {number for number, _ in first} == {10, 11, 12}
    assert len(multiprocessing.active_children()) == 3
    results.close()
    assert not multiprocessing.active_children()


def test_one_process_or_one_item_is_this_process(monkeypatch):
    assert processes(1, 9) is here
    assert processes(5, 1) is here
    assert processes(2, 0) is here
    with pytest.raises(InputError, match="workers 0 -- expected 1 or more"):
        processes(0, 9)
    monkeypatch.setattr(module, "cores", lambda: 4)
    asked = [(2, 2), (5, 3), (3, 9), (None, 9), (None, 3)]
    assert [processes(*a).args for a in asked] == [(2,), (3,), (3,), (4,), (3,)]
    monkeypatch.setattr(module, "cores", lambda: 1)
    assert processes(None, 9) is here


def test_processors_are_those_this_process_may_use(monkeypatch):
    monkeypatch.setattr(os, "cpu_count", lambda: 7)
    monkeypatch.setattr(os, "sched_getaffinity", lambda pid: {1, 4, 6} if pid == 0 else set(), raising=False)
    assert cores() == 3
    monkeypatch.delattr(os, "sched_getaffinity")
    assert cores() == 7
    monkeypatch.setattr(os, "cpu_count", lambda: None)
    assert cores() == 1


def test_how_a_process_ended_in_words():
    assert [exit_in_words(code) for code in (0, 3, -9)] == ["with exit code 0", "with exit code 3", "by SIGKILL"]


def test_the_callers_script_is_hidden_only_while_a_process_starts(monkeypatch):
    main = sys.modules["__main__"]
    monkeypatch.setattr(main, "__file__", "script.py", raising=False)
    monkeypatch.setattr(main, "__spec__", "its spec", raising=False)

    def start() -> None:
        with without_main():
            assert main.__spec__ is None
            assert not hasattr(main, "__file__")
            raise OSError("no process")

    with pytest.raises(OSError, match="no process"):
        start()
    assert (main.__file__, main.__spec__) == ("script.py", "its spec")


@pytest.mark.skipif(os.name == "nt", reason="a pipe there keeps nothing of a sender that has gone")
@pytest.mark.parametrize("gone", [False, True])
def test_a_process_ends_when_the_one_that_started_it_has_gone(monkeypatch, gone):
    """Before an item, or with a result that nobody takes."""
    monkeypatch.setattr(signal, "signal", lambda *_: None)
    own, other = multiprocessing.Pipe()
    for item in ("2**7", "1/0")[: 1 + gone]:
        other.send(item)
    if gone:
        other.close()
        module._serve(own, eval, LOST)
        return

    class Closing(Connection):
        """Closes the other end with the first result."""

        def send(self, obj: object) -> None:
            super().send(obj)
            sent.append(other.recv())
            other.close()

    sent: list[object] = []
    module._serve(Closing(os.dup(own.fileno())), eval, LOST)
    assert sent == [128]


def test_ctrl_c_of_an_item_ends_its_process_without_a_word(monkeypatch, capfd):
    monkeypatch.setattr(signal, "signal", lambda *_: None)
    own, other = multiprocessing.Pipe()
    other.send("(_ for _ in ()).throw(KeyboardInterrupt)")
    module._serve(own, eval, LOST)
    assert not other.poll()
    assert capfd.readouterr() == ("", "")
