"""Mitsuba's serialized meshes, looked through: whether the file holds what its header says, and which vertices its triangles
name."""

from __future__ import annotations

import struct
import zlib
from collections.abc import Callable, Iterator

import numpy as np
from numpy.typing import NDArray

from evalsuite.scene.mesh_damage import MOST, Damaged

# Flags of what the vertices have, and of double precision (mitsuba, serialized.cpp).
_NORMALS, _UVS, _COLOURS, _DOUBLE = 0x1, 0x2, 0x8, 0x2000


def triangles(data: bytes, shape_index: int) -> tuple[int, NDArray[np.int64]]:
    """(number of vertices, indices of the triangles' corners) of one of the meshes: header, zlib stream; their offsets stand at
    the end. Raises Damaged."""
    if len(data) < 16:
        raise Damaged("a truncated file")
    count = struct.unpack_from("<I", data, len(data) - 4)[0]
    start, version = _offset(data, count, shape_index)
    stream = _inflated(data[start + 4 :])
    take = _taken(stream)
    flags = struct.unpack("<I", take(4))[0]
    if version == 4:
        _name(take)
    vertices, faces = struct.unpack("<QQ", take(16))
    if not (0 < vertices <= MOST and 0 < faces <= MOST):
        raise Damaged(f"a header that says {vertices} vertices and {faces} triangles")
    real = 8 if flags & _DOUBLE else 4
    per_vertex = 3 + 3 * bool(flags & _NORMALS) + 2 * bool(flags & _UVS) + 3 * bool(flags & _COLOURS)
    for _ in range(per_vertex):
        take(vertices * real)
    return vertices, np.frombuffer(take(12 * faces), "<u4").astype(np.int64)


def _offset(data: bytes, count: int, shape_index: int) -> tuple[int, int]:
    if not 0 <= shape_index < count:
        raise Damaged(f"{count} meshes, of which number {shape_index} is asked for")
    for version, size in ((4, 8), (3, 4)):
        table = len(data) - 4 - size * count
        if table < 0 or data[:4] != struct.pack("<HH", 0x041C, version):
            continue
        start = int.from_bytes(data[table + size * shape_index :][:size], "little")
        if start + 4 <= table and data[start : start + 4] == struct.pack("<HH", 0x041C, version):
            return start, version
    raise Damaged("no header of version 3 or 4")


def _inflated(data: bytes) -> Iterator[bytes]:
    """The zlib stream in pieces: it may grow a thousandfold."""
    stream, rest = zlib.decompressobj(), data
    try:
        while not stream.eof and rest:
            yield stream.decompress(rest, 1 << 20)
            rest = stream.unconsumed_tail
    except zlib.error as error:
        raise Damaged(f"a stream that does not inflate ({error})") from None


def _name(take: Callable[[int], bytes]) -> bytes:
    """Up to its closing null."""
    return b"".join(iter(lambda: take(1), b"\0"))


def _taken(pieces: Iterator[bytes]) -> Callable[[int], bytes]:
    """The next so many bytes of the pieces."""
    buffer = bytearray()

    def take(size: int) -> bytes:
        while len(buffer) < size:
            piece = next(pieces, None)
            if piece is None:
                raise Damaged("a truncated file")
            buffer.extend(piece)
        taken = bytes(buffer[:size])
        del buffer[:size]
        return taken

    return take
