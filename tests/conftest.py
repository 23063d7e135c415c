"""What every test may rely on: settled threads, a patient Hypothesis, and `--bless`."""

from __future__ import annotations

import os

import pytest
from hypothesis import settings

# llvmpipe reads this once, when a process makes its first context. It changes no bytes, only how many cores draw.
os.environ.setdefault("LP_NUM_THREADS", str(len(os.sched_getaffinity(0))))

# A first frame compiles shaders and bakes textures: no time limit on an example can be right.
settings.register_profile("house", deadline=None, print_blob=True)
settings.load_profile("house")


def pytest_addoption(parser: pytest.Parser) -> None:
    """Add the option of `make bless`."""
    parser.addoption("--bless", action="store_true", help="write golden pictures instead of comparing with them")


@pytest.fixture(scope="session")
def is_blessing(request: pytest.FixtureRequest) -> bool:
    """Golden pictures are to be written, not compared."""
    return bool(request.config.getoption("--bless"))
