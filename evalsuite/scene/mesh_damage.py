"""What is wrong with a mesh file."""

from __future__ import annotations

#: Most triangles and vertices of a mesh.
MOST = 1 << 27


class Damaged(Exception):
    """In words: what its file says or lacks."""
