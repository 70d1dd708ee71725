"""Mesh files, looked through before Mitsuba's native readers get them: a count that the file does not hold, or a triangle of
vertices that there are not, ends those in a crash or takes all memory."""

from __future__ import annotations

import re
import struct
import zlib
from collections.abc import Iterator
from functools import lru_cache
from pathlib import Path
from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

#: Most triangles and vertices of a mesh.
MOST = 1 << 27
_TYPES = {
    "int8": "i1", "char": "i1", "uint8": "u1", "uchar": "u1", "int16": "i2", "short": "i2", "uint16": "u2", "ushort": "u2",
    "int32": "i4", "int": "i4", "uint32": "u4", "uint": "u4", "float32": "f4", "float": "f4", "float64": "f8", "double": "f8",
}  # fmt: skip
_ORDERS = {"ascii 1.0": "=", "binary_little_endian 1.0": "<", "binary_big_endian 1.0": ">"}
# Serialized meshes: flags of what the vertices have, and of double precision (mitsuba, serialized.cpp).
_NORMALS, _UVS, _COLOURS, _DOUBLE = 0x1, 0x2, 0x8, 0x2000


class _Damaged(Exception):
    """What is wrong with a file."""


class _Element(NamedTuple):
    name: str
    count: int
    row: np.dtype


def mesh_problem(path: Path, plugin: str, shape_index: int = 0) -> str | None:
    """What is wrong with a `ply` or `serialized` file that says it has more than it has, or whose triangles name other vertices
    than its own, in words; None for any other. Of other plugins' files nothing is read. shape_index: of the meshes in a
    serialized file."""
    if plugin not in ("ply", "serialized"):
        return None
    status = path.stat()
    return _problem(path, plugin, shape_index, (status.st_mtime_ns, status.st_size))


@lru_cache(maxsize=256)
def _problem(path: Path, plugin: str, shape_index: int, stamp: tuple[int, int]) -> str | None:
    del stamp  # part of the key: a changed file is read again
    try:
        data = path.read_bytes()
        counts = _ply(data) if plugin == "ply" else _serialized(data, shape_index)
    except _Damaged as error:
        return str(error)
    except OSError as error:
        return f"no readable file ({error.strerror})"
    vertices, indices = counts
    if indices.size and not (0 <= indices.min() and indices.max() < vertices):
        return f"a triangle of vertex {indices.max() if indices.max() >= vertices else indices.min()} of {vertices}"
    return None


def _ply(data: bytes) -> tuple[int, NDArray]:
    """(vertices, indices of the triangles)."""
    end = re.search(rb"\nend_header\r?\n", data[: 1 << 16])
    if not data.startswith(b"ply") or end is None:
        raise _Damaged("no PLY header")
    lines = data[: end.start()].decode("ascii", "replace").splitlines()
    order, elements = _header(lines)
    found, body, at = {}, data[end.end() :], 0
    words = body.split() if order == "=" else []
    for name, count, row in elements:
        size, left = (len(row), len(words)) if order == "=" else (row.itemsize, len(body))
        if count > MOST or count * size > left - at:
            raise _Damaged(f"a header that says {count} of '{name}', more than the file holds")
        if order == "=":
            found[name] = words[at : at + count * size], row
        else:
            found[name] = np.frombuffer(body, row.newbyteorder(order), count, at), row
        at += count * size
    if not {"vertex", "face"} <= set(found):
        raise _Damaged("no vertices, or no faces")
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
            raise _Damaged(f"the header line '{line[:60]}'")
    names = [name for name, *_ in elements]
    if order is None or len(set(names)) < len(names) or any(len(dict(f)) < len(f) or not f for *_, f in elements):
        raise _Damaged("a header without a format, or that says something twice")
    return order, [_Element(name, count, np.dtype(f)) for name, count, f in elements]


def _corners(rows: NDArray | list[bytes], row: np.dtype) -> NDArray:
    if "corner 0" not in (row.names or ()):
        raise _Damaged("faces without vertex indices")
    if isinstance(rows, list):
        try:
            table = np.array(rows, dtype=np.float64).reshape(-1, len(row))
        except ValueError:
            raise _Damaged("a word that is no number") from None
        columns = {name: table[:, k] for k, name in enumerate(row.names)}
    else:
        columns = {name: rows[name] for name in row.names}
    if not (columns["count"] == 3).all():
        raise _Damaged("faces of more or fewer than three corners")
    corners = np.stack([columns[f"corner {k}"] for k in range(3)]).astype(np.float64)
    if not np.isfinite(corners).all():
        raise _Damaged("a vertex index that is no number")
    return corners.astype(np.int64)


def _serialized(data: bytes, shape_index: int) -> tuple[int, NDArray]:
    """(vertices, indices of the triangles) of one of the meshes: header, zlib stream; their offsets stand at the end."""
    if len(data) < 16:
        raise _Damaged("a truncated file")
    count = struct.unpack_from("<I", data, len(data) - 4)[0]
    start, version = _offset(data, count, shape_index)
    stream = _inflated(data[start + 4 :])
    take = _taken(stream)
    flags = struct.unpack("<I", take(4))[0]
    while version == 4 and take(1) != b"\0":
        pass  # the name
    vertices, triangles = struct.unpack("<QQ", take(16))
    if not (0 < vertices <= MOST and 0 < triangles <= MOST):
        raise _Damaged(f"a header that says {vertices} vertices and {triangles} triangles")
    real = 8 if flags & _DOUBLE else 4
    per_vertex = 3 + 3 * bool(flags & _NORMALS) + 2 * bool(flags & _UVS) + 3 * bool(flags & _COLOURS)
    for _ in range(per_vertex):
        take(vertices * real)
    return vertices, np.frombuffer(take(12 * triangles), "<u4").astype(np.int64)


def _offset(data: bytes, count: int, shape_index: int) -> tuple[int, int]:
    if not 0 <= shape_index < count:
        raise _Damaged(f"{count} meshes, of which number {shape_index} is asked for")
    for version, size in ((4, 8), (3, 4)):
        table = len(data) - 4 - size * count
        if table < 0 or data[:4] != struct.pack("<HH", 0x041C, version):
            continue
        start = int.from_bytes(data[table + size * shape_index :][:size], "little")
        if start + 4 <= table and data[start : start + 4] == struct.pack("<HH", 0x041C, version):
            return start, version
    raise _Damaged("no header of version 3 or 4")


def _inflated(data: bytes) -> Iterator[bytes]:
    """The zlib stream in pieces: it may grow a thousandfold."""
    stream, rest = zlib.decompressobj(), data
    try:
        while not stream.eof and rest:
            yield stream.decompress(rest, 1 << 20)
            rest = stream.unconsumed_tail
    except zlib.error as error:
        raise _Damaged(f"a stream that does not inflate ({error})") from None


def _taken(pieces: Iterator[bytes]):
    buffer = bytearray()

    def take(size: int) -> bytes:
        while len(buffer) < size:
            piece = next(pieces, None)
            if piece is None:
                raise _Damaged("a truncated file")
            buffer.extend(piece)
        taken = bytes(buffer[:size])
        del buffer[:size]
        return taken

    return take
