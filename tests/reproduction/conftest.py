"""One quick run of all papers for the tests that read its claims; native units give the numbers of the Python ones."""

import pytest

from tsm_fmu.reproduction import Reproduction, reproduce


@pytest.fixture(scope="session")
def done() -> Reproduction:
    """All five papers, with few values of what is open."""
    return reproduce(quick=True, flavour="native")


@pytest.fixture(scope="session")
def claims(done):
    return {claim.key: claim for claim in done.claims}


@pytest.fixture(scope="session")
def ours(claims):
    """``ours(key)``: computed span or numbers of a claim."""
    return lambda key: claims[key].numbers["ours"]


@pytest.fixture(scope="session")
def reading(claims):
    """``reading(key, name)``: computed value of one reading of a statement."""
    return lambda key, name: claims[key].numbers["readings"][name]["value"]
