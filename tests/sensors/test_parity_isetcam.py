"""ISETCam's own numbers: noise-free volts by its spatial rule, and its noise statistics by our sensor."""

import os
from pathlib import Path

import numpy as np
import pytest
from isethdr_sensors import BayerSensor
from isethdr_sensors.isetcam_parity import noise_mean_and_variance, pixel_rate, volts
from isethdr_sensors.shot import readings
from numpy.testing import assert_allclose

from isethdr_core.seeds import generator

FOLDER = Path(os.environ.get("ISETHDR_REFERENCE", "")) / "isetcam"
pytestmark = pytest.mark.skipif("ISETHDR_REFERENCE" not in os.environ, reason="ISETHDR_REFERENCE is not set")


def load(name):
    path = FOLDER / name
    if not path.exists():
        pytest.skip(f"{name} is not in the reference folder")
    return np.load(path)


@pytest.mark.parametrize("name", ["default", "ovt_LPDLCG", "ovt_LPDHCG", "ovt_SPDLCG"])
def test_noise_free_volts(name):
    data, light = load(f"e_nf_{name}.npz"), load("e_input_irradiance.npz")
    rows, columns = data["size"].astype(int)
    filters = np.tile(data["cfa_pattern"].astype(int) - 1, (rows // 2, columns // 2))
    rate = pixel_rate(light["oi_photons"], data["spectral_qe"], 10.0, light["oi_sample_um"][0], data["pixel_size_m"][0] * 1e6, filters)
    found = volts(rate, float(data["exp_time_s"]), float(data["pd_area_m2"]), float(data["conversion_gain_v_per_e"]),
                  float(data["voltage_swing"]), float(data["analog_gain"]), float(data["analog_offset"]))
    # ISETCam stores the irradiance and the volts as float32
    assert_allclose(found, data["volts"], rtol=0, atol=3e-7 * data["volts"].max())


def unclipped(data):
    """Yield (level, filter, flag 2 mean, flag 2 variance, flag 0 mean) of cells that neither end of the scale touches."""
    for level in range(6):
        for k in range(3):
            if max(data["frac_at_zero"][k, level, 2], data["frac_at_swing"][k, level, 2]) < 1e-6:
                yield level, k, data["mean_volts"][k, level, 2], data["var_volts"][k, level, 2], data["mean_volts"][k, level, 0]


def test_noise_free_means_of_uniform_fields():
    data = load("e_noise_default.npz")
    scale = data["exp_time_s"] * data["pd_area_m2"] * data["conversion_gain_v_per_e"]
    want = np.minimum(10.0 * data["spectral_qe"].T @ data["irradiance"] * scale, data["voltage_swing"])
    assert_allclose(data["mean_volts"][..., 0], want, rtol=1e-6)  # float32


def test_noise_statistics():
    data = load("e_noise_default.npz")
    gain, dark_e = float(data["conversion_gain_v_per_e"]), float(data["dark_voltage_v_per_s"] * data["exp_time_s"] / data["conversion_gain_v_per_e"])
    cells = list(unclipped(data))
    assert len(cells) >= 4
    for level, k, mean, variance, clean in cells:
        want_mean, want = noise_mean_and_variance(clean / gain, dark_e, gain, float(data["read_noise_v"]), 0.01, float(data["dsnu_v"]))
        n = float(data["n"][k, level, 2])
        assert_allclose(mean, want_mean, atol=5 * np.sqrt(variance / n))  # 5 standard errors
        assert_allclose(variance, want, rtol=5 * np.sqrt(2 / n))


def test_our_sensor_has_the_same_statistics():
    data = load("e_noise_default.npz")
    gain = float(data["conversion_gain_v_per_e"])
    sensor = BayerSensor(exposure_s=float(data["exp_time_s"]), bits=0, full_well_e=1e9, swing_v=1e9, conversion_gain_uv_per_e=gain * 1e6,
                         read_noise_e=float(data["read_noise_v"]) / gain, dsnu_e=float(data["dsnu_v"]) / gain, prnu=0.01, column_e=0.0,
                         dark_e_per_s=float(data["dark_voltage_v_per_s"]) / gain, dark_spread=0.0)
    for level, k, mean, variance, clean in unclipped(data):
        found = readings(sensor.model(), [np.full((256, 256), clean / gain)], generator(level))[0] * gain
        n = float(data["n"][k, level, 2])
        # two samples' standard errors; 2e-4 for ISETCam's PRNU, which multiplies noise too
        assert_allclose(found.mean(), mean, atol=5 * np.sqrt(variance * (1 / n + 1 / 65536)))
        assert_allclose(found.var(), variance, rtol=5 * np.sqrt(2 / n + 2 / 65536) + 2e-4)
