"""Comparison with numbers computed by ISETCam. The data are not part of the project."""

import os
from pathlib import Path

import numpy as np
import pytest
from isethdr_optics import DiffractionLimitedLens, IdealLens
from isethdr_optics.lenses.isetcam_parity import optical_image

from isethdr_core.data import quantities
from isethdr_core.physics.diffraction import diffraction_mtf, psf_from_pupil
from isethdr_core.physics.optics.zernike import wavefront_um


def reference(name):
    folder = os.environ.get("ISETHDR_REFERENCE")
    if not folder:
        pytest.skip("ISETHDR_REFERENCE is not set to the folder of reference numbers")
    return np.load(Path(folder) / "isetcam" / f"{name}.npz")


def uniform(values, wave, count=5, half=0.01):
    x = quantities.centres(count, 2 * half)
    cube = np.broadcast_to(np.asarray(values, float)[:, None, None], (len(wave), count, count))
    return quantities.plane(cube, wave, x, x, quantities.RADIANCE)


def test_irradiance_of_a_uniform_scene(largest_difference):
    d = reference("b_irradiance")
    for case in range(9):
        lens = IdealLens(
            f_number=float(d["case_fnumber"][case]),
            focal_length_mm=1e3 * float(d["focal_length_m"]),
            object_distance_m=float(d["case_distance_m"][case]),
            falloff="none",
        )
        light = lens(uniform(d["radiance_photons"], d["wave"]))
        # 1e-6: the reference was computed in float32
        found = light.values[:, 2, 2]
        np.testing.assert_allclose(found, d["irr_before_otf"][:, case], rtol=1e-6)
        largest_difference("irradiance of a uniform scene", found, d["irr_before_otf"][:, case])


def test_cos4(largest_difference):
    d = reference("b_irradiance")
    want = d["cos4th_factor"]
    n = len(want)
    f = 1e3 * float(d["cos4th_focal_m"])
    far = float(d["cos4th_distance_m"])
    # ISETCam measures field positions at the image distance, so the field is in tangents.
    x = quantities.centres(n, 2 * np.tan(np.radians(float(d["cos4th_fov_deg"]) / 2)))
    lens = IdealLens(focal_length_mm=f, object_distance_m=far)
    light = lens(quantities.plane(np.ones((1, n, n)), [550.0], x, x, quantities.RADIANCE))
    got = light.values[0] / lens.throughput_sr()
    np.testing.assert_allclose(got, want, rtol=3e-3)  # ISETCam: near-field formula, sample grid
    largest_difference("cos4 falloff", got, want)


def test_diffraction_transfer_function(largest_difference):
    d = reference("c_dl_otf")
    frequency = d["otf_axis_mm"]
    fx, fy = np.meshgrid(np.fft.ifftshift(np.sort(frequency)), np.fft.ifftshift(np.sort(frequency)))
    for i, wave in enumerate(d["wavelength_nm"]):
        want = diffraction_mtf(np.hypot(fx, fy) * 1e-3, wave, float(d["fnumber"]))
        np.testing.assert_allclose(d["otf_dc_at_11"][..., i], want, atol=1e-6)  # float32
        largest_difference("transfer function", d["otf_dc_at_11"][..., i], want)


def test_diffraction_psf_to_transfer_function():
    d = reference("c_dl_otf")
    pitch = 1e3 * float(d["psf_dx_mm"])
    lens = DiffractionLimitedLens()
    for i, wave in enumerate(d["wavelength_nm"]):
        psf = lens.psf([float(wave)], pitch_um=pitch, size=1024).values[0]
        # of 1024 samples, every eighth frequency is one of ISETCam's
        got = np.abs(np.fft.fft2(psf))[::8, ::8]
        # 0.3 % to 0.5 % of the light lies beyond 128 um
        assert np.abs(got - d["otf_dc_at_11"][..., i]).max() < 6e-3


@pytest.mark.parametrize("domain", ["psf", "pupil"])
def test_zernike_point_spread(domain, largest_difference):
    d = reference("d_wvf_zernike")
    for w, wave in enumerate(d["wave_nm"]):
        for z in range(3):
            amplitude = d[f"pupil_amp_{domain}"][:, :, w, z]
            opd = d[f"wavefront_um_{domain}"][:, :, w, z]
            plane_mm = float(d[f"pupil_plane_mm_{domain}"][w, z])
            # ISETCam's transform has 201 samples, so the pitch is wavelength x focal length /
            # plane.
            pitch_um = float(wave) * 1e-3 * 8.0 / plane_mm
            got = psf_from_pupil(
                amplitude.astype(float), opd, float(wave), plane_mm / 201, 8.0, pitch_um, 129
            )
            want = d[f"psf_{domain}"][:, :, w, z]
            assert largest_difference("point spread", got, want) < 1e-6, (domain, w, z)


@pytest.mark.parametrize("domain", ["psf", "pupil"])
def test_zernike_wavefront(domain, largest_difference):
    d = reference("d_wvf_zernike")
    for w in range(3):
        for z in range(3):
            inside = d[f"pupil_amp_{domain}"][:, :, w, z] > 0
            if not inside.any() or not d["zcoeffs"][:, z].any():
                continue
            axis = (
                (np.arange(201) - 100)
                * float(d[f"pupil_plane_mm_{domain}"][w, z])
                / 201
                / (float(d["pupil_diameter_mm"]) / 2)
            )
            # y points up in the OSA standard
            got = wavefront_um({j: c for j, c in enumerate(d["zcoeffs"][:, z]) if c}, axis, -axis)
            want = d[f"wavefront_um_{domain}"][:, :, w, z]
            # 2e-6: float32, and ISETCam's pi of 3.1416 in one domain
            assert largest_difference("wavefront", got[inside], want[inside]) < 2e-6


def test_optical_image_of_points(largest_difference):
    d = reference("c_oi_pointarray")
    lens = DiffractionLimitedLens(
        f_number=float(d["fnumber"]),
        focal_length_mm=1e3 * float(d["focal_length_m"]),
        object_distance_m=float(d["scene_distance_m"]),
        falloff="none",
    )
    wave, radiance, want = (
        d["wave"].astype(float),
        *(d[k].astype(float).transpose(2, 0, 1) for k in ("scene_photons", "oi_photons")),
    )
    got = optical_image(
        lens, radiance, wave, float(d["oi_hfov_deg"]), 1e6 * float(d["dist_per_deg_m"])
    )
    assert largest_difference("image of points", got, want) < 3e-7  # float32 input and output
    # The lens here convolves without wrapping and averages over source and receiving tiles.
    # ISETCam's image with the same averaging differs only by light that wraps around the border.
    pitch_um = float(d["oi_sample_um"][0])
    x = quantities.centres(64, 64 * pitch_um * 1e-3 / lens.focal_length_mm)
    ours = lens(quantities.plane(radiance, wave, x, x, quantities.RADIANCE)).values
    tile = np.sinc(np.fft.fftfreq(80)) ** 2
    theirs = np.fft.ifft2(np.fft.fft2(want) * tile[:, None] * tile).real[:, 8:-8, 8:-8]
    inside = (slice(None), slice(16, -16), slice(16, -16))
    difference = np.abs(ours - theirs)[inside]
    # measured: 8e-4 and 0.011
    assert difference.max() < 2e-3 * theirs.max() and difference.sum() < 0.02 * theirs[inside].sum()
