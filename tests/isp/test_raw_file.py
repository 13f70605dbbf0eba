"""Raw files: a TIFF reader written here and LibRaw read samples and tags back; captures that a DNG
cannot hold are refused.
"""

import json
import struct

import numpy as np
import pytest
from isethdr_isp.raw_file import camera_matrix, write_dng
from isethdr_isp.spectra import light

import isethdr_core as hdr
from isethdr_core.errors import UnitError
from isethdr_core.physics.photometry import xyz_weights
from isethdr_core.quantities import IRRADIANCE, centres, plane

W = np.arange(400.0, 701.0, 10.0)
TYPES = {1: "B", 2: "s", 3: "H", 4: "I", 5: "II", 10: "ii", 12: "d"}


def tiff(path):
    """Return {tag: value} and the samples (y, x) of an uncompressed TIFF of 16 bits, read as TIFF
    6.0 specifies.
    """
    data = path.read_bytes()
    assert data[:4] == b"II*\0"
    [start] = struct.unpack_from("<I", data, 4)
    found = {}
    for k in range(struct.unpack_from("<H", data, start)[0]):
        tag, kind, count, _ = struct.unpack_from("<HHI4s", data, start + 2 + 12 * k)
        form = f"<{count}s" if kind == 2 else "<" + TYPES[kind] * count
        at = (
            start + 10 + 12 * k
            if struct.calcsize(form) <= 4
            else struct.unpack_from("<I", data, start + 10 + 12 * k)[0]
        )
        values = struct.unpack_from(form, data, at)
        if kind in (5, 10):
            values = tuple(a / b for a, b in zip(values[::2], values[1::2]))
        found[tag] = values[0].rstrip(b"\0").decode() if kind == 2 else values
    samples = b"".join(data[o : o + n] for o, n in zip(found[273], found[279]))
    return found, np.frombuffer(samples, "<u2").reshape(found[257][0], found[256][0])


def shot(name="bayer", level=300.0, size=(16, 24), **fields):
    rows, columns = size
    place = centres(columns, columns * 3e-6), centres(rows, rows * 3e-6)
    values = np.broadcast_to(
        level * 0.05 * light("daylight", W)[:, None, None], (len(W), *size)
    ).copy()
    scene = plane(
        values,
        W,
        *place,
        IRRADIANCE,
        f_number=4.0,
        focal_length_mm=4.0,
        throughput_sr=0.05,
        falloff="none",
        field_width=columns * 3e-6,
        field_height=rows * 3e-6,
    )
    return hdr.build("sensor", name, pitch_um=3.0, **fields)(scene, hdr.generator(seed=1))


@pytest.mark.parametrize("name, codes", [("bayer", (0, 1, 1, 2)), ("rgbw", (0, 1, 6, 2))])
def test_samples_and_tags_come_back(tmp_path, name, codes):
    captures = shot(name)  # channels come in the order of the planes
    found, samples = tiff(write_dng(captures, tmp_path / "a.dng"))
    np.testing.assert_array_equal(samples, captures["raw"].values[0])
    assert found[262] == (32803,) and found[50706] == (1, 4, 0, 0)
    assert (
        found[33421] == (2, 2)
        and found[33422] == codes
        and found[50710] == tuple(sorted(codes if name == "rgbw" else (0, 1, 2)))
    )
    assert found[50714] == (float(captures["black_dn"][0]),) and found[50717] == (
        int(captures["top_dn"][0]),
    )
    assert found[33434][0] == pytest.approx(float(captures["exposure_s"][0]), rel=1e-6) and found[
        33437
    ] == (4.0,)
    said = json.loads(found[270])
    assert (
        said["gain_dn_per_e"] == float(captures["gain_dn_per_e"][0])
        and said["throughput_sr"] == 0.05
    )
    # the mean codes of a white have the ratios that the file states as its neutral
    neutral = np.array(found[50728])
    channel = captures["filter"].values
    mean = np.array([(samples[channel == k] - found[50714][0]).mean() for k in range(len(neutral))])
    # 3 %: 96 noisy pixels of 1000 e give 0.3 %, and the fixed pattern 0.5 %
    np.testing.assert_allclose(mean / mean.max(), neutral, rtol=0.03)


def test_the_noise_tag_is_the_noise(tmp_path):
    captures = shot(level=300.0, prnu=0.0, dark_spread=0.0, column_e=0.0)
    found, samples = tiff(write_dng(captures, tmp_path / "a.dng"))
    slope, offset = found[51041][:2]
    green = samples[captures["filter"].values == 1].astype(float)
    x = (green - found[50714][0]) / (found[50717][0] - found[50714][0])
    # 45 %: 4 standard errors; 192 pixels give 10 %
    assert x.var() == pytest.approx(slope * x.mean() + offset, rel=0.45)


def test_the_colour_matrix_leads_from_xyz_to_the_camera(tmp_path):
    captures = shot()
    found, _ = tiff(write_dng(captures, tmp_path / "a.dng"))
    matrix = np.array(found[50721]).reshape(3, 3)
    white = xyz_weights(W) @ light("daylight", W)
    # 1e-5: the file holds fractions of six digits
    np.testing.assert_allclose(matrix @ white, found[50728], rtol=1e-5)
    assert camera_matrix(np.ones((1, len(W))), W).shape == (1, 3)


@pytest.mark.parametrize(
    "cfa, planes",
    [
        ("RGGB", "RGB"),
        ("GRBG", "RGB"),
        ("RCCB", "RCB"),
        ("RWWB", "RWB"),
        ("RYYB", "RYB"),
        ("RGWB", "RGBW"),
    ],
)
def test_an_independent_developer_reads_it(tmp_path, cfa, planes):
    """LibRaw reads every sample, assigns it to the right plane of the file, and develops a neutral
    grey.
    """
    rawpy = pytest.importorskip(
        "rawpy", reason="rawpy is not installed: no LibRaw to read the file with"
    )
    captures = shot(cfa=cfa, size=(24, 32))  # LibRaw refuses fewer than 22 rows or columns
    path = write_dng(captures, tmp_path / "a.dng")
    # codes of CFAPattern in TIFF/EP; 6 is white, which also stands for clear (C)
    codes = {
        "R": 0,
        "G": 1,
        "B": 2,
        "Y": 5,
        "W": 6,
        "C": 6,
    }
    found = tiff(path)[0]
    assert found[50710] == tuple(codes[name] for name in planes) and found[33422] == tuple(
        codes[name] for name in cfa
    )
    with rawpy.imread(str(path)) as raw:
        np.testing.assert_array_equal(raw.raw_image_visible, captures["raw"].values[0])
        assert raw.black_level_per_channel[:3] == [64, 64, 64] and raw.white_level == int(
            captures["top_dn"][0]
        )
        seen = raw.raw_colors_visible
        # if a cell contains a plane twice, LibRaw gives its second sample the number 3
        if len(planes) == 3:
            seen = np.where(seen == 3, 1, seen)
        np.testing.assert_array_equal(
            np.array(list(planes))[seen],
            np.array(captures["channel"].values.tolist())[captures["filter"].values],
        )
        grey = raw.postprocess(use_camera_wb=True, no_auto_bright=True, output_bps=16).mean((0, 1))
    assert np.ptp(grey) < 0.02 * grey.mean()  # a daylight grey is neutral


def test_companding_becomes_the_linearisation_table(tmp_path):
    captures = shot(bits=16, companding=((2048, 2048), (16384, 3072), (65535, 4095)))
    table = np.array(tiff(write_dng(captures, tmp_path / "a.dng"))[0][50712])
    np.testing.assert_array_equal(table[[0, 2048, 3072, 4095]], [0, 2048, 16384, 65535])
    assert len(table) == 4096 and np.all(np.diff(table) > 0)


def test_a_knee_beyond_the_top_is_cut_at_the_largest_sample(tmp_path):
    captures = shot(companding=((1024, 1024), (100_000, 1500)))
    table = np.array(tiff(write_dng(captures, tmp_path / "a.dng"))[0][50712])
    assert len(table) == 1501 and table[-1] == 65535
    step = (100_000 - 1024) / (1500 - 1024)
    np.testing.assert_allclose(table[1024:1100], 1024 + step * np.arange(76), atol=0.5)


@pytest.mark.parametrize("exposure_s", [1e-9, 4e-8, 3e-7, 1.5e-4])
def test_short_exposures_do_not_become_0(tmp_path, exposure_s):
    found = tiff(write_dng(shot(exposure_s=exposure_s), tmp_path / "a.dng"))[0]
    # the shortest exposure of any sensor, 1 ns, is the step of the fraction
    assert found[33434][0] == pytest.approx(exposure_s, rel=1e-6)


def test_one_capture_of_many_and_one_channel(tmp_path):
    captures = shot("split_pixel", cfa="W")
    for name in ("LPHG", "SPLG"):
        found, samples = tiff(write_dng(captures, tmp_path / f"{name}.dng", name))
        np.testing.assert_array_equal(samples, captures["raw"].sel(capture=name).values)
        assert (
            found[262] == (34892,)
            and 33422 not in found
            and json.loads(found[270])["capture"] == name
        )


def test_what_a_dng_cannot_hold_is_said(tmp_path):
    for captures, why in (
        (shot("ideal"), "float32, .*whole DN of 16 bits.*or sensor=bayer in place of"),
        (shot(bits=0), "float32, .*without a converter.*; type sensor.bits=12"),
        (
            shot("interleaved", cfa="RGRG/GBGB/rgrg/gbgb"),
            "no name for filter b, g, r.*type for example sensor=bayer sensor.cfa=RGGB",
        ),
        (shot("lin_log"), "cannot hold a nonlinear response.*; type for example sensor=bayer"),
        (shot("lin_log", bits=0, swing_v=3.0), "cannot hold a nonlinear response"),
        (shot("bayer", bits=20), "top at 1.04858e.06 DN .*whole DN of 16 bits.*sensor.bits=16"),
        (shot("dual_gain", combine_bits=24), "combines its captures.*type sensor.combine_bits=0"),
        (
            shot(cfa="RCCC"),
            "2 x 2 pixels and holds R, C; raw developers read .* three or four kinds of filters"
            ".*; type for example sensor=bayer sensor.cfa=RGGB",
        ),
        (shot(cfa="WGWR/GWRW/WBWG/BWGW"), "repeats after 4 x 4 pixels"),
    ):
        with pytest.raises(UnitError, match=why) as caught:
            write_dng(captures, tmp_path / "a.dng")
        assert "captures." not in str(caught.value)  # Python, which `isethdr export` cannot do
    with pytest.raises(UnitError, match="capture 'LPHQ' is not in this shot"):
        write_dng(shot("split_pixel"), tmp_path / "a.dng", "LPHQ")
