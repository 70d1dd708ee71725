"""Prefiltering by importance samples, each looked up in the MIP level as large as its share (Křivánek, Colbert 2008)."""

from __future__ import annotations

import moderngl
import numpy as np

from evalsuite.gpu import context, programs
from evalsuite.gpu.environment import Cube
from evalsuite.math.prefilter import SampleSet


class SampledLobe:
    """A sample set over a cubemap with hardware MIPs; a `maps.Filter`."""

    parts = ("sampled_lobe.comp",)
    defines = ()

    def __init__(self, source: Cube, samples: SampleSet) -> None:
        self._source, self._count = source, len(samples.weights)
        data = np.zeros((self._count, 8), np.float32)
        data[:, :3], data[:, 3], data[:, 4] = samples.directions, samples.levels(source.face_size), samples.weights
        self._buffer = context.get().buffer(data.tobytes())

    def bind(self, shader: moderngl.ComputeShader) -> int:
        """The samples and the cubemap."""
        self._buffer.bind_to_storage_buffer(0)
        programs.set_uniforms(shader, {"count": self._count})
        programs.bind_textures(shader, {"source": self._source.texture})
        return self._count

    def release(self) -> None:
        """Free the samples."""
        self._buffer.release()
