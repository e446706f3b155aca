"""Make ``.venv`` with the pinned packages; called by the Makefile, needs nothing but a Python.

Written for any Python 3, so that an unsupported one gets a message and not a syntax error.
"""

import os
import shutil
import subprocess
import sys

SUPPORTED = ("3.11", "3.12", "3.13")
ROOT = os.path.dirname(os.path.dirname(os.path.abspath(__file__)))
VENV = os.path.join(ROOT, ".venv")


def main(extra):
    """Create the environment with the optional dependency group ``extra`` ('' for none)."""
    python = supported_python()
    if python is None:
        found = "%d.%d" % sys.version_info[:2]
        sys.exit(
            "setup: Python %s (%s) -- expected one of %s -- install one, or name it: make PYTHON=/path/to/python3.12"
            % (found, sys.executable, ", ".join(SUPPORTED))
        )
    inside = os.path.join(VENV, "bin", "python")
    if version_of(inside) not in SUPPORTED:
        subprocess.check_call([python, "-m", "venv", "--clear", VENV])
    target = ROOT + ("[%s]" % extra if extra else "")
    constraints = os.path.join(ROOT, "constraints.txt")
    pip = [inside, "-m", "pip", "install", "--quiet", "--disable-pip-version-check", "--no-compile"]
    print("setup: installing the pinned packages into .venv (about a minute the first time)", flush=True)
    failed = subprocess.call([*pip, "--constraint", constraints, "--editable", target])
    if not failed:  # half of pip's time, which it spends on one processor; templates among the files do not compile
        compiling = [inside, "-m", "compileall", "-qq", "-j", "0", "-x", "/tests?/", "lib"]  # a third is their tests
        subprocess.call(compiling, cwd=VENV, stdout=subprocess.DEVNULL, stderr=subprocess.DEVNULL)
    sys.exit(failed)


def supported_python():
    """Find a supported interpreter: the running one first, then those on PATH."""
    candidates = [sys.executable] + [shutil.which("python" + v) for v in reversed(SUPPORTED)]
    for python in candidates:
        if python and version_of(python) in SUPPORTED:
            return python
    return None


def version_of(python):
    """Version of an interpreter as '3.11', or None where it does not run."""
    try:
        out = subprocess.check_output(
            [python, "-c", "import sys; print('%d.%d' % sys.version_info[:2])"], stderr=subprocess.DEVNULL
        )
    except (OSError, subprocess.CalledProcessError):
        return None
    return out.decode().strip()


if __name__ == "__main__":
    main(sys.argv[1] if len(sys.argv) > 1 else "")
