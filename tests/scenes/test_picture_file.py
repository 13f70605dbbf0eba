"""Pictures and spectral cubes of users: light as stated, spectra of RGB, and refusals."""

from __future__ import annotations

import struct
from zlib import compress, crc32

import numpy as np
import OpenEXR
import pytest
import tifffile
import xarray as xr
from isethdr_scenes.charts.chart import band_means, illuminant
from isethdr_scenes.charts.macbeth import Macbeth
from isethdr_scenes.pictures import array_scene
from isethdr_scenes.pictures.content import Wanted
from isethdr_scenes.pictures.picture_file import LIFT_ERROR, PictureFile
from isethdr_scenes.pictures.primaries import CHROMATICITIES, linear_srgb, to_xyz
from isethdr_scenes.pictures.radiance_hdr import read as read_hdr
from isethdr_scenes.pictures.rgb_to_spectra import primary_reflectances, spectra
from isethdr_scenes.pictures.tiff_picture import read as read_tiff
from PIL import Image, ImageOps

import isethdr_core as hdr
from isethdr_core.data import quantities
from isethdr_core.demand import Demand
from isethdr_core.errors import CatalogError, ConfigError, IsetHdrError, UnitError
from isethdr_core.physics.colour.colour_spaces import XYZ_TO_SRGB
from isethdr_core.physics.photometry import luminance, xyz
from isethdr_core.physics.radiometry import photons_per_energy
from isethdr_core.testing import check
from isethdr_core.uncertainty import ledger

FIELD = {"horizontal_field_deg": 40.0}
# relative error: float32 light (6e-8), and the four digits of the weights that the standard gives
# for sRGB's Y
FLOAT32 = 2e-7
BANDS = np.arange(400.0, 701.0, 10.0)


@pytest.fixture
def rgb():
    """Return linear RGB (y, x, 3) over seven decades, with a black pixel and pure primaries."""
    values = 10 ** np.random.default_rng(3).uniform(-3, 4, (7, 9, 3))
    values[0, 0] = 0
    values[0, 1:4] = 50 * np.eye(3)
    return values.astype(np.float32)


def write_exr(path, channels, **header):
    OpenEXR.File(header, dict(channels)).write(str(path))
    return str(path)


def png_of_colours_of_16_bits():
    """Return a PNG of one pixel (PNG specification 1.2, section 3.2), which Pillow cannot write."""

    def chunk(name, data):
        return struct.pack(">I", len(data)) + name + data + struct.pack(">I", crc32(name + data))

    size_and_form = struct.pack(">IIBBBBB", 1, 1, 16, 2, 0, 0, 0)
    pixels = compress(b"\0" + struct.pack(">HHH", 1, 2, 3))
    chunks = (b"IHDR", size_and_form), (b"IDAT", pixels), (b"IEND", b"")
    return b"\x89PNG\r\n\x1a\n" + b"".join(chunk(*one) for one in chunks)


def luminances(scene):
    return luminance(scene.radiance.values[0].astype(float), scene.wavelength.values)


def test_the_conformance_kit_takes_a_file(tmp_path, rgb):
    np.save(tmp_path / "a.npy", rgb)
    check("scene", "file", path=str(tmp_path / "a.npy"), unit="cd/m2", **FIELD)


def test_luminance_of_rgb_is_kept_and_said(tmp_path, rgb):
    path = write_exr(tmp_path / "a.exr", {"RGB": rgb})
    book = ledger.Ledger()
    with ledger.stage(book, "scene"):
        scene = PictureFile(path, white_cd_m2=250.0, **FIELD)()
    wanted = 250.0 * rgb.astype(float) @ to_xyz(CHROMATICITIES["srgb"])[1]
    np.testing.assert_allclose(luminances(scene), wanted, rtol=FLOAT32)
    assert book[0].errors[0].value < FLOAT32
    assert [row.bound for row in book[0].left_out] == [LIFT_ERROR]
    assert scene.radiance.values.min() >= 0


def test_colours_of_rgb_are_kept(rgb):
    daylight = band_means(illuminant("D65"), BANDS)
    daylight = daylight / luminance(daylight, BANDS)
    reflectances = primary_reflectances(BANDS, daylight)
    assert reflectances.min() >= 0
    np.testing.assert_allclose(reflectances.sum(0), 1.0, atol=1e-6)  # white is the illuminant
    light = np.moveaxis(rgb.astype(float), 2, 0)
    y = np.tensordot(to_xyz(CHROMATICITIES["srgb"])[1], light, 1)
    found = xyz(spectra(light, y, reflectances * daylight, BANDS).astype(float), BANDS)
    standard = light.transpose(1, 2, 0) @ np.linalg.inv(XYZ_TO_SRGB).T
    # 3e-3: the white is that of 31 bands, while Z of the standard's white is 0.3 % larger
    np.testing.assert_allclose(found, standard, rtol=3e-3, atol=1e-9)


def test_every_value_of_the_accuracy_knob_holds_rgb(tmp_path, rgb):
    """All values of the accuracy knob keep the colours of RGB.

    Otherwise `isethdr study accuracy` of a picture would be refused.
    """
    np.save(tmp_path / "a.npy", rgb)
    [knob] = PictureFile.accuracy_knobs
    for step_nm in (*knob.tried(), knob.finest()):
        found = PictureFile(str(tmp_path / "a.npy"), unit="cd/m2", step_nm=step_nm, **FIELD)
        found.check_files()


@pytest.mark.parametrize("spectrum", ["D65", "A", "E"])
def test_white_has_the_spectrum_of_the_illuminant(tmp_path, spectrum):
    np.save(tmp_path / "white.npy", np.ones((3, 5, 3)))
    file = PictureFile(str(tmp_path / "white.npy"), white_cd_m2=80.0, spectrum=spectrum, **FIELD)
    scene = file()
    wanted = band_means(illuminant(spectrum), BANDS)
    wanted = 80.0 * wanted / luminance(wanted, BANDS)
    # 1e-6: the reflectances of the primaries sum to 1 within 1e-6
    np.testing.assert_allclose(
        scene.radiance.values[0], np.broadcast_to(wanted[:, None, None], (31, 3, 5)), rtol=1e-6
    )


def test_what_a_camera_makes_of_lifted_patches_differs_by_what_is_stated():
    chart = Macbeth()
    white = chart.white()
    true = chart.reflectances()[1] * white
    patches = xyz(true.T, BANDS)
    found = linear_srgb(patches.T[:, None], "xyz")
    made = spectra(
        found.rgb, patches[None, :, 1], primary_reflectances(BANDS, white) * white, BANDS
    )
    response = hdr.build("sensor", "bayer").narrow(Demand()).response
    weights = response.efficiency(BANDS) * photons_per_energy(BANDS)
    relative = (made[:, 0].T @ weights.T) / (true @ weights.T) - 1
    assert np.sqrt(np.mean(relative**2)) == pytest.approx(LIFT_ERROR, abs=5e-4)


def test_a_cube_comes_back_bit_for_bit_from_every_format(tmp_path):
    cube = 10 ** np.random.default_rng(1).uniform(-6, 3, (4, 5, 7))
    cube = cube.astype(np.float32)
    nm = [410.0, 500.0, 590.0, 680.0]
    data = xr.DataArray(
        cube,
        dims=("wavelength", "y", "x"),
        coords={"wavelength": nm},
        attrs={"units": "W m-2 sr-1 nm-1"},
        name="radiance",
    )
    data.to_dataset().to_zarr(tmp_path / "a.zarr", consolidated=False)
    data.to_dataset().to_netcdf(tmp_path / "a.nc", engine="scipy")
    np.savez(tmp_path / "a.npz", cube=cube, wavelength_nm=nm, unit="W/m2/sr/nm")
    tifffile.imwrite(tmp_path / "a.tif", cube, photometric="minisblack")
    np.save(tmp_path / "a.npy", cube.transpose(1, 2, 0))
    write_exr(tmp_path / "a.exr", {f"S0.{w:.0f},000nm": cube[k] for k, w in enumerate(nm)})
    without = {"a.tif": {"wavelength_nm": tuple(nm)}, "a.npy": {"wavelength_nm": tuple(nm)}}
    for name in ("a.zarr", "a.nc", "a.npz", "a.tif", "a.npy", "a.exr"):
        unit = {} if name in ("a.zarr", "a.nc", "a.npz") else {"unit": "W/m2/sr/nm"}
        scene = PictureFile(str(tmp_path / name), **unit, **without.get(name, {}), **FIELD)()
        np.testing.assert_array_equal(scene.radiance.values[0], cube, err_msg=name)
        assert scene.wavelength.values.tolist() == nm


def test_a_netcdf_4_file_is_read(tmp_path):
    pytest.importorskip("h5netcdf", reason="NetCDF 4 needs the extra netcdf")
    data = xr.DataArray(
        np.ones((2, 3, 4)),
        dims=("y", "x", "wavelength"),
        coords={"wavelength": ("wavelength", [0.7, 0.5, 0.4, 0.6], {"units": "um"})},
        attrs={"units": "W m-2 sr-1 um-1"},
        name="L",
    )
    data.to_dataset().to_netcdf(tmp_path / "a.nc", engine="h5netcdf")
    scene = PictureFile(str(tmp_path / "a.nc"), **FIELD)()
    np.testing.assert_allclose(scene.wavelength, [400, 500, 600, 700])
    np.testing.assert_allclose(scene.radiance, 1e-3, rtol=FLOAT32)


def test_units_of_cubes_and_reflectance(tmp_path):
    nm = tuple(BANDS.tolist())
    np.save(tmp_path / "a.npy", np.full((31, 2, 3), 0.5))
    for unit, factor in (("W/m2/sr/um", 1e-3), ("uW/cm2/sr/nm", 1e-2), ("mW/m2/sr/nm", 1e-3)):
        scene = PictureFile(str(tmp_path / "a.npy"), unit, wavelength_nm=nm, **FIELD)()
        np.testing.assert_allclose(scene.radiance, 0.5 * factor, rtol=FLOAT32)
    file = PictureFile(str(tmp_path / "a.npy"), "reflectance", 400.0, wavelength_nm=nm, **FIELD)
    # 3e-4: white has its luminance at all visible wavelengths, not at these bands alone
    np.testing.assert_allclose(luminances(file()), 200.0, rtol=5e-4)


@pytest.mark.parametrize("first_nm, last_nm", [(400.0, 440.0), (700.0, 800.0), (900.0, 1000.0)])
def test_reflectance_beyond_the_visible_has_the_light_of_the_illuminant(
    tmp_path, first_nm, last_nm
):
    nm = np.arange(first_nm, last_nm + 1, 10.0)
    np.savez(tmp_path / "a.npz", cube=np.full((len(nm), 2, 3), 0.5), wavelength_nm=nm)
    scene = PictureFile(str(tmp_path / "a.npz"), "reflectance", 300.0, spectrum="A", **FIELD)()
    visible = np.arange(380.0, 781.0)
    light = band_means(illuminant("A"), nm) / luminance(illuminant("A")(visible), visible)
    np.testing.assert_allclose(scene.radiance.values[0, :, 0, 0], 150 * light, rtol=1e-4)


def test_luminance_needs_visible_bands(tmp_path):
    np.save(tmp_path / "y.npy", np.ones((2, 3)))
    path = str(tmp_path / "y.npy")
    for first_nm, last_nm in ((800.0, 900.0), (700.0, 900.0), (400.0, 440.0)):
        file = PictureFile(path, "cd/m2", first_nm=first_nm, last_nm=last_nm, **FIELD)
        with pytest.raises(ConfigError, match="type scene.first_nm=400 scene.last_nm=700"):
            file.check_files()
    scene = PictureFile(path, "cd/m2", first_nm=550.0, last_nm=550.0, **FIELD)()
    np.testing.assert_allclose(luminances(scene), 1.0, rtol=FLOAT32)


def test_luminance_files_and_photos(tmp_path):
    level = np.linspace(0, 5e4, 12).reshape(3, 4)
    np.save(tmp_path / "y.npy", level)
    scene = PictureFile(str(tmp_path / "y.npy"), "cd/m2", **FIELD)()
    np.testing.assert_allclose(luminances(scene), level, rtol=FLOAT32)
    codes = np.full((4, 6, 3), 188, np.uint8)
    tifffile.imwrite(tmp_path / "photo.tif", codes)
    photo = PictureFile(str(tmp_path / "photo.tif"), white_cd_m2=100.0, encoding="srgb", **FIELD)
    # IEC 61966-2-1: code 188 of 255 is 0.50289 of white
    np.testing.assert_allclose(luminances(photo()), 50.289, rtol=1e-4)


@pytest.mark.parametrize("ending, mode", [("png", "RGB"), ("png", "RGBA"), ("bmp", "RGB")])
def test_photos_are_the_same_as_the_array_of_their_codes(tmp_path, ending, mode):
    codes = np.random.default_rng(1).integers(0, 256, (4, 6, 3), np.uint8)
    Image.fromarray(codes).convert(mode).save(tmp_path / f"photo.{ending}")
    np.save(tmp_path / "photo.npy", codes)
    found, wanted = (
        PictureFile(str(tmp_path / f"photo.{name}"), white_cd_m2=100.0, encoding="srgb", **FIELD)()
        for name in (ending, "npy")
    )
    np.testing.assert_array_equal(found.radiance.values, wanted.radiance.values)


@pytest.mark.parametrize("bits", [np.uint8, np.uint16])
def test_grey_photos_keep_all_bits_and_turn_upright(tmp_path, bits):
    codes = np.arange(6).reshape(2, 3).astype(bits) * (np.iinfo(bits).max // 5)
    exif = Image.Exif()
    exif[0x0112] = 6  # Exif's orientation: the camera was turned by 90 degrees
    Image.fromarray(codes).save(tmp_path / "grey.png", exif=exif)
    file = PictureFile(str(tmp_path / "grey.png"), white_cd_m2=100.0, encoding="linear", **FIELD)
    wanted = 100.0 * np.rot90(codes, -1) / np.iinfo(bits).max
    np.testing.assert_allclose(luminances(file()), wanted, rtol=FLOAT32)


@pytest.mark.parametrize("orientation", range(1, 9))
def test_a_tiff_is_turned_upright_as_pillow_turns_it(tmp_path, orientation):
    codes = np.random.default_rng(2).integers(0, 256, (3, 5, 3), np.uint8)
    path = tmp_path / "turned.tif"
    tifffile.imwrite(path, codes, photometric="rgb", extratags=[(274, "H", 1, orientation, True)])
    with Image.open(path) as photo:
        wanted = np.asarray(ImageOps.exif_transpose(photo))
    np.testing.assert_array_equal(np.moveaxis(read_tiff(path, Wanted()).values[0], 0, 2), wanted)


def test_a_tiff_whose_smallest_code_is_white_is_inverted(tmp_path):
    codes = np.arange(6, dtype=np.uint16).reshape(2, 3)
    tifffile.imwrite(tmp_path / "a.tif", codes, photometric="miniswhite")
    np.testing.assert_array_equal(
        read_tiff(tmp_path / "a.tif", Wanted()).values[0, 0], 65535 - codes
    )


def test_a_damaged_tiff_is_refused_in_one_line(tmp_path):
    path = tmp_path / "a.tif"
    light = np.random.default_rng(1).uniform(1, 2, (27, 48, 3)).astype(np.float32)
    tifffile.imwrite(path, light, compression="zlib")
    whole = path.read_bytes()
    random = np.random.default_rng(0)
    for _ in range(30):
        damaged = np.frombuffer(whole, np.uint8).copy()
        damaged[random.integers(0, len(whole), 5)] = random.integers(0, 256, 5)
        path.write_bytes(damaged.tobytes()[: random.integers(100, len(whole))])
        with pytest.raises(IsetHdrError) as caught:
            read_tiff(path, Wanted())
        assert "\n" not in str(caught.value)


def test_a_tiff_of_a_compression_without_decoder_is_told_what_to_install(tmp_path, monkeypatch):
    path = tmp_path / "a.tif"
    Image.new("RGB", (4, 3)).save(path, compression="tiff_lzw")
    # as if the optional package imagecodecs was not installed
    monkeypatch.setattr(tifffile.TIFF, "DECOMPRESSORS", {tifffile.COMPRESSION.NONE: None})
    with pytest.raises(CatalogError, match="compression LZW, .*; type pip install imagecodecs"):
        read_tiff(path, Wanted())


def test_the_part_of_an_exr_that_has_the_channels_is_read(tmp_path):
    path = tmp_path / "parts.exr"
    light = np.full((3, 4, 3), 2.0, np.float32)

    def write(**parts):
        OpenEXR.File(
            [OpenEXR.Part({"name": name}, dict(channels)) for name, channels in parts.items()]
        ).write(str(path))
        return PictureFile(str(path), "cd/m2", **FIELD)

    write(depth={"D": light[..., 0].copy()}, beauty={"RGB": light}).check_files()
    with pytest.raises(UnitError, match="2 parts, left, right; .*type for example scene.variable="):
        write(left={"RGB": light}, right={"RGB": 3 * light}).check_files()
    scene = PictureFile(str(path), "cd/m2", variable="right", **FIELD)()
    np.testing.assert_allclose(luminances(scene), 6.0, rtol=FLOAT32)
    with pytest.raises(UnitError, match="the parts left, right, and scene.variable is top;"):
        PictureFile(str(path), "cd/m2", variable="top", **FIELD).check_files()
    with pytest.raises(UnitError, match="2 parts with the channels a: R; b: G; expected one part"):
        write(a={"R": light[..., 0].copy()}, b={"G": light[..., 0].copy()}).check_files()


def test_a_damaged_exr_is_refused_in_one_line(tmp_path, rgb):
    path = tmp_path / "a.exr"
    write_exr(path, {"RGB": rgb})
    whole = path.read_bytes()
    for end in range(8, len(whole), 13):
        path.write_bytes(whole[:end])
        with pytest.raises(IsetHdrError) as caught:
            PictureFile(str(path), "cd/m2", **FIELD).check_files()
        assert "\n" not in str(caught.value)


def test_windows_and_pixels_of_an_exr_fill_the_field(tmp_path, rgb):
    shown = (np.array([0, 0], np.int32), np.array([99, 59], np.int32))
    path = write_exr(tmp_path / "a.exr", {"RGB": rgb}, displayWindow=shown)
    with pytest.raises(UnitError, match="its display window is columns 0 to 99, rows 0 to 59;"):
        PictureFile(path, "cd/m2", **FIELD).check_files()
    path = write_exr(tmp_path / "a.exr", {"RGB": rgb}, pixelAspectRatio=2.0)
    with pytest.raises(UnitError, match="the aspect ratio 2; expected square"):
        PictureFile(path, "cd/m2", **FIELD).check_files()


@pytest.mark.parametrize("white", [0.0, -3.0, np.nan, np.inf])
def test_a_white_without_light_is_refused_where_it_is_used(tmp_path, rgb, white):
    path = write_exr(tmp_path / "a.exr", {"RGB": rgb}, whiteLuminance=white)
    with pytest.raises(UnitError, match=f"states whiteLuminance {white:g}; .*scene.white_cd_m2="):
        PictureFile(path, **FIELD).check_files()
    PictureFile(path, white_cd_m2=300.0, **FIELD).check_files()
    PictureFile(path, "cd/m2", **FIELD).check_files()


CUBE = np.ones((2, 3, 4))
ODD_CUBES = [
    (CUBE[:, :0], [500.0, 600.0], "is empty .*y: 0"),
    (CUBE.astype(str), [500.0, 600.0], "holds values of type <U32"),
    (CUBE + 1j, [500.0, 600.0], "holds values of type complex128"),
    (CUBE > 0, [500.0, 600.0], "holds values of type bool"),
    (CUBE, ["a", "b"], "holds wavelengths of type <U1; expected real numbers"),
]


@pytest.mark.parametrize("values, nm, message", ODD_CUBES)
def test_cubes_that_hold_no_light_are_refused(tmp_path, values, nm, message):
    cube = xr.DataArray(
        values,
        dims=("wavelength", "y", "x"),
        coords={"wavelength": nm},
        attrs={"units": "W/m2/sr/nm"},
        name="radiance",
    )
    cube.to_dataset().to_zarr(tmp_path / "a.zarr", consolidated=False)
    with pytest.raises(UnitError, match=message):
        PictureFile(str(tmp_path / "a.zarr"), **FIELD).check_files()
    with pytest.raises(UnitError, match=message):
        array_scene(cube, **FIELD)


def test_damaged_cubes_are_refused(tmp_path):
    cube = xr.DataArray(CUBE, dims=("wavelength", "y", "x"), name="radiance")
    cube = cube.assign_coords(wavelength=[500.0, 600.0])
    cube.to_dataset().to_zarr(tmp_path / "a.zarr", consolidated=False)
    for chunk in (tmp_path / "a.zarr" / "radiance" / "c").rglob("*"):
        if chunk.is_file():
            chunk.write_bytes(b"abc")
    cube.to_dataset().to_netcdf(tmp_path / "a.nc", engine="scipy")
    whole = (tmp_path / "a.nc").read_bytes()
    (tmp_path / "a.nc").write_bytes(whole[:40])
    (tmp_path / "text.nc").write_text("hello")
    for name in ("a.zarr", "a.nc", "text.nc"):
        with pytest.raises(CatalogError, match="is not a readable"):
            PictureFile(str(tmp_path / name), "W/m2/sr/nm", **FIELD).check_files()


def test_wavelengths_that_contradict_the_file_are_refused(tmp_path, rgb):
    nm = [500.0, 600.0]
    np.savez(tmp_path / "a.npz", cube=CUBE, wavelength_nm=nm)
    cube = xr.DataArray(CUBE, dims=("wavelength", "y", "x"), name="radiance")
    cube.assign_coords(wavelength=nm).to_dataset().to_zarr(tmp_path / "a.zarr", consolidated=False)
    plane = np.ones((3, 4), np.float32)
    write_exr(tmp_path / "a.exr", {"S0.500,000nm": plane, "S0.600,000nm": plane})
    for name in ("a.npz", "a.zarr", "a.exr"):
        path = str(tmp_path / name)
        scene = PictureFile(path, "W/m2/sr/nm", wavelength_nm=tuple(nm), **FIELD)()
        assert scene.wavelength.values.tolist() == nm
        for other in ((500.0, 610.0), (600.0, 500.0), (500.0,)):
            with pytest.raises(UnitError, match="states 2 bands, 500 to 600 nm, and scene.wave"):
                PictureFile(path, "W/m2/sr/nm", wavelength_nm=other, **FIELD).check_files()
    path = write_exr(tmp_path / "rgb.exr", {"RGB": rgb})
    with pytest.raises(UnitError, match="holds the colours R, G, B, and scene.wavelength_nm"):
        PictureFile(path, "cd/m2", wavelength_nm=(500.0, 600.0), **FIELD).check_files()


def test_negative_codes_are_not_lost_in_srgb(tmp_path):
    np.save(tmp_path / "a.npy", np.array([[-300, 0, 32767]], np.int16))
    fields = {"white_cd_m2": 100.0, "encoding": "srgb", **FIELD}
    with pytest.raises(UnitError, match="holds 1 negative values"):
        PictureFile(str(tmp_path / "a.npy"), **fields).check_files()
    scene = PictureFile(str(tmp_path / "a.npy"), negative_to_zero=True, **fields)()
    np.testing.assert_allclose(luminances(scene), [[0, 0, 100.0]], rtol=FLOAT32)


def test_a_jpeg_is_read(tmp_path):
    Image.new("RGB", (16, 8), (188, 188, 188)).save(tmp_path / "p.jpg", quality=100)
    photo = PictureFile(str(tmp_path / "p.jpg"), white_cd_m2=100.0, encoding="srgb", **FIELD)
    # IEC 61966-2-1: code 188 of 255 is 0.50289 of white; JPEG may move a code by 1, 1.2 % here
    np.testing.assert_allclose(luminances(photo()), 50.289, rtol=0.013)


def test_xyz_and_wide_primaries_keep_luminance(tmp_path):
    wide = np.array([[[0.0, 5.0, 0.0], [1.0, 2.0, 3.0]]], np.float32)
    np.save(tmp_path / "a.npy", wide)
    scene = PictureFile(str(tmp_path / "a.npy"), "cd/m2", primaries="rec2020", **FIELD)()
    wanted = wide.astype(float) @ to_xyz(CHROMATICITIES["rec2020"])[1]
    np.testing.assert_allclose(luminances(scene), wanted, rtol=FLOAT32)
    planes = {"X": 3.0, "Y": 4.0, "Z": 5.0}
    path = write_exr(
        tmp_path / "b.exr", {k: np.full((2, 3), v, np.float32) for k, v in planes.items()}
    )
    scene = PictureFile(path, "cd/m2", primaries="xyz", **FIELD)()
    np.testing.assert_allclose(luminances(scene), 4.0, rtol=FLOAT32)
    with pytest.raises(ConfigError, match="type scene.primaries=xyz"):
        PictureFile(path, "cd/m2", **FIELD).check_files()


def test_a_header_that_states_white_and_chromaticities_is_read(tmp_path, rgb):
    stated = CHROMATICITIES["rec2020"]
    path = write_exr(tmp_path / "a.exr", {"RGB": rgb}, whiteLuminance=300.0, chromaticities=stated)
    with pytest.raises(UnitError, match="type scene.primaries=rec2020"):
        PictureFile(path, **FIELD).check_files()
    scene = PictureFile(path, primaries="rec2020", **FIELD)()
    wanted = 300.0 * rgb.astype(float) @ to_xyz(stated)[1]
    np.testing.assert_allclose(luminances(scene), wanted, rtol=FLOAT32)


def test_a_unit_in_an_unknown_spelling_gives_way_to_that_of_the_scene(tmp_path):
    path = tmp_path / "c.npz"
    for unit, factor in (("watts", 1e-3), ("mW·m⁻²·sr⁻¹·nm⁻¹", 1e-3)):
        np.savez(path, radiance=np.ones((2, 4, 6)), wavelength_nm=[500, 600], unit=unit)
        scene = PictureFile(str(path), "mW/m2/sr/nm", **FIELD)()
        np.testing.assert_allclose(scene.radiance, factor, rtol=FLOAT32)
    np.savez(path, radiance=np.ones((2, 4, 6)), wavelength_nm=[500, 600], unit="watts")
    with pytest.raises(UnitError, match="states the unit 'watts'"):
        PictureFile(str(path), **FIELD).check_files()


def rgbe(lines: bytes, width: int, height: int, more: bytes = b"") -> bytes:
    head = b"#?RADIANCE\n" + more + b"FORMAT=32-bit_rle_rgbe\n\n"
    return head + f"-Y {height} +X {width}\n".encode() + lines


def test_radiance_hdr_of_all_three_codings(tmp_path):
    flat = bytes([128, 64, 32, 129] * 3)
    (tmp_path / "flat.hdr").write_bytes(rgbe(flat, 3, 1))
    (tmp_path / "old.hdr").write_bytes(rgbe(bytes([128, 64, 32, 129, 1, 1, 1, 2]), 3, 1))
    line = bytes([2, 2, 0, 9]) + b"".join(bytes([128 + 8, v, 1, v]) for v in (128, 64, 32, 129))
    (tmp_path / "new.hdr").write_bytes(rgbe(line, 9, 1, b"EXPOSURE=2\n"))
    # (mantissa + 0.5) / 256 * 2^(129 - 128)
    wanted = np.array([128.5, 64.5, 32.5]) / 128
    for name, exposure in (("flat", 1), ("old", 1), ("new", 2)):
        values = read_hdr(tmp_path / f"{name}.hdr", None).values[0]
        np.testing.assert_allclose(
            values[:, 0, :].T * exposure, np.tile(wanted, (values.shape[2], 1))
        )
    told = " ".join(map(str, CHROMATICITIES["rec2020"])).encode()
    (tmp_path / "wide.hdr").write_bytes(rgbe(flat, 3, 1, b"PRIMARIES= " + told + b"\n"))
    with pytest.raises(UnitError, match="type scene.primaries=rec2020"):
        PictureFile(str(tmp_path / "wide.hdr"), white_cd_m2=179.0, **FIELD).check_files()
    for cut in (b"", flat[:5]):
        (tmp_path / "cut.hdr").write_bytes(rgbe(cut, 3, 1))
        with pytest.raises(CatalogError, match="cut.hdr is not a readable Radiance HDR"):
            read_hdr(tmp_path / "cut.hdr", None)


def test_the_header_of_a_radiance_hdr_states_factors_and_pixels(tmp_path):
    path = tmp_path / "a.hdr"
    flat = bytes([128, 128, 128, 129] * 3)
    of_input = b"in.hdr:\n\tEXPOSURE=8\n\tPIXASPECT=2\n"  # counts only for that picture
    own = b"EXPOSURE =2\nCOLORCORR=1 2 4\nCOLORCORR= 1 1 2\n"
    path.write_bytes(rgbe(flat, 3, 1, of_input + own))
    values = read_hdr(path, None).values[0, :, 0, 0]
    np.testing.assert_allclose(values, 128.5 / 128 / np.array([2, 4, 16]))
    path.write_bytes(rgbe(flat, 3, 1, b"PIXASPECT=2\n"))
    with pytest.raises(UnitError, match="PIXASPECT=2; expected square pixels"):
        read_hdr(path, None)
    for width, height in ((10**5, 10**5), (10**12, 1), (10**30, 1), (1, 10**30)):
        path.write_bytes(rgbe(flat, width, height))
        with pytest.raises(CatalogError, match="fewer scan lines than -Y"):
            read_hdr(path, None)


def test_the_field_is_that_of_angle_or_pixel(tmp_path):
    np.save(tmp_path / "y.npy", np.ones((5, 10)))
    path = str(tmp_path / "y.npy")
    scene = PictureFile(path, "cd/m2", horizontal_field_deg=60.0)()
    assert scene.attrs["field_width"] == pytest.approx(2 * np.tan(np.radians(30)), rel=1e-12)
    scene = PictureFile(path, "cd/m2", pixel_mrad=2.0)()
    assert quantities.tile_pitch(scene, "x") == pytest.approx(2e-3, rel=1e-12)
    wide = PictureFile(path, "cd/m2", horizontal_field_deg=190.0, projection="equidistant")()
    assert wide.attrs["field_width"] == pytest.approx(np.radians(190), rel=1e-12)


BAD = [
    ({}, ConfigError, "scene.path is ''"),
    ({"path": "gone.exr"}, CatalogError, "gone.exr does not exist"),
    ({"path": "p.png"}, CatalogError, "p.png is not a readable photo file"),
    ({"path": "deep.png"}, UnitError, "deep.png holds colours of 16 bits; .* save it as TIFF"),
    ({"path": "p.xyz"}, ConfigError, "p.xyz ends in '.xyz'"),
    ({"path": "cut.exr", "unit": "cd/m2"}, CatalogError, "cut.exr is not a readable EXR"),
    ({"path": "rgb.npy"}, ConfigError, "type for example scene.white_cd_m2=300, or scene.unit="),
    ({"path": "rgb.npy", "unit": "W/m2/sr/nm"}, ConfigError, "is W/m2/sr/nm; expected the lumin"),
    ({"path": "rgb.npy", "unit": "cd/m2", "white_cd_m2": 3.0}, ConfigError, "white_cd_m2=null"),
    ({"path": "cube.npz"}, ConfigError, "type scene.unit=W/m2/sr/nm"),
    ({"path": "cube.npz", "unit": "cd/m2"}, ConfigError, "the unit of the cube .* is cd/m2"),
    ({"path": "said.npz", "unit": "reflectance"}, UnitError, "states the unit 'W m-2 sr-1 nm-1'"),
    ({"path": "odd.npz"}, UnitError, "states the unit 'photons'"),
    ({"path": "cube.npy", "unit": "W/m2/sr/nm"}, UnitError, r"type for example 'scene.wavelength"),
    ({"path": "nan.npy", "unit": "cd/m2"}, UnitError, "NaN or infinite, the first in G at row 1"),
    ({"path": "minus.npy", "unit": "cd/m2"}, UnitError, "type scene.negative_to_zero=true"),
    ({"path": "codes.npy", "white_cd_m2": 3.0}, ConfigError, "type scene.encoding=srgb"),
    (
        {"path": "codes.npy", "unit": "cd/m2", "encoding": "linear"},
        ConfigError,
        "uint16 codes, and the unit is cd/m2",
    ),
    ({"path": "named.exr", "unit": "cd/m2"}, UnitError, "has the channels A, G, R and lacks"),
    ({"path": "two.npz", "unit": "cd/m2"}, UnitError, "holds the arrays a, b; expected one"),
    ({"path": "rgb.npy", "unit": "cd/m2", "step_nm": 60.0}, ConfigError, "cannot hold the colours"),
    ({"path": "empty.npy", "unit": "cd/m2"}, UnitError, "is empty"),
    ({"path": "map.tif"}, UnitError, "the colours PALETTE .*; save it as grey or RGB"),
    ({"path": "ink.tif"}, UnitError, "the colours SEPARATED"),
    ({"path": "bit.tif"}, UnitError, "has integers of 1 bits; expected 8, 16 or 32"),
    ({"path": "pair.tif"}, UnitError, r"holds 2 separate pictures \(3 x 4, 2 x 2\); expected one"),
    ({"path": "words.npz"}, UnitError, "holds wavelength_nm as <U1 values; expected real numbers"),
]


@pytest.mark.parametrize("fields, error, message", BAD)
def test_bad_files_are_refused_in_one_line(tmp_path, monkeypatch, fields, error, message):
    monkeypatch.chdir(tmp_path)
    ones = np.ones((3, 4, 3))
    np.save("rgb.npy", ones)
    np.save("nan.npy", np.where(np.arange(36).reshape(3, 4, 3) == 13, np.nan, ones))
    np.save("minus.npy", -ones)
    np.save("codes.npy", ones.astype(np.uint16))
    np.save("cube.npy", np.ones((5, 3, 4)))
    np.save("empty.npy", np.ones((0, 4, 3)))
    cube = {"cube": np.ones((5, 3, 4)), "wavelength_nm": [400, 450, 500, 550, 600]}
    np.savez("cube.npz", **cube)
    np.savez("said.npz", **cube, unit="W m-2 sr-1 nm-1")
    np.savez("odd.npz", **cube, unit="photons")
    np.savez("two.npz", a=ones, b=ones)
    np.savez("words.npz", cube=np.ones((1, 3, 4)), wavelength_nm=["a"], unit="W/m2/sr/nm")
    codes = np.ones((3, 4), np.uint8)
    palette = np.zeros((3, 256), np.uint16)
    tifffile.imwrite("map.tif", codes, photometric="palette", colormap=palette)
    tifffile.imwrite("ink.tif", np.ones((3, 4, 4), np.uint8), photometric="separated")
    tifffile.imwrite("bit.tif", codes > 0, photometric="minisblack")
    tifffile.imwrite("pair.tif", codes)
    tifffile.imwrite("pair.tif", codes[:2, :2], append=True)
    for name in ("p.png", "p.xyz", "cut.exr"):
        (tmp_path / name).write_bytes(b"abc")
    (tmp_path / "deep.png").write_bytes(png_of_colours_of_16_bits())
    write_exr(tmp_path / "named.exr", {c: np.ones((3, 4), np.float32) for c in "RGA"})
    with pytest.raises(error, match=message) as caught:
        PictureFile(**{**FIELD, **fields}).check_files()
    assert isinstance(caught.value, IsetHdrError) and "\n" not in str(caught.value)


def test_negative_values_are_set_to_zero_on_request_and_counted(tmp_path):
    np.save(tmp_path / "y.npy", np.array([[1.0, -0.25, -0.5]]))
    book = ledger.Ledger()
    with ledger.stage(book, "scene"):
        path = str(tmp_path / "y.npy")
        scene = PictureFile(path, "cd/m2", negative_to_zero=True, **FIELD)()
    np.testing.assert_allclose(luminances(scene), [[1.0, 0.0, 0.0]], rtol=FLOAT32)
    assert "2 negative values of the file" in {row.what: row.bound for row in book[0].left_out}
    with pytest.raises(ConfigError, match="field angle"):
        PictureFile(path, "cd/m2", negative_to_zero=True).check_files()


def test_an_array_without_its_file_is_told_what_makes_one(isethdr_home):
    asked = ["scene=array", "experiment=own_picture", "lens=ideal", "~flare.dirt", "sensor=bayer"]
    with pytest.raises(ConfigError, match=r"scene=file scene\.path=.*array_scene\(values\)"):
        hdr.run(hdr.compose(asked))


def test_an_array_of_python_runs_through_a_camera_in_one_line(tmp_path, monkeypatch):
    monkeypatch.setenv("ISETHDR_HOME", str(tmp_path))
    image = np.linspace(1, 400, 18 * 32 * 3).reshape(18, 32, 3)
    overrides = array_scene(image, unit="cd/m2", horizontal_field_deg=20.0)
    assert array_scene(image, unit="cd/m2", horizontal_field_deg=20.0) == overrides
    small = ["lens=ideal", "~flare.dirt", "sensor=bayer", "draws=1", "report=false"]
    result = hdr.run(hdr.compose([*overrides, "experiment=own_picture", *small]))
    picture = result.open("picture/bayer")["xyz"].sel(xyz_channel="Y")
    wanted = image @ to_xyz(CHROMATICITIES["srgb"])[1]
    # 3 %: colour error of sRGB through the sensor's colour matrix, as a mean over the frame
    assert float(picture.mean()) == pytest.approx(wanted.mean(), rel=0.03)
    cube = xr.DataArray(
        np.ones((2, 3, 4)),
        dims=("wavelength", "y", "x"),
        coords={"wavelength": [500.0, 600.0]},
        attrs={"units": "W m-2 sr-1 nm-1"},
    )
    [name, path, field] = array_scene(cube, horizontal_field_deg=20.0)
    assert (name, field) == ("scene=array", "scene.horizontal_field_deg=20.0")
    with pytest.raises(UnitError, match="negative"):
        array_scene(-image, unit="cd/m2", horizontal_field_deg=20.0)
