import sys
from pathlib import Path

import pytest

sys.path.insert(0, str(Path(__file__).resolve().parent))


@pytest.fixture
def gate(tmp_path):
    from synthetic import Gate

    return Gate(tmp_path)
