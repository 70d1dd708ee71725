"""What `evalsuite env` does, without its printing."""

from __future__ import annotations

from pathlib import Path

import numpy as np

from evalsuite.errors import EvalsuiteError, unknown
from evalsuite.execute.local import Lane
from evalsuite.image import exr
from evalsuite.scene import builtin


def environment_facts(name: str) -> dict:
    """Facts of a lat-long map: size, range, mean radiance over the sphere, NaN count, where its power comes from."""
    lane = Lane("reference")
    try:
        return lane.call("evalsuite.commands_environments:_environment_facts", builtin.environment_path(name))
    finally:
        lane.close()


def _environment_facts(path: Path) -> dict:
    from evalsuite.image.color import luminance
    from evalsuite.math.sphere import latlong_solid_angles, latlong_to_direction
    from evalsuite.scene.environment import read_environment

    environment = read_environment(path, repair=True)
    radiance = environment.radiance.astype(np.float64)
    height, width = radiance.shape[:2]
    omega = np.broadcast_to(latlong_solid_angles(height, width), (height, width))
    light = luminance(radiance)
    power = light * omega
    order = np.argsort(-light, axis=None)
    shares = np.cumsum(power.ravel()[order]) / max(power.sum(), 1e-300)
    brightest = np.unravel_index(int(order[0]), light.shape)
    direction = latlong_to_direction((brightest[1] + 0.5) / width, brightest[0] / max(height - 1, 1))
    half = int(np.searchsorted(shares, 0.5))
    mean = power.sum() / omega.sum()
    return {
        "file": str(path),
        "width": width,
        "height": height,
        "minimum": float(radiance.min()),
        "maximum": float(radiance.max()),
        "mean_radiance": [float(c) for c in (radiance * omega[..., None]).sum((0, 1)) / omega.sum()],
        "maximum_over_mean": float(light.max() / mean) if mean > 0 else None,
        "nan_or_inf": int((~np.isfinite(exr.read(path))).sum()),
        "brightest_direction": [round(float(c), 4) for c in np.ravel(direction)],
        "solid_angle_of_half_the_power_sr": float(omega.ravel()[order[: half + 1]].sum()),
        "notes": [*environment.notes, *environment.remarks],
    }


def convert_environment(
    name: str, output: Path, to: str, origin: str | None, size: int | None, view: tuple[float, float, float], repair: bool
) -> dict:
    """Write a map in another representation; facts of both: sizes, mean radiance, what the conversion did to the energy."""
    from evalsuite.image import environment_maps as maps
    from evalsuite.scene.environment import clean_environment

    for option, value in (("--to", to), ("--from", origin)):
        if value is not None and value not in maps.REPRESENTATIONS:
            raise unknown(option, value, maps.REPRESENTATIONS, "`evalsuite env convert --help`")
    largest = {"latlong": 16384, "cube": 4096, "paraboloid": 8192, "sphere": 8192}[to]
    if size is not None and (not maps.SMALLEST[to] <= size <= largest or size % 2):
        raise EvalsuiteError("--size", f"{size}", f"an even number from {maps.SMALLEST[to]} to {largest} for --to {to}")
    path = builtin.environment_path(name)
    header = exr.read_header(path) if path.suffix.lower() == ".exr" else {}
    cleaned = clean_environment(exr.read(path), str(path), repair)
    height, width = cleaned.radiance.shape[:2]
    kind = origin or maps.recognise(cleaned.radiance, header)
    if kind is None:
        raise EvalsuiteError(
            path, f"{width} × {height} texels", "a 2:1 lat-long map or a 6:1 strip of cube faces", "say what it is with --from"
        )
    source = maps.REPRESENTATIONS[kind].from_picture(cleaned.radiance, header)
    made = maps.convert(source, to, size, view)
    picture, attributes = made.picture()
    exr.write(output, picture, attributes)
    before, after = source.integral(), made.integral()
    residual = np.divide(after, before, out=np.ones(3), where=before > 0) - 1.0
    return {
        "file": str(path),
        "from": kind,
        "from_width": width,
        "from_height": height,
        "output": str(output),
        "to": to,
        "width": picture.shape[1],
        "height": picture.shape[0],
        "header": attributes,
        "mean_radiance_before": [float(x) for x in before / (4.0 * np.pi)],
        "mean_radiance_after": [float(x) for x in after / (4.0 * np.pi)],
        "energy_residual": [float(x) for x in residual],
        "notes": [*cleaned.notes, *cleaned.remarks],
    }


def make_environment(name: str, output: Path) -> None:
    """Run the generator of a built-in environment."""
    builtin.make_environment(name, output)
