"""Readout: codes of any converter are read back to the electrons within half a step, or marked as
saturated.
"""

from __future__ import annotations

import numpy as np
from hypothesis import given, settings
from hypothesis import strategies as st
from isethdr_isp.readout.electrons import readouts
from isethdr_measured.stability.inputs import irradiance
from isethdr_sensors import SingleSensor

GREEN = np.array([550.0])


@settings(max_examples=20, deadline=None, derandomize=True, database=None)
@given(
    bits=st.integers(4, 24),
    black=st.floats(0, 7),
    well=st.floats(10, 1e6),
    conversion=st.floats(1, 1000),
    share=st.lists(st.floats(0, 2), min_size=2, max_size=8),
)
def test_electrons_come_back(bits, black, well, conversion, share):
    sensor = SingleSensor(
        noise=False,
        dark_spread=0.0,
        prnu=0.0,
        column_e=0.0,
        bits=bits,
        black_dn=black,
        full_well_e=well,
        conversion_gain_uv_per_e=conversion,
        swing_v=well * conversion * 1e-6,
        pitch_um=3.0,
    )
    per_w = float(
        (
            sensor.expected(irradiance(np.ones((1, 2, 2)), GREEN))
            - sensor.expected(irradiance(np.zeros((1, 2, 2)), GREEN))
        ).max()
    )
    light = irradiance(np.array(share)[None, None, :] * well / per_w * np.ones((1, 2, 1)), GREEN)
    shot = sensor(light, None)
    [read] = readouts(shot, np.ones(1))
    truth = sensor.expected(light).values[0]
    step = float(shot.quantisation_e.values[0])
    ok = ~read.saturated
    # float64 codes up to 2^24: 1e-9 of the swing is far above rounding
    assert np.all(np.abs(read.charge_e - truth)[ok] <= step / 2 + 1e-9 * well)
    assert np.all(truth[ok] <= well + step)
    assert np.all(read.saturated[truth >= well])
