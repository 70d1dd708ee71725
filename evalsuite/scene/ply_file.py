"""PLY meshes, looked through: whether the file holds what its header says, and which vertices its triangles name."""

from __future__ import annotations

import re
from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from evalsuite.scene.mesh_damage import MOST, Damaged

_TYPES = {
    "int8": "i1", "char": "i1", "uint8": "u1", "uchar": "u1", "int16": "i2", "short": "i2", "uint16": "u2", "ushort": "u2",
    "int32": "i4", "int": "i4", "uint32": "u4", "uint": "u4", "float32": "f4", "float": "f4", "float64": "f8", "double": "f8",
}  # fmt: skip
_ORDERS = {"ascii 1.0": "=", "binary_little_endian 1.0": "<", "binary_big_endian 1.0": ">"}


class _Element(NamedTuple):
    name: str
    count: int
    row: np.dtype


def triangles(data: bytes) -> tuple[int, NDArray[np.int64]]:
    """(number of vertices, indices of the triangles' corners). Raises Damaged."""
    end = re.search(rb"\nend_header\r?\n", data[: 1 << 16])
    if not data.startswith(b"ply") or end is None:
        raise Damaged("no PLY header")
    lines = data[: end.start()].decode("ascii", "replace").splitlines()
    order, elements = _header(lines)
    found, body, at = {}, data[end.end() :], 0
    words = body.split() if order == "=" else []
    for name, count, row in elements:
        size, left = (len(row), len(words)) if order == "=" else (row.itemsize, len(body))
        if count > MOST or count * size > left - at:
            raise Damaged(f"a header that says {count} of '{name}', more than the file holds")
        if order == "=":
            found[name] = words[at : at + count * size], row
        else:
            found[name] = np.frombuffer(body, row.newbyteorder(order), count, at), row
        at += count * size
    if not {"vertex", "face"} <= set(found):
        raise Damaged("no vertices, or no faces")
    vertices = next(count for name, count, _ in elements if name == "vertex")
    return vertices, _corners(*found["face"])


def _header(lines: list[str]) -> tuple[str, list[_Element]]:
    """Byte order and elements; a list is a count and three indices, as only triangles are read."""
    order, elements, fields = None, [], []
    for line in lines[1:]:
        words = line.split()
        if not words or words[0] in ("comment", "obj_info"):
            continue
        if words[0] == "format" and (order := _ORDERS.get(" ".join(words[1:]))):
            continue
        if words[0] == "element" and len(words) == 3 and re.fullmatch(r"\d{1,18}", words[2]):
            fields = []
            elements.append((words[1], int(words[2]), fields))
        elif words[0] == "property" and elements and len(words) == 3 and words[1] in _TYPES:
            fields.append((words[2], _TYPES[words[1]]))
        elif words[:2] == ["property", "list"] and elements and len(words) == 5 and {words[2], words[3]} <= set(_TYPES):
            fields += [("count", _TYPES[words[2]]), *((f"corner {k}", _TYPES[words[3]]) for k in range(3))]
        else:
            raise Damaged(f"the header line '{line[:60]}'")
    names = [name for name, *_ in elements]
    if order is None or len(set(names)) < len(names) or any(len(dict(f)) < len(f) or not f for *_, f in elements):
        raise Damaged("a header without a format, or that says something twice")
    return order, [_Element(name, count, np.dtype(f)) for name, count, f in elements]


def _corners(rows: NDArray | list[bytes], row: np.dtype) -> NDArray:
    if "corner 0" not in (row.names or ()):
        raise Damaged("faces without vertex indices")
    if isinstance(rows, list):
        try:
            table = np.array(rows, dtype=np.float64).reshape(-1, len(row))
        except ValueError:
            raise Damaged("a word that is no number") from None
        columns = {name: table[:, k] for k, name in enumerate(row.names)}
    else:
        columns = {name: rows[name] for name in row.names}
    if not (columns["count"] == 3).all():
        raise Damaged("faces of more or fewer than three corners")
    corners = np.stack([columns[f"corner {k}"] for k in range(3)]).astype(np.float64)
    if not np.isfinite(corners).all():
        raise Damaged("a vertex index that is no number")
    return corners.astype(np.int64)
