"""The typer application and what every verb shares: exit codes, one-line errors, JSON output.

Exit codes: 0 done, 2 wrong use or bad input (one line on stderr), 1 a defect of ours, 130 interrupted.
"""

from __future__ import annotations

import errno
import json
import math
import os
import signal
import sys
import threading
import traceback
from collections.abc import Mapping, Sequence
from types import TracebackType
from typing import Annotated, Any

import typer

from .. import __version__
from ..logs.plain_json import finite
from ..models.contract import InputError

app = typer.Typer(
    name="tsm-fmu",
    context_settings={"help_option_names": ["-h", "--help"]},
    pretty_exceptions_enable=False,
    rich_markup_mode=None,
)

_NO_ROOM_OR_RIGHTS = {errno.ENOSPC, errno.EDQUOT, errno.EFBIG, errno.EROFS, errno.EACCES, errno.EPERM, errno.EIO}
"""Of the machine, not of us: a disk that is full, folders that may not be written."""

AsJson = Annotated[bool, typer.Option("--json", help="One JSON object on stdout.")]


def _print_version(wanted: bool) -> None:
    if wanted:
        typer.echo(__version__)
        raise typer.Exit


@app.callback()
def _options(
    version: Annotated[
        bool, typer.Option("--version", help="Print the version and stop.", is_eager=True, callback=_print_version)
    ] = False,
) -> None:
    """Tendon-sheath drives as FMI units: check, identify, diagnose, export, co-simulate."""


def main(arguments: Sequence[str] | None = None) -> None:
    """Run the command line and exit with its code; a request to end the process keeps what Ctrl-C keeps."""
    sys.excepthook, sys.unraisablehook = _show_defects, _ask_again
    try:
        for name in ("SIGTERM", "SIGHUP"):
            number = getattr(signal, name, None)
            if number is not None and signal.getsignal(number) is not signal.SIG_IGN:
                signal.signal(number, signal.default_int_handler)
        code = run(arguments)
        signal.signal(signal.SIGINT, signal.SIG_DFL)  # from here on an interrupt ends the process without a traceback
    except KeyboardInterrupt:
        code = _say("interrupted", 130)
    sys.exit(code)


def _show_defects(kind: type[BaseException], value: BaseException, where: TracebackType | None) -> None:
    """Compiled code that cannot raise shows what it drops here, a Ctrl-C too, before `_ask_again` is told of it."""
    if not issubclass(kind, KeyboardInterrupt):
        sys.__excepthook__(kind, value, where)


def _ask_again(ignored: sys.UnraisableHookArgs) -> None:
    """Python drops what a finalizer or some compiled code raises, a Ctrl-C too: it is asked for again in a moment."""
    if issubclass(ignored.exc_type, KeyboardInterrupt):
        later = threading.Timer(0.01, _interrupt)
        later.daemon = True
        later.start()
    else:
        sys.__unraisablehook__(ignored)


def _interrupt() -> None:
    if hasattr(signal, "pthread_kill"):
        signal.pthread_kill(threading.main_thread().ident or 0, signal.SIGINT)  # also wakes what waits there
    else:
        signal.raise_signal(signal.SIGINT)


def run(arguments: Sequence[str] | None = None) -> int:
    """Run the command line; return the exit code instead of leaving the process."""
    given = list(sys.argv[1:] if arguments is None else arguments) or ["--help"]
    try:
        command = typer.main.get_command(app)
        # not command.main(), which turns Ctrl-C into a code without the words that came with it
        with command.make_context("tsm-fmu", given) as context:
            command.invoke(context)
        sys.stdout.flush()
    except InputError as wrong:
        return _say(str(wrong), 2)
    except KeyboardInterrupt as stopped:
        return _say(str(stopped) or "interrupted", 130)
    except typer.Exit as done:
        return done.exit_code
    except BrokenPipeError:
        _drop_output()
        return 0
    except SystemExit as left:  # how rich leaves when the reader of the pipe has gone
        if isinstance(left.__context__, BrokenPipeError):
            return 0
        raise
    except Exception as failure:
        parser_message = getattr(failure, "format_message", None)
        if parser_message is not None:
            wrong = parser_message().rstrip(".")
            return _say(_wrong_value(failure) or f"{wrong} -- expected what the help lists -- see {_help(failure)}", 2)
        if isinstance(failure, OSError) and failure.errno in _NO_ROOM_OR_RIGHTS:
            if failure.filename is None:
                _drop_output()
            where = failure.filename or "output"
            return _say(f"{where}: {failure.strerror} -- expected room and rights to write -- make room or move", 2)
        traceback.print_exc()
        return _say(f"internal error: {failure!r} -- a defect of ours, please report it with the lines above", 1)
    return 0


def print_json(value: Mapping[str, Any]) -> None:
    """Write one JSON object on stdout; numbers that are not finite become null."""
    typer.echo(json.dumps(finite(value), indent=2))


def print_result(result: Any, lines: Sequence[str], as_json: bool) -> None:
    """Write ``lines`` on stderr; then the result as one JSON object, or its summary and where its files are."""
    for line in lines:
        typer.echo(line, err=True)
    if as_json:
        print_json(result.as_json())
    else:
        typer.echo(f"{result.summary()}\nresults {result.results}\nreport  {result.report}")


def refuse_failures(result: Any, all_of_them: Sequence[object], what: str) -> None:
    """End with exit code 2 where some of many failed; the others are kept."""
    if result.failures:
        raise InputError(
            f"{len(result.failures)} of {len(all_of_them)} {what} failed -- expected none -- see the lines above; the "
            f"others are in {result.results}"
        )


def settings(pairs: Sequence[str], option: str = "--set") -> dict[str, str]:
    """Split repeated ``name=value`` options.

    Raises
    ------
    InputError
        If an item has no ``=``, no name, or repeats a name.
    """
    found: dict[str, str] = {}
    for pair in pairs:
        name, sign, value = pair.partition("=")
        if not sign or not name or name in found:
            raise InputError(
                f"{option} {pair!r} -- expected name=value, each name once -- for example {option} alpha=10"
            )
        found[name] = value
    return found


def number_settings(pairs: Mapping[str, str], option: str = "--set") -> dict[str, float]:
    """Values of ``name=value`` options as numbers.

    Raises
    ------
    InputError
        If a value is not a finite number.
    """
    found = {}
    for name, text in pairs.items():
        try:
            found[name] = float(text)
        except ValueError:
            found[name] = math.nan
        if not math.isfinite(found[name]):
            raise InputError(f"{option} {name}={text} -- expected a finite number -- for example {name}=0.5")
    return found


def _drop_output() -> None:
    """What is still to be printed goes nowhere: who read it has gone, or there is no room for it."""
    os.dup2(os.open(os.devnull, os.O_WRONLY), sys.stdout.fileno())


def _wrong_value(failure: Exception) -> str:
    """The parser's complaint about a value, with option and value; empty where it is about something else."""
    details, parameter = getattr(failure.__cause__, "errors", None), getattr(failure, "param", None)
    if details is None or parameter is None:
        return ""
    first = details()[0]
    name = parameter.opts[0] if parameter.param_type_name == "option" else str(parameter.name)
    if "\0" in str(first["input"]):
        return f"{name} {first['input']!r} -- expected the name of a file, without zero bytes -- correct it"
    expected = first["msg"].removeprefix("Input should be ").split(", unable")[0]
    expected = expected.rpartition(" is not ")[2].rstrip(".")
    return f"{name} {first['input']!r} -- expected {expected} -- correct it"


def _help(failure: Exception) -> str:
    context = getattr(failure, "ctx", None)
    return f"'{context.command_path if context is not None else 'tsm-fmu'} --help'"


def _say(message: str, code: int) -> int:
    print("tsm-fmu: " + " ".join(message.split()), file=sys.stderr)
    return code
