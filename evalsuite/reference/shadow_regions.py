"""Where the shadows of an environment's area lights fall: the part of their light that reaches each pixel, by Mitsuba's rays."""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from evalsuite.lights import decompose
from evalsuite.lights.model import DecompositionSettings
from evalsuite.math.disc_samples import light_samples
from evalsuite.reference.gbuffer import material_table
from evalsuite.scene.load import LoadedScene

#: Rays of a pixel over all lights, and the fewest and most of one light. A light's visibility is then known to 1 in 16 … 256;
#: a region's border moves by that part of the penumbra's width.
RAYS, FEWEST, MOST = 512, 16, 256


def visible_light(loaded: LoadedScene, settings: DecompositionSettings) -> NDArray[np.float32] | None:
    """Σ V_k w_k / Σ w_k at each pixel's centre, (H, W) in [0, 1]; w_k = E_k (n·D_k)₊ with a light's irradiance E_k (luminance)
    and direction D_k, V_k the part of its disc that no surface hides. 0 where no light is before the surface, and where the
    pixel shows none. None for an environment without lights."""
    import drjit as dr
    import mitsuba as mi

    environment = loaded.scene.environment
    lights = decompose.of(environment, settings).lights if environment is not None else ()
    if not lights:
        return None
    width, height = loaded.scene.camera.size
    index = dr.arange(mi.UInt32, width * height)
    centre = mi.Point2f((mi.Float(index % width) + 0.5) / width, (mi.Float(index // width) + 0.5) / height)
    ray, _ = loaded.sensor.sample_ray(0.0, 0.5, centre, mi.Point2f(0.5))
    si = loaded.mitsuba.ray_intersect(ray)
    shape = dr.reinterpret_array(mi.UInt32, si.shape)
    dr.eval(si, shape)
    two_sided = np.array([m.two_sided for m in loaded.scene.materials] + [False])
    turned = two_sided[material_table(loaded)[np.array(shape)]] & (np.array(si.wi.z) < 0.0)
    normal = si.sh_frame.n * mi.Float(np.where(turned, -1.0, 1.0))
    count = int(np.clip(RAYS // len(lights), FEWEST, MOST))
    samples = [light_samples(x.direction, x.angular_radius, count, k) for k, x in enumerate(lights)]
    world = environment.to_world.T
    rays = mi.Float(np.ravel(np.concatenate(samples) @ world))
    towards = mi.Float(np.ravel([np.asarray(light.direction) @ world for light in lights]))
    energy = mi.Float(np.array([np.asarray(light.irradiance) @ decompose.LUMINANCE for light in lights]))

    def vector(values: mi.Float, row: mi.UInt32) -> mi.Vector3f:
        return mi.Vector3f(*(dr.gather(mi.Float, values, 3 * row + k) for k in range(3)))

    def add(k: mi.UInt32, arrived: mi.Float, sent: mi.Float) -> tuple:
        light = k // count
        weight = dr.gather(mi.Float, energy, light) * dr.maximum(dr.dot(normal, vector(towards, light)), 0.0)
        lit = si.is_valid() & (weight > 0.0)
        hidden = loaded.mitsuba.ray_test(si.spawn_ray(vector(rays, k)), lit)
        return k + 1, arrived + dr.select(lit & ~hidden, weight, 0.0), sent + dr.select(lit, weight, 0.0)

    last = dr.opaque(mi.UInt32, count * len(lights))
    _, arrived, sent = dr.while_loop((mi.UInt32(0), mi.Float(0.0), mi.Float(0.0)), lambda k, *_: k < last, add)
    part = dr.select(sent > 0.0, arrived / sent, 0.0)
    return np.array(part, np.float32).reshape(height, width)
