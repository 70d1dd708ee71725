"""`band-ℓ`: made when first asked for, kept in the cache, refused in words."""

from __future__ import annotations

import numpy as np
import pytest

from evalsuite.errors import EvalsuiteError
from evalsuite.math.band_noise import LARGEST_DEGREE, band_noise
from evalsuite.scene import builtin
from evalsuite.scene.environment import read_environment


@pytest.fixture(autouse=True)
def own_cache(tmp_path, monkeypatch):
    monkeypatch.setenv("EVALSUITE_CACHE", str(tmp_path / "cache"))
    return tmp_path / "cache"


def test_made_once_in_the_cache(own_cache):
    path = builtin.environment_path("band-3")
    assert path.is_relative_to(own_cache) and path.name == "band-3.exr"
    environment = read_environment(path)
    np.testing.assert_allclose(environment.radiance, np.repeat(band_noise(3)[..., None], 3, 2), rtol=1e-6)
    assert not environment.notes
    before = path.stat().st_mtime_ns
    assert builtin.environment_path("band-3") == path and path.stat().st_mtime_ns == before
    assert {p.name for p in path.parent.iterdir()} == {"band-3.exr", "band-3.sha256"}, "nothing half made is left"


def test_made_to_a_file(tmp_path):
    builtin.make_environment("band-2", tmp_path / "mine.exr")
    assert read_environment(tmp_path / "mine.exr").radiance.shape == (64, 128, 3)


@pytest.mark.parametrize("name", ["band-0", "band-65", "band-007", "band-x", "band-", "band--3"])
def test_no_such_degree(name, own_cache):
    with pytest.raises(EvalsuiteError, match="a degree from 1 to 64") as error:
        builtin.environment_path(name)
    assert "\n" not in str(error.value) and not own_cache.exists()


def test_degree_of_a_name():
    assert builtin.band_degree("band-16") == 16
    assert builtin.band_degree("office") is builtin.band_degree("band-16.exr") is builtin.band_degree("bands") is None
    assert builtin.LARGEST_BAND == LARGEST_DEGREE
