"""001 Fig 11: sphere maps of three views, warped to another view, weighted and summed (Cabral, Olano, Nemec 1999), in float64.

A rough conductor (GGX, α = ALPHA, nothing absorbed) in the built-in office. The three views are corners of an icosahedron; the
view wanted lies between them. Truth is the sphere map made for that view.
"""

from __future__ import annotations

from typing import Any

import numpy as np
from numpy.typing import NDArray

from evalsuite.image.color import tone_map
from evalsuite.math import cube_tree, phong, view_maps
from evalsuite.math.sphere_map import frame
from evalsuite.report.figures import grids
from evalsuite.report.figures.map_pictures import panel
from evalsuite.report.figures.rendered import ERROR
from evalsuite.report.figures.sphere_view import cube

Float = NDArray[np.float64]

MAP, FACE, SIZE, VIEWS, ALPHA = "office", 64, 96, 12, 0.3
#: Shares of the three views in the one wanted.
SHARES = (0.5, 0.3, 0.2)
_MATERIAL = ("ggx", ALPHA, (0.0, 0.0, 0.0), (1.0, 1.0, 1.0))


def data() -> dict[str, Any]:
    """Maps of the sources, warped, weighted; their sum beside the exact map; RMS of both the best single warp and the sum."""
    tree = cube_tree.build(cube(MAP, FACE).levels[0])
    fixed, faces = view_maps.views(VIEWS)
    chosen = faces[0]
    view = np.array(SHARES) @ fixed[chosen]
    view /= np.linalg.norm(view)
    normals = view_maps.texel_normals(SIZE).reshape(-1, 3)

    def exact(v: Float) -> Float:
        return view_maps.radiance(tree, v, normals @ frame(v).T, _MATERIAL).reshape(SIZE, SIZE, 3)

    sources, truth = [exact(fixed[i]) for i in chosen], exact(view)
    v = np.broadcast_to(view, (len(normals), 3))
    reflected = phong.reflect(v, normals @ frame(view).T)
    warped = [view_maps.lookup(t, fixed[i], reflected).reshape(truth.shape) for t, i in zip(sources, chosen, strict=True)]
    shares = view_maps.blend(VIEWS, v, reflected)[:, chosen].T.reshape(3, SIZE, SIZE, 1)
    weighted = [share * one for share, one in zip(shares, warped, strict=True)]
    total = np.sum(weighted, axis=0)

    c = (np.arange(SIZE) + 0.5 - 0.5 * SIZE) / (0.5 * SIZE - 1.0)
    inside = np.hypot(c[None, :], c[:, None]) <= 1
    mean = truth[inside].mean()

    def rms(found: Float) -> float:
        return float(np.sqrt(np.mean((found[inside] - truth[inside]) ** 2)) / mean)

    exposure = 0.5 / np.median(truth[inside])

    def shown(radiance: Float, caption: str = "") -> grids.Panel:
        return panel(np.where(inside[..., None], tone_map(radiance, exposure), 1.0)[::-1], caption)

    relative = ((total - truth) / np.maximum(truth, 0.01 * mean)).mean(-1)
    angles = [float(np.degrees(np.arccos(np.clip(fixed[i] @ view, -1, 1)))) for i in chosen]
    each = [rms(one) for one in warped]
    return {
        "rows": [
            [shown(one, f"a view {angle:.0f}° off") for one, angle in zip(sources, angles, strict=True)],
            [shown(one, f"RMS {100 * off:.3g} %") for one, off in zip(warped, each, strict=True)],
            [shown(one, f"× {share[inside].mean():.2f}") for one, share in zip(weighted, shares, strict=True)],
            [shown(total, "sum"), shown(truth, "exact for the view wanted"),
             panel(np.where(inside[..., None], ERROR.colours(relative), 1.0)[::-1], f"RMS {100 * rms(total):.3g} %")],
        ],
        "measured": {"environment": MAP, "alpha": ALPHA, "degrees_off": angles, "warped_relative_rms": each,
                     "relative_rms": rms(total)},
    }  # fmt: skip


def draw(data: dict[str, Any]) -> grids.Grid:
    names = ("source maps", "warped", "weighted", "result")
    note = f"GGX, α = {ALPHA:g}, in {MAP} (a stand-in for the paper's map). RMS over the disc, relative to the mean; no noise."
    return grids.Grid([grids.Block(data["rows"], "", (), names)], scale=ERROR, width=5.5, note=note)
