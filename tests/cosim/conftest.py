"""FMUs that are not ours: small PythonFMU units, built once in a session."""

from pathlib import Path

import pytest
from pythonfmu.builder import FmuBuilder


@pytest.fixture(scope="session")
def foreign(tmp_path_factory) -> dict[str, Path]:
    folder = tmp_path_factory.mktemp("foreign")
    scripts = sorted((Path(__file__).parent / "foreign").glob("*.py"))
    return {script.stem: Path(FmuBuilder.build_FMU(script, dest=folder)) for script in scripts}
