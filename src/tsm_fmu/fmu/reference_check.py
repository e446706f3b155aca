"""Check of the reference results in an FMU: present, undamaged, and of the variables that the FMU has.

Whether the FMU reproduces them is for a replay to say; this reads files only.
"""

from __future__ import annotations

import math
from collections.abc import Iterable, Iterator, Mapping
from xml.etree import ElementTree
from xml.etree.ElementTree import Element

from .reference import FOLDER, MANIFEST, checksum

AGAIN = "build the FMU again"


class _Broken(Exception):
    """What is wrong with one file; the checks that need it end here."""


def reference_problems(description: Element, files: Mapping[str, bytes]) -> list[str]:
    """Problems of the reference results, one line each.

    Parameters
    ----------
    description : Element
        Root of the model description.
    files : mapping of str to bytes
        All files of the FMU by archive path.
    """
    try:
        manifest = _parsed(files, MANIFEST)
        experiments = [r.get("source", "") for r in manifest if r.get("role", "").startswith("experiment/")]
        if not experiments:
            raise _Broken(f"{MANIFEST} lists no experiment -- expected at least one -- {AGAIN}")
    except _Broken as failure:
        return [str(failure)]
    found = list(_damaged(manifest, files))
    for source in experiments:
        try:
            for experiment in _parsed(files, f"{FOLDER}/{source}").iter("Experiment"):
                _check(experiment, description, files)
        except _Broken as failure:
            found.append(str(failure))
    return list(dict.fromkeys(found))


def _damaged(manifest: Element, files: Mapping[str, bytes]) -> Iterator[str]:
    for related in manifest:
        path = f"{FOLDER}/{related.get('source')}"
        if path not in files:
            yield f"{path} is missing -- expected what the manifest lists -- {AGAIN}"
        elif checksum(files[path]) != related.get("checksum"):
            yield f"{path} has not the checksum of the manifest -- it was changed after the build -- {AGAIN}"


def _check(experiment: Element, description: Element, files: Mapping[str, bytes]) -> None:
    stop, step = (_finite(experiment.get(name), f"{name} of an experiment") for name in ("stopTime", "stepSize"))
    rows = {}
    for element, causality in (("Stimuli", "input"), ("References", "output")):
        names = [v.get("name", "") for v in _variables(description) if v.get("causality") == causality]
        node = experiment.find(element)
        if node is None:
            if names:
                raise _Broken(f"experiment {experiment.get('name')} names no {element} -- expected a CSV -- {AGAIN}")
            continue
        path = f"{FOLDER}/{node.get('source')}"
        rows[path] = _times(path, ["time", *names], files)
    for path, times in rows.items():
        if not times or times[-1] < stop or any(t != k * step for k, t in enumerate(times)):
            raise _Broken(f"{path} has not a row at every {step!r} s up to {stop!r} s -- expected all -- {AGAIN}")
    _check_parameters(experiment, description, files)


def _times(path: str, columns: list[str], files: Mapping[str, bytes]) -> list[float]:
    header, *lines = _content(files, path).decode(errors="replace").splitlines() or [""]
    found = [name.strip('"') for name in header.split(",")]
    if found != columns:
        raise _Broken(f"{path} has the columns {', '.join(found)} -- expected {', '.join(columns)} -- {AGAIN}")
    times = []
    for number, line in enumerate(lines, start=2):
        cells = line.split(",")
        if len(cells) != len(columns):
            raise _Broken(f"{path} has {len(cells)} cells in line {number} -- expected {len(columns)} -- {AGAIN}")
        numbers = [_finite(cell, f"{path}, line {number},") for cell in cells]
        times.append(numbers[0])
    return times


def _check_parameters(experiment: Element, description: Element, files: Mapping[str, bytes]) -> None:
    starts = {
        v.get("name"): value.get("start")
        for v in _variables(description)
        if v.get("causality") == "parameter" and v.find("Dimension") is None
        for value in (v, *v)  # FMI 2.0 has the start value in an element inside
        if value.get("start") is not None
    }
    node = experiment.find("Parameters")
    path = f"{FOLDER}/{'' if node is None else node.get('source')}"
    given = {
        parameter.get("name"): value.get("value")
        for parameter in _parsed(files, path).findall(".//{*}Parameter")
        for value in parameter
    }
    wrong = sorted(str(name) for name in starts.keys() | given.keys() if starts.get(name) != given.get(name))
    if wrong:
        raise _Broken(f"{path} differs in {', '.join(wrong)} -- expected the FMU's start values -- {AGAIN}")


def _variables(description: Element) -> Iterable[Element]:
    listed = description.find("ModelVariables")
    return () if listed is None else listed


def _finite(text: str | None, what: str) -> float:
    try:
        number = float(text or "nan")
    except ValueError:
        number = math.nan
    if not math.isfinite(number):
        raise _Broken(f"{what} is {text!r} -- expected a finite number -- {AGAIN}")
    return number


def _content(files: Mapping[str, bytes], path: str) -> bytes:
    if path not in files:
        raise _Broken(f"{path} is missing -- expected reference results in every FMU -- {AGAIN}")
    return files[path]


def _parsed(files: Mapping[str, bytes], path: str) -> Element:
    try:
        return ElementTree.fromstring(_content(files, path))
    except ElementTree.ParseError as failure:
        raise _Broken(f"{path} is not XML ({failure}) -- expected XML -- {AGAIN}") from failure
