"""Structured importance sampling of an environment map (Agarwal, Ramamoorthi, Belongie and Jensen 2003): n directional lights.

Thresholds cut the map into layers, layers fall into connected regions, and each region gets samples by its light and, weakly, by
its solid angle, over which visibility changes. Farthest points spread them; each stands for the texels nearest to it.

Where the paper leaves a choice: σ is weighted by solid angle; layers are disjoint; a region worth less than half a sample joins
the nearest larger one; each region's first sample is its brightest texel; a stratum's direction is the centroid of its light, so
that without occlusion its irradiance is right to second order in its size.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from numpy.typing import ArrayLike, NDArray
from scipy import ndimage, sparse
from scipy.spatial import cKDTree

from evalsuite.errors import EvalsuiteError
from evalsuite.lights.decompose import LUMINANCE
from evalsuite.math.sphere import latlong_directions, latlong_solid_angles

Float = NDArray[np.float64]
#: Thresholds t_i = iσ, i = 0 … LAYERS − 1. Layers and weight Γ = L^A min(ΔΩ, LARGEST)^B: Agarwal et al. 2003, sections 3 and 4.
LAYERS = 6
A, B, LARGEST = 1.0, 0.25, 0.01  # LARGEST: [sr]
LEAST_SHARE = 0.5  # of a sample, below which a region joins another


@dataclass(frozen=True, eq=False)
class DirectionalLights:
    """directions: (N, 3) unit, the map's local frame. irradiances: (N, 3) RGB ∫ L dω of each stratum [W m⁻²]; they sum to the
    map's. solid_angles: (N,) of the strata [sr]."""

    directions: Float
    irradiances: Float
    solid_angles: Float


def structured(radiance: ArrayLike, count: int) -> DirectionalLights:
    """At most `count` directional lights of a lat-long map (H, W, 3) of radiance, negative texels as black; none for a black
    map. Raises EvalsuiteError for a count below 1."""
    if count < 1:
        raise EvalsuiteError("structured importance sampling", f"{count} samples", "at least 1", "raise samples")
    radiance = np.maximum(np.asarray(radiance, np.float64), 0.0)
    height, width = radiance.shape[:2]
    luminance, omega = radiance @ LUMINANCE, latlong_solid_angles(height, width)
    lit = luminance > 0.0
    if not lit.any():
        return DirectionalLights(np.zeros((0, 3)), np.zeros((0, 3)), np.zeros(0))
    layers = np.where(lit, _layers(luminance, omega), -1)
    energy, directions = radiance[lit] * omega[lit][:, None], latlong_directions(height, width)[lit]
    light, omega = energy @ LUMINANCE, omega[lit]
    region = _merged(regions(layers)[lit], light, omega, directions, count)
    samples = apportion(_weights(region, light, omega), count, np.bincount(region))
    centres, stratum = np.zeros((0, 3)), np.zeros(len(light), np.int64)
    for index in range(len(samples)):
        texels = np.flatnonzero(region == index)
        chosen, nearest = farthest_points(directions[texels], int(samples[index]), int(np.argmax(light[texels])))
        stratum[texels] = len(centres) + nearest
        centres = np.concatenate([centres, directions[texels[chosen]]])
    return _strata(centres, stratum, energy, light, omega, directions)


def _strata(
    centres: Float, stratum: NDArray[np.int64], energy: Float, light: Float, omega: Float, directions: Float
) -> DirectionalLights:
    """Sums over each stratum."""
    n = len(centres)
    irradiance, centroid = (
        np.stack([np.bincount(stratum, values, n) for values in columns.T], -1)
        for columns in (energy, light[:, None] * directions)
    )
    length = np.linalg.norm(centroid, axis=1)
    # A stratum of half the sphere or more may have no middle.
    middle = length > 1e-3 * np.bincount(stratum, light, n)
    unit = np.where(middle[:, None], centroid / np.where(middle, length, 1.0)[:, None], centres)
    # Several texels of a pole's row have one direction: only the first of them stands for light.
    some = irradiance.any(axis=1)
    return DirectionalLights(unit[some], irradiance[some], np.bincount(stratum, omega, n)[some])


def _layers(luminance: Float, omega: Float) -> NDArray[np.int64]:
    """(H, W) number of the highest threshold iσ that a texel reaches."""
    mean = (luminance * omega).sum() / omega.sum()
    sigma = np.sqrt(((luminance - mean) ** 2 * omega).sum() / omega.sum())
    if sigma <= 1e-9 * mean:
        return np.zeros(luminance.shape, np.int64)
    return np.minimum(luminance / sigma, LAYERS - 1).astype(np.int64)


def regions(layers: NDArray[np.int64]) -> NDArray[np.int64]:
    """(H, W) numbers from 0 of the connected parts of equal layer: eight neighbours, across the seam, and around each pole,
    whose row is one point of the sphere."""
    label, count = np.zeros(layers.shape, np.int64), 0
    for layer in np.unique(layers):
        part, found = ndimage.label(layers == layer, np.ones((3, 3)))
        label = np.where(part > 0, part + count - 1, label)
        count += found
    height = len(layers)
    pairs = [(label[:, -1], label[:, 0], layers[:, -1] == layers[:, 0])]
    for step in (-1, 1) if height > 1 else ():
        a, b = (slice(0, -1), slice(1, None)) if step > 0 else (slice(1, None), slice(0, -1))
        pairs.append((label[a, -1], label[b, 0], layers[a, -1] == layers[b, 0]))
    for row in (0, -1) if height > 1 else ():
        for layer in np.unique(layers[row]):
            same = label[row][layers[row] == layer]
            pairs.append((same[1:], same[:-1], np.ones(len(same) - 1, bool)))
    first, second = (np.concatenate([pair[k][pair[2]] for pair in pairs]) for k in (0, 1))
    graph = sparse.coo_matrix((np.ones(len(first)), (first, second)), shape=(count, count))
    return sparse.csgraph.connected_components(graph, directed=False)[1][label]


def _weights(region: NDArray[np.int64], light: Float, omega: Float) -> Float:
    """Γ = L^a min(ΔΩ, Δω₀)^b of each region."""
    return np.bincount(region, light) ** A * np.minimum(np.bincount(region, omega), LARGEST) ** B


def _merged(region: NDArray[np.int64], light: Float, omega: Float, directions: Float, count: int) -> NDArray[np.int64]:
    """Regions numbered anew, with those worth less than LEAST_SHARE of `count` samples given to the nearest of the others."""
    weight = _weights(region, light, omega)
    keep = weight * count >= LEAST_SHARE * weight.sum()
    keep[np.argmax(weight)] = True
    kept = keep[region]
    if keep.sum() == 1:
        return np.zeros_like(region)
    if not kept.all():
        nearest = cKDTree(directions[kept]).query(directions[~kept])[1]
        region = region.copy()
        region[~kept] = region[kept][nearest]
    return np.unique(region, return_inverse=True)[1].reshape(-1)


def apportion(weight: ArrayLike, count: int, most: ArrayLike) -> NDArray[np.int64]:
    """Whole numbers in proportion to `weight`, at least 1 and at most `most` each, that sum to `count` where that can be: what
    rounding leaves goes where the deficit is largest. The weights must not outnumber `count`."""
    weight, most = np.asarray(weight, np.float64), np.asarray(most, np.int64)
    quota = count * weight / weight.sum()
    out = np.clip(np.floor(quota).astype(np.int64), 1, most)
    for _ in range(abs(count - int(out.sum()))):
        short = int(out.sum()) < count
        free = out < most if short else out > 1
        if not free.any() or int(out.sum()) == count:
            break
        deficit = np.where(free, quota - out, -np.inf if short else np.inf)
        out[np.argmax(deficit) if short else np.argmin(deficit)] += 1 if short else -1
    return out


def farthest_points(points: Float, count: int, first: int) -> tuple[NDArray[np.int64], NDArray[np.int64]]:
    """(indices of the chosen, (count,); for each point which of them is nearest): unit vectors (N, 3) by falling y, as a map's
    texels are, each chosen as the one farthest from those before (Gonzalez 1985, Hochbaum and Shmoys 1985)."""
    chosen, nearest = np.full(count, first), np.zeros(len(points), np.int64)
    cosine = points @ points[first]
    polar = np.arccos(np.clip(points[:, 1], -1.0, 1.0))
    for k in range(1, count):
        chosen[k] = np.argmin(cosine)
        # No point is farther from its centre than the new one: what becomes the new one's lies within that angle of it.
        reach = np.arccos(np.clip(cosine[chosen[k]], -1.0, 1.0)) + 1e-6
        low, high = np.searchsorted(polar, polar[chosen[k]] + np.array([-reach, reach]))
        new = points[low:high] @ points[chosen[k]]
        closer = low + np.flatnonzero(new > cosine[low:high])
        nearest[closer], cosine[closer] = k, new[closer - low]
    return chosen, nearest
