"""The object mask holds no pixel that a silhouette touches."""

import numpy as np

from evalsuite.compare.mask import whole_pixels


def test_pixels_beside_an_edge_do_not_count():
    coverage = np.zeros((9, 9))
    coverage[2:, 2:] = 1.0
    coverage[2, 2] = 0.9375  # one of sixteen sub-samples misses
    mask = whole_pixels(coverage)
    assert mask[4:, 4:].all() and mask.sum() == 36 - 1  # the picture's border is no silhouette
    assert not mask[3, 3] and not mask[:3].any() and not mask[:, :3].any()


def test_a_thin_object_keeps_its_whole_pixels():
    coverage = np.zeros((9, 9))
    coverage[4] = 1.0
    assert np.array_equal(whole_pixels(coverage), coverage == 1)
    assert not whole_pixels(np.zeros((3, 3))).any()
