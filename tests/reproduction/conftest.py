"""One run of all papers for the tests that read its claims."""

import pytest

from tsm_fmu.reproduction import Reproduction, reproduce


@pytest.fixture(scope="session")
def done() -> Reproduction:
    """All five papers, without the co-simulated loops (system_tests run those)."""
    return reproduce(closed_loops=False)


@pytest.fixture(scope="session")
def claims(done):
    return {claim.key: claim for claim in done.claims}
