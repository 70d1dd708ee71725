"""Writes the four modelled rooms of `scenes/rooms/` anew: `python scenes/generate_rooms.py [-o DIRECTORY]`.

The camera of each stands where the environment map of the same name is taken. NumPy and OpenEXR only, deterministic. All
surfaces are diffuse or nearly so: sharp reflections of small lamps would not converge.
"""

from __future__ import annotations

import argparse
import sys
from pathlib import Path

HERE = Path(__file__).resolve().parent
sys.path.insert(0, str(HERE / "rooms"))

import basilica  # noqa: E402
import cathedral  # noqa: E402
import chapel  # noqa: E402
import office  # noqa: E402


def main() -> None:
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0])
    parser.add_argument("-o", "--output", type=Path, default=HERE / "rooms", help="directory")
    directory = parser.parse_args().output
    for folder in ("textures", "meshes"):
        (directory / folder).mkdir(parents=True, exist_ok=True)
    for room in (office, cathedral, chapel, basilica):
        room.build(directory)


if __name__ == "__main__":
    main()
