"""Reading and writing pictures: exact round trips, and one clear error for anything damaged."""

from __future__ import annotations

import struct
import zlib

import imageio.v3 as iio
import numpy as np
import pytest

from evalsuite.errors import EvalsuiteError
from evalsuite.image import exr, ldr
from evalsuite.image.color import LUMINANCE, linear_to_srgb, luminance, srgb_to_linear


@pytest.fixture
def image():
    return np.random.default_rng(1).normal(size=(23, 37, 3)).astype(np.float32)


def rgbe_bytes(rgbe, flat=False):
    """An encoder of its own for the tests: literal runs and repeats, by component."""
    height, width = rgbe.shape[:2]
    data = b"#?RADIANCE\nFORMAT=32-bit_rle_rgbe\n\n" + f"-Y {height} +X {width}\n".encode()
    if flat:
        return data + rgbe.tobytes()
    for row in rgbe:
        data += bytes((2, 2, width >> 8, width & 255))
        for component in row.T:
            start = 0
            while start < width:
                end = start + 1
                while end < width and component[end] == component[start] and end - start < 127:
                    end += 1
                run = end - start
                data += bytes((128 + run, component[start])) if run > 2 else bytes((run,)) + component[start:end].tobytes()
                start = end
    return data


@pytest.fixture
def rgbe():
    rgbe = np.random.default_rng(2).integers(0, 256, (9, 300, 4), dtype=np.uint8)
    rgbe[..., 3] = 120 + rgbe[..., 3] // 16
    rgbe[3] = rgbe[3, :1]
    rgbe[4, 10:20] = 0
    return rgbe


class TestExr:
    def test_round_trip_is_exact(self, tmp_path, image):
        image[0, 0] = np.nan, np.inf, -1e-30
        exr.write(tmp_path / "sub" / "a.exr", image, {"scene": "torus", "spp": 64, "seconds": np.float32(1.5), "big": 2**40})
        np.testing.assert_array_equal(exr.read(tmp_path / "sub" / "a.exr"), image)
        header = exr.read_header(tmp_path / "sub" / "a.exr")
        assert (header["scene"], header["spp"], header["seconds"], header["big"]) == ("torus", 64, 1.5, str(2**40))
        assert [p.name for p in (tmp_path / "sub").iterdir()] == ["a.exr"], "no temporary file is left"

    @pytest.mark.parametrize("view", [np.s_[::-1], np.s_[:, ::-1], np.s_[..., ::-1], np.s_[2:9, 3:30], np.s_[::2, ::3]])
    def test_non_contiguous_views(self, tmp_path, image, view):
        exr.write(tmp_path / "a.exr", image[view])
        np.testing.assert_array_equal(exr.read(tmp_path / "a.exr"), image[view])

    def test_parts_and_single_channels(self, tmp_path, image):
        exr.write(tmp_path / "a.exr", {"image": image, "standard_error": abs(image), "mask": image[..., 1] > 0})
        parts = exr.read_parts(tmp_path / "a.exr")
        assert list(parts) == ["image", "standard_error", "mask"]
        np.testing.assert_array_equal(parts["mask"], image[..., 1] > 0)
        np.testing.assert_array_equal(exr.read(tmp_path / "a.exr"), image)
        np.testing.assert_array_equal(exr.read(tmp_path / "a.exr", "standard_error"), abs(image))
        assert exr.read(tmp_path / "a.exr", "mask").shape == image.shape
        with pytest.raises(EvalsuiteError, match="a part named variance"):
            exr.read(tmp_path / "a.exr", "variance")

    @pytest.mark.parametrize("keep", [0, 3, 20, 200, 0.4, 0.99])
    def test_truncated(self, tmp_path, image, keep, capfd):
        exr.write(tmp_path / "a.exr", image)
        data = (tmp_path / "a.exr").read_bytes()
        (tmp_path / "a.exr").write_bytes(data[: keep if isinstance(keep, int) else int(keep * len(data))])
        with pytest.raises(EvalsuiteError) as error:
            exr.read(tmp_path / "a.exr")
        assert "\n" not in str(error.value) and "a.exr" in str(error.value)
        assert capfd.readouterr() == ("", ""), "the library stays silent"

    def test_oversized_header_is_not_allocated(self, tmp_path, image):
        exr.write(tmp_path / "a.exr", image)
        data = (tmp_path / "a.exr").read_bytes()
        for name in (b"dataWindow", b"displayWindow"):
            at = data.index(name + b"\0box2i\0") + len(name) + 11
            data = data[:at] + struct.pack("<4i", 0, 0, 99_999, 99_999) + data[at + 16 :]
        (tmp_path / "a.exr").write_bytes(data)
        with pytest.raises(EvalsuiteError, match="100000 × 100000"):
            exr.read(tmp_path / "a.exr")

    def test_bad_arrays_and_folders(self, tmp_path, image):
        with pytest.raises(EvalsuiteError, match=r"\(23, 37, 2\)"):
            exr.write(tmp_path / "a.exr", image[..., :2])
        (tmp_path / "file").write_text("")
        with pytest.raises(EvalsuiteError, match="a folder that can be written"):
            exr.write(tmp_path / "file" / "a.exr", image)


class TestHdr:
    @pytest.mark.parametrize("flat", [False, True])
    def test_decodes(self, tmp_path, rgbe, flat):
        (tmp_path / "a.hdr").write_bytes(rgbe_bytes(rgbe, flat))
        expected = rgbe[..., :3] * np.exp2(rgbe[..., 3:].astype(float) - 136) * (rgbe[..., 3:] > 0)
        np.testing.assert_array_equal(exr.read(tmp_path / "a.hdr"), expected.astype(np.float32))

    def test_every_truncation_is_noticed(self, tmp_path, rgbe):
        data = rgbe_bytes(rgbe)
        for keep in [*range(1, len(data), 97), len(data) - 1]:
            (tmp_path / "a.hdr").write_bytes(data[:keep])
            with pytest.raises(EvalsuiteError):
                exr.read(tmp_path / "a.hdr")

    @pytest.mark.parametrize(
        "junk",
        [
            b"junk",
            b"#?RADIANCE\n\n-Y 1 +X 9999999\n",
            b"#?RADIANCE\n\n+Y 1 +X 1\n1234",
            b"#?RADIANCE\nFORMAT=32-bit_rle_xyze\n\n-Y 1 +X 1\n1234",
        ],
    )
    def test_junk(self, tmp_path, junk):
        (tmp_path / "a.hdr").write_bytes(junk)
        with pytest.raises(EvalsuiteError):
            exr.read(tmp_path / "a.hdr")


class TestLdr:
    def test_8_bit(self, tmp_path):
        codes = np.random.default_rng(3).integers(0, 256, (5, 7, 4), dtype=np.uint8)
        iio.imwrite(tmp_path / "a.png", codes)
        np.testing.assert_allclose(exr.read(tmp_path / "a.png"), srgb_to_linear(codes[..., :3] / 255), atol=1e-6)
        iio.imwrite(tmp_path / "b.png", codes[..., 0])
        assert exr.read(tmp_path / "b.png").shape == (5, 7, 3)

    @pytest.mark.parametrize("kind", range(5))
    def test_16_bit_keeps_its_precision(self, tmp_path, kind):
        codes = np.random.default_rng(4).integers(0, 65536, (6, 5, 3), dtype=np.uint16)
        raw = codes.astype(">u2").view(np.uint8).reshape(6, 5, 6).astype(int)
        left, up, corner = np.zeros_like(raw), np.zeros_like(raw), np.zeros_like(raw)
        left[:, 1:], up[1:], corner[1:, 1:] = raw[:, :-1], raw[:-1], raw[:-1, :-1]
        p = left + up - corner
        a, b, c = abs(p - left), abs(p - up), abs(p - corner)
        paeth = np.where((a <= b) & (a <= c), left, np.where(b <= c, up, corner))
        filtered = (raw - [0 * raw, left, up, (left + up) // 2, paeth][kind]) % 256
        lines = b"".join(bytes([kind]) + row.astype(np.uint8).tobytes() for row in filtered)

        def chunk(name, data):
            return struct.pack(">I", len(data)) + name + data + struct.pack(">I", zlib.crc32(name + data))

        header = struct.pack(">IIBBBBB", 5, 6, 16, 2, 0, 0, 0)
        png = b"\x89PNG\r\n\x1a\n" + chunk(b"IHDR", header) + chunk(b"IDAT", zlib.compress(lines)) + chunk(b"IEND", b"")
        (tmp_path / "a.png").write_bytes(png)
        np.testing.assert_allclose(exr.read(tmp_path / "a.png"), srgb_to_linear(codes / 65535), atol=1e-6)
        (tmp_path / "a.png").write_bytes(png[:-30])
        with pytest.raises(EvalsuiteError):
            exr.read(tmp_path / "a.png")

    @pytest.mark.parametrize("name", ["a.png", "a.jpg", "a.exr", "a.hdr", "a.txt", "a"])
    def test_junk_missing_and_unknown(self, tmp_path, name):
        with pytest.raises(EvalsuiteError):
            exr.read(tmp_path / name)
        (tmp_path / name).write_bytes(b"not a picture at all")
        with pytest.raises(EvalsuiteError):
            exr.read(tmp_path / name)

    def test_preview(self, tmp_path):
        encoded = np.linspace(-0.1, 1.1, 60).reshape(4, 5, 3)
        ldr.write_png(tmp_path / "a.png", encoded)
        np.testing.assert_array_equal(iio.imread(tmp_path / "a.png"), np.round(np.clip(encoded, 0, 1) * 255))


def test_colour():
    values = np.linspace(0, 1, 1001)
    np.testing.assert_allclose(srgb_to_linear(linear_to_srgb(values)), values, atol=2e-7)  # the standard's branches meet to 1e-7
    assert srgb_to_linear(np.float64(0.5)) == pytest.approx(0.21404114, abs=1e-8)  # value tabulated for code 0.5
    assert sum(LUMINANCE) == pytest.approx(1) and luminance([0.0, 1.0, 0.0]) == 0.7152
