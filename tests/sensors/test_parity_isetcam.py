"""Results of ISETCam: its spatial rule gives its noise-free volts, and the sensor of isethdr has
the same noise statistics.
"""

import os
from pathlib import Path

import numpy as np
import pytest
from isethdr_sensors import BayerSensor
from isethdr_sensors.readout.shot import readings
from isethdr_sensors.sampling.isetcam_parity import (
    VoltageNoise,
    VoltageReadout,
    clipped_noise,
    noise_mean_and_variance,
    pixel_rate,
    volts,
)
from numpy.testing import assert_allclose

from isethdr_core.seeds import generator

FOLDER = Path(os.environ.get("ISETHDR_REFERENCE", "")) / "isetcam"
pytestmark = pytest.mark.skipif(
    "ISETHDR_REFERENCE" not in os.environ, reason="ISETHDR_REFERENCE is not set"
)


def load(name):
    path = FOLDER / name
    if not path.exists():
        pytest.skip(f"{name} is not in the reference folder")
    return np.load(path)


@pytest.mark.parametrize("name", ["default", "ovt_LPDLCG", "ovt_LPDHCG", "ovt_SPDLCG"])
def test_noise_free_volts(name, largest_difference):
    data = load(f"e_nf_{name}.npz")
    light = load("e_input_irradiance.npz")
    rows, columns = data["size"].astype(int)
    filters = np.tile(data["cfa_pattern"].astype(int) - 1, (rows // 2, columns // 2))
    rate = pixel_rate(
        light["oi_photons"],
        data["spectral_qe"],
        10.0,
        light["oi_sample_um"][0],
        data["pixel_size_m"][0] * 1e6,
        filters,
    )
    found = volts(
        rate,
        float(data["exp_time_s"]),
        float(data["pd_area_m2"]),
        VoltageReadout(
            float(data["conversion_gain_v_per_e"]),
            float(data["voltage_swing"]),
            float(data["analog_gain"]),
            float(data["analog_offset"]),
        ),
    )
    # ISETCam stores the irradiance and the volts as float32
    assert largest_difference("volts", found, data["volts"]) < 3e-7


def cells(data, flag):
    """Yield for each of the 18 cells: level, filter, the statistics that ISETCam found with noise
    flag `flag`, and the statistics that its rules predict for the same electrons.
    """
    gain = float(data["conversion_gain_v_per_e"])
    flag_2 = float(flag == 2)
    dark_e = flag_2 * float(data["dark_voltage_v_per_s"] * data["exp_time_s"]) / gain
    readout = VoltageReadout(gain, float(data["voltage_swing"]))
    noise = VoltageNoise(
        flag_2 * float(data["read_noise_v"]), flag_2 * 0.01, flag_2 * float(data["dsnu_v"])
    )
    for level, k in np.ndindex(6, 3):
        found = {
            name: float(data[name][k, level, flag])
            for name in ("mean_volts", "var_volts", "frac_at_zero", "frac_at_swing", "n")
        }
        electrons = float(data["mean_volts"][k, level, 0]) / gain  # flag 0 clips nowhere
        yield (
            level,
            k,
            found,
            clipped_noise(electrons, dark_e, readout, noise),
        )


def errors_of(want, n):
    """Return the standard errors of the mean and of the variance of `n` draws; that of the variance
    follows from the fourth moment.
    """
    return np.sqrt(want.variance_v2 / n), np.sqrt((want.fourth_v4 - want.variance_v2**2) / n)


def test_noise_free_means_of_uniform_fields():
    data = load("e_noise_default.npz")
    scale = data["exp_time_s"] * data["pd_area_m2"] * data["conversion_gain_v_per_e"]
    want = np.minimum(
        10.0 * data["spectral_qe"].T @ data["irradiance"] * scale, data["voltage_swing"]
    )
    assert_allclose(data["mean_volts"][..., 0], want, rtol=1e-6)  # float32


@pytest.mark.parametrize("flag", [1, 2])
def test_noise_statistics_of_all_cells(flag, record_property):
    """For each noise flag, compare mean, variance, and the shares clipped at 0 and at the swing in
    18 cells. Most cells are clipped at 0, and one at the swing.
    """
    data = load("e_noise_default.npz")
    clipped = 0
    off = []
    for _, _, found, want in cells(data, flag):
        of_mean, of_variance = errors_of(want, found["n"])
        # 5 standard errors; 3e-8 V: rounding of float32 volts up to 1 V
        assert_allclose(found["mean_volts"], want.mean_v, rtol=0, atol=5 * of_mean + 3e-8)
        assert_allclose(found["var_volts"], want.variance_v2, rtol=0, atol=5 * of_variance)
        off.append(abs(found["mean_volts"] - want.mean_v) / (of_mean + 3e-8))
        off.append(abs(found["var_volts"] - want.variance_v2) / of_variance)
        for name, share in (("frac_at_zero", want.at_zero), ("frac_at_swing", want.at_swing)):
            # 5 binomial standard errors, plus one draw for shares near 0
            assert_allclose(
                found[name],
                share,
                rtol=0,
                atol=5 * np.sqrt(share * (1 - share) / found["n"]) + 1 / found["n"],
            )
        clipped += max(found["frac_at_zero"], found["frac_at_swing"]) > 1e-6
    assert clipped >= 9
    record_property("noise of ISETCam", float(max(off)))


def test_clipping_is_left_alone_where_it_does_not_reach():
    noise = VoltageNoise(1e-3, 0.01, 1e-3)
    mean, variance = noise_mean_and_variance(1000.0, 2.0, 1e-4, noise)
    found = clipped_noise(1000.0, 2.0, VoltageReadout(1e-4, 1.0), noise)
    # 1.2e-4: rounding the count to whole electrons adds 1/12 e2 to a variance of 1000 e2
    assert_allclose([found.mean_v, found.variance_v2], [mean, variance], rtol=1.2e-4)
    assert (
        found.at_zero < 1e-12
        and found.at_swing == 0
        and abs(found.fourth_v4 / variance**2 - 3) < 1e-2
    )


def test_our_sensor_has_the_same_statistics(record_property):
    """With shots clipped as ISETCam clips, mean and variance of all 18 cells agree within the
    standard errors of both samples. The sensor of isethdr draws exact Poisson counts, and its PRNU
    acts on the light alone.
    """
    data = load("e_noise_default.npz")
    gain = float(data["conversion_gain_v_per_e"])
    n_ours = 65536
    sensor = BayerSensor(
        exposure_s=float(data["exp_time_s"]),
        bits=0,
        full_well_e=1e9,
        swing_v=1e9,
        conversion_gain_uv_per_e=gain * 1e6,
        read_noise_e=float(data["read_noise_v"]) / gain,
        dsnu_e=float(data["dsnu_v"]) / gain,
        prnu=0.01,
        column_e=0.0,
        dark_e_per_s=float(data["dark_voltage_v_per_s"]) / gain,
        dark_spread=0.0,
    )
    off = []
    for level, k, theirs, want in cells(data, 2):
        clean = float(data["mean_volts"][k, level, 0])
        ours = np.clip(
            readings(sensor.model(), [np.full((256, 256), clean / gain)], generator(level))[0]
            * gain,
            0,
            float(data["voltage_swing"]),
        )
        of_mean, of_variance = errors_of(want, 1 / (1 / theirs["n"] + 1 / n_ours))
        assert_allclose(
            ours.mean(dtype=float), theirs["mean_volts"], rtol=0, atol=5 * of_mean + 3e-8
        )
        # 2e-4: in ISETCam the PRNU multiplies the noise too. Its normal counts are rounded, which
        # adds 1e-3 below 25 e and 1e-4 above
        assert_allclose(ours.var(dtype=float), theirs["var_volts"], rtol=2e-4, atol=5 * of_variance)
        off.append(abs(ours.mean(dtype=float) - theirs["mean_volts"]) / (of_mean + 3e-8))
        off.append(abs(ours.var(dtype=float) - theirs["var_volts"]) / of_variance)
    record_property("noise of our sensor", float(max(off)))
