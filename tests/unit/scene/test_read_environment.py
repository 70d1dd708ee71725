"""Every way in which a map can be bad, and the small ones that are not."""

import numpy as np
import OpenEXR
import pytest

from evalsuite.errors import EvalsuiteError
from evalsuite.scene.environment import evaluate, read_environment


def write_exr(path, channels, **header):
    header = {"compression": OpenEXR.ZIP_COMPRESSION, "type": OpenEXR.scanlineimage} | header
    with OpenEXR.File(header, channels) as file:
        file.write(str(path))
    return path


def noise(height, width, seed=1):
    return np.random.default_rng(seed).random((height, width, 3), dtype=np.float32)


def write_hdr(path, texels):
    """Radiance RGBE, flat scanlines."""
    exponent = np.ceil(np.log2(np.maximum(texels.max(axis=2), 1e-30)) + 1e-6)
    mantissa = np.clip(texels * (256 / 2**exponent)[..., None], 0, 255).astype(np.uint8)
    rgbe = np.concatenate([mantissa, (exponent[..., None] + 128).astype(np.uint8)], axis=2)
    head = b"#?RADIANCE\nFORMAT=32-bit_rle_rgbe\n\n-Y %d +X %d\n" % texels.shape[:2]
    path.write_bytes(head + rgbe.tobytes())
    return path


@pytest.mark.parametrize("dtype", [np.float32, np.float16])
@pytest.mark.parametrize("layout", ["RGB", "RGBA", "separate", "layer"])
@pytest.mark.parametrize("kind", [OpenEXR.scanlineimage, OpenEXR.tiledimage])
def test_exr_layouts(tmp_path, dtype, layout, kind):
    texels = noise(7, 12).astype(dtype)
    alpha = np.ones((7, 12), dtype)
    split = [np.ascontiguousarray(texels[..., i]) for i in range(3)]
    channels = {
        "RGB": {"RGB": texels},
        "RGBA": {"RGBA": np.concatenate([texels, alpha[..., None]], axis=2)},
        "separate": {"R": split[0], "G": split[1], "B": split[2], "Z": alpha},
        "layer": {"view.R": split[0], "view.G": split[1], "view.B": split[2]},
    }[layout]
    header = {"tiles": OpenEXR.TileDescription()} if kind == OpenEXR.tiledimage else {}
    if header:
        header["tiles"].xSize = header["tiles"].ySize = 4
    environment = read_environment(write_exr(tmp_path / "a map.exr", channels, type=kind, **header))
    assert environment.radiance.dtype == np.float32 and environment.notes == ()
    assert np.array_equal(environment.radiance, texels.astype(np.float32))
    assert np.array_equal(environment.to_world, np.eye(3))


def test_luminance_only_and_lossy_exr(tmp_path):
    grey = noise(40, 80)[..., 0].copy()
    assert np.array_equal(read_environment(write_exr(tmp_path / "y.exr", {"Y": grey})).radiance, np.dstack([grey] * 3))
    lossy = read_environment(write_exr(tmp_path / "d.exr", {"RGB": noise(40, 80)}, compression=OpenEXR.DWAB_COMPRESSION))
    assert np.abs(lossy.radiance - noise(40, 80)).mean() < 0.05


def test_first_of_several_parts(tmp_path):
    parts = [OpenEXR.Part({"type": OpenEXR.scanlineimage}, {"RGB": noise(5, 6, seed)}, f"part{seed}") for seed in (1, 2)]
    with OpenEXR.File(parts) as file:
        file.write(str(tmp_path / "parts.exr"))
    assert np.array_equal(read_environment(tmp_path / "parts.exr").radiance, noise(5, 6, 1))


def test_hdr(tmp_path):
    texels = noise(6, 9) * 100
    read = read_environment(write_hdr(tmp_path / "map.hdr", texels)).radiance
    assert np.abs(read - texels).max() < 128 / 200  # 8 bits of the largest channel's power of two


def bad_files():
    def whole_exr(path):
        return write_exr(path, {"RGB": noise(64, 128)}).read_bytes()

    def whole_hdr(path):
        return write_hdr(path, noise(64, 128)).read_bytes()

    return {
        "empty.exr": lambda p: b"",
        "junk.exr": lambda p: b"junk" * 100,
        "header.exr": lambda p: whole_exr(p)[:300],
        "half.exr": lambda p: whole_exr(p)[: len(whole_exr(p)) // 2],
        "last.exr": lambda p: whole_exr(p)[:-5],
        "empty.hdr": lambda p: b"",
        "junk.hdr": lambda p: b"junk" * 100,
        "header.hdr": lambda p: whole_hdr(p)[:60],
        "half.hdr": lambda p: whole_hdr(p)[: len(whole_hdr(p)) // 2],
        "last.hdr": lambda p: whole_hdr(p)[:-1],
        "huge.hdr": lambda p: b"#?RADIANCE\nFORMAT=32-bit_rle_rgbe\n\n-Y 1000000 +X 1000000\n",
        "flipped.hdr": lambda p: whole_hdr(p).replace(b"-Y", b"+Y", 1),
        "photo.png": lambda p: b"\x89PNG\r\n",
        "no_extension": lambda p: b"x",
        "depth.exr": lambda p: write_exr(p, {"Z": noise(4, 5)[..., 0].copy()}).read_bytes(),
    }


@pytest.mark.parametrize("name", list(bad_files()))
def test_bad_files_are_named_in_one_line(tmp_path, name, capfd):
    path = tmp_path / name
    content = bad_files()[name](path)
    path.write_bytes(content)
    with pytest.raises(EvalsuiteError) as caught:
        read_environment(path)
    message = str(caught.value)
    assert name in message and "\n" not in message and "got" in message and "expected" in message
    assert capfd.readouterr() == ("", "")


def test_insane_exr_size_is_refused_before_it_is_allocated(tmp_path):
    content = bytearray(write_exr(tmp_path / "big.exr", {"RGB": noise(4, 5)}).read_bytes())
    for window in (b"dataWindow\0", b"displayWindow\0"):
        start = content.index(window) + len(window) + len(b"box2i\0") + 4 + 8
        content[start : start + 8] = (99999).to_bytes(4, "little") * 2
    (tmp_path / "big.exr").write_bytes(content)
    with pytest.raises(EvalsuiteError, match=r"big\.exr"):
        read_environment(tmp_path / "big.exr")


def test_missing_file_and_folder(tmp_path):
    with pytest.raises(EvalsuiteError, match="no such file"):
        read_environment(tmp_path / "none.exr")
    (tmp_path / "folder.exr").mkdir()
    with pytest.raises(EvalsuiteError, match="folder"):
        read_environment(tmp_path / "folder.exr")


def test_negative_texels_are_clamped_and_counted(tmp_path):
    texels = noise(5, 6)
    texels[1, 2], texels[3, 4, 0] = -0.25, -1.5
    environment = read_environment(write_exr(tmp_path / "n.exr", {"RGB": texels}))
    assert np.array_equal(environment.radiance, np.maximum(texels, 0))
    assert len(environment.notes) == 1 and "2 texels" in environment.notes[0] and "-1.5" in environment.notes[0]


def test_nan_and_inf_are_errors_unless_repaired(tmp_path):
    texels = noise(5, 6)
    texels[1, 2, 0], texels[3, 4, 1], texels[4, 0, 2] = np.nan, np.inf, -np.inf
    path = write_exr(tmp_path / "bad texels.exr", {"RGB": texels})
    with pytest.raises(EvalsuiteError, match=r"bad texels\.exr: got 3 texels with NaN or Inf, the first in row 1, column 2"):
        read_environment(path)
    repaired = read_environment(path, repair=True)
    assert repaired.radiance[1, 2, 0] == 0 and repaired.radiance[4, 0, 2] == 0
    assert repaired.radiance[3, 4, 1] == np.delete(texels[..., 1].ravel(), 3 * 6 + 4).max()
    untouched = np.isfinite(texels)
    assert np.array_equal(repaired.radiance[untouched], texels[untouched])
    assert len(repaired.notes) == 1 and "3 texels" in repaired.notes[0]


@pytest.mark.parametrize("shape", [(1, 1), (1, 2), (1, 5), (2, 1), (2, 2), (2, 7), (3, 1), (3, 2), (4, 1), (5, 3)])
def test_tiny_maps_mean_what_mitsuba_makes_of_them(tmp_path, shape):
    from evalsuite.reference.variants import activate

    mi = activate()
    import drjit as dr

    from evalsuite.scene.load import environment_plugin

    texels = noise(*shape)
    environment = read_environment(write_exr(tmp_path / "t.exr", {"RGB": texels}))
    directions = np.random.default_rng(2).normal(size=(3000, 3)).astype(np.float32)
    directions /= np.linalg.norm(directions, axis=1, keepdims=True)
    si = dr.zeros(mi.SurfaceInteraction3f, len(directions))
    si.wi = -mi.Vector3f(np.ascontiguousarray(directions.T))
    theirs = np.array(mi.load_dict({"type": "envmap", "bitmap": mi.Bitmap(texels)}).eval(si)).T
    rebuilt = np.broadcast_to(np.array(environment_plugin(environment).eval(si)).T, theirs.shape)
    ours = evaluate(environment, directions)
    assert ours.max() > 0.1
    assert np.abs(rebuilt - theirs).max() < 1e-6
    assert np.abs(ours - theirs).max() < 1e-5


def test_zero_and_one_texel_maps(tmp_path):
    zero = read_environment(write_exr(tmp_path / "z.exr", {"RGB": np.zeros((8, 16, 3), np.float32)}))
    assert not zero.radiance.any() and zero.notes == ()
