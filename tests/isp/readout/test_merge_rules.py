"""Merge rules by name, the source of each pixel, companded captures, and extreme pictures:
saturated, dark, one pixel.
"""

import numpy as np
import pytest
from isethdr_isp import IdealIsp, LinearIsp, MergeIsp
from isethdr_isp.merge import charges
from isethdr_isp.readout.merge_rules import RULES
from isethdr_isp.spectra import light

from isethdr_core.errors import UnitError
from isethdr_core.truth import total_variance, variance_known

MONO = np.array([[0]])


def merged(bench, rule, level, seed=0, side=200):
    captures = bench.make(
        np.full((side, side), float(level)),
        bench.SPLIT,
        MONO,
        bench.QE[:1],
        np.random.default_rng(seed),
        dark=5.0,
    )
    return RULES[rule](*charges(captures, "daylight"))


@pytest.mark.parametrize("rule", RULES)
@pytest.mark.parametrize("level", [10, 2000, 10000, 1e5])
def test_every_rule_is_absolute_and_reports_its_own_variance(bench, rule, level):
    out = merged(bench, rule, level)
    se = out.signal_e.std() / 200
    assert abs(out.signal_e.mean() - level) < max(5e-3 * level, 4 * se)
    # 3 %: 4 standard errors of 0.7 % from 40 000 pixels; the variance includes the shot noise that
    # two readings share
    assert out.variance_e2.mean() / out.signal_e.var() == pytest.approx(1, abs=0.03)
    assert out.valid.all()


def test_rules_differ_where_they_should(bench):
    noise = {rule: merged(bench, rule, 3).signal_e.var() for rule in RULES}
    # two readings of one charge, with read noise 3.05 and 0.83 e: weighted by 1 / variance; their
    # mean; and the low gain alone
    assert noise["inverse_variance"] == pytest.approx(3 + 5 + 1 / (3.05**-2 + 0.83**-2), rel=0.05)
    assert noise["average"] == pytest.approx(3 + 5 + (3.05**2 + 0.83**2) / 4, rel=0.05)
    assert noise["isetcam"] == pytest.approx(3 + 5 + 3.05**2, rel=0.05)


@pytest.mark.parametrize("rule", RULES)
def test_source_is_the_capture_that_weighs_most(bench, rule):
    mean = np.repeat(np.array([50.0, 10000.0, 1e5])[None], 12, 0).repeat(8, 1)
    picture = MergeIsp(rule=rule)(bench.make(mean, bench.SPLIT))
    source = picture["source"].values
    assert source.dtype == np.uint8 and picture["source"].dims == ("y", "x")
    dark = 0 if rule == "isetcam" else 1  # ISETCam's rule never uses the higher gain
    assert (
        (source[:, :8] == dark).all()
        and (source[:, 8:16] == 0).all()
        and (source[:, 16:] == 2).all()
    )
    turned = MergeIsp(rule=rule)(bench.make(mean, [bench.SPLIT[k] for k in (2, 0, 1)]))[
        "source"
    ].values
    # sources are numbered in the order of the captures
    np.testing.assert_array_equal(np.array([1, 2, 0])[source], turned)


def companded(captures, knees):
    """Return captures with raw values companded along `knees` (linear, code) and rounded."""
    linear, code = (np.array(v, float) for v in zip(*knees))
    pad = np.full(1, np.nan)  # tables of different length end in NaN
    out = captures.copy()
    out["raw"] = captures["raw"].dims, np.rint(np.interp(captures["raw"].values, linear, code))
    n = captures.sizes["capture"]
    out["companding_dn"] = (("capture", "entry"), np.tile(np.r_[code, pad], (n, 1)))
    out["companding_linear_dn"] = (("capture", "entry"), np.tile(np.r_[linear, pad], (n, 1)))
    return out


def test_companded_captures_keep_level_and_variance(bench):
    knees = [(0, 0), (512, 512), (4096, 960), (65536, 4095)]
    spec = [{"name": "A", "charge": 0, "top_e": 60000.0, "read": 2.0}]
    for level in (50, 1000, 40000):
        mean = np.full((300, 300), float(level))
        # linear steps of 1 e; companded ones of 1, 8 and 19.6 e
        captures = bench.make(
            mean, spec, MONO, bench.QE[:1], np.random.default_rng(level), step_e=1.0
        )
        out = RULES["inverse_variance"](*charges(companded(captures, knees), "daylight"))
        assert abs(out.signal_e.mean() - level) < 4 * out.signal_e.std() / 300 + 0.02
        # 90 000 pixels: one standard error is 0.5 %
        assert out.variance_e2.mean() / out.signal_e.var() == pytest.approx(1, abs=0.03)
    # steps that are wide compared with shot noise must be part of the variance
    coarse = [(0, 0), (65536, 400)]
    out = RULES["inverse_variance"](
        *charges(companded(captures.assign(raw=captures["raw"] * 0 + 164.0), coarse), "daylight")
    )
    assert out.variance_e2.mean() == pytest.approx(100 + 4 + 163.84**2 / 12, rel=0.15)


def test_companding_tables_that_cannot_be_inverted_are_refused(bench):
    good = companded(bench.make(np.full((8, 8), 50.0)), [(0, 0), (512, 512), (65536, 4095)])
    with pytest.raises(UnitError, match="alone"):
        LinearIsp()(good.drop_vars("companding_dn"))
    bad = good.copy(deep=True)
    bad["companding_dn"][0, 1] = 0.0
    with pytest.raises(UnitError, match="does not rise"):
        LinearIsp()(bad)


@pytest.mark.parametrize(
    "isp",
    [LinearIsp(), MergeIsp(), *(MergeIsp(rule=r) for r in RULES), MergeIsp(demosaic="guided")],
)
def test_all_saturated_and_all_dark_are_finite_and_told_apart(bench, isp):
    white = isp(bench.make(np.full((12, 16), 1e12), bench.SPLIT))
    assert not white.valid.values.any() and np.isfinite(white.xyz.values).all()
    if variance_known(white):
        assert np.isfinite(total_variance(white).values).all()
    dark = isp(bench.make(np.zeros((12, 16)), bench.SPLIT, rng=np.random.default_rng(0)))
    assert dark.valid.values.all() and (
        not variance_known(dark) or (dark.variance.values > 0).all()
    )
    y = dark.xyz.values[..., 1]
    assert y.min() < 0 and abs(y.mean()) < 4 * y.std() / np.sqrt(y.size / 9)


@pytest.mark.parametrize("isp", [LinearIsp(), MergeIsp(), IdealIsp()])
def test_a_single_pixel_without_filters_is_a_picture_and_with_them_an_error(bench, isp):
    grey = 7 * light("daylight", bench.WAVELENGTH)
    qe = bench.QE_W[3:]
    picture = isp(bench.make(bench.mosaic_of(grey, (1, 1), MONO, qe), pattern=MONO, qe=qe))
    assert picture.xyz.values[0, 0, 1] == pytest.approx(7, rel=1e-9)
    with pytest.raises(UnitError, match="is not sampled|samples only one"):
        isp(bench.make(np.ones((1, 1))))


@pytest.mark.parametrize(
    ("name", "value", "said"),
    [
        ("gain_dn_per_e", 0.0, "gain_dn_per_e"),
        ("gain_dn_per_e", np.nan, "gain_dn_per_e"),
        ("exposure_s", -1.0, "exposure_s"),
        ("read_noise_e", -2.0, "read_noise_e"),
        ("quantisation_e", np.nan, "quantisation_e"),
        ("top_dn", 3.0, "above the black level"),
    ],
)
def test_values_that_no_sensor_has_are_refused(bench, name, value, said):
    bad = bench.make(np.full((8, 8), 50.0)).copy(deep=True)
    bad[name][0] = value
    for isp in (LinearIsp(), MergeIsp(), IdealIsp()):
        with pytest.raises(UnitError, match=said):
            isp(bad)


def test_a_filter_index_beyond_the_channels_is_refused(bench):
    bad = bench.make(np.full((8, 8), 50.0)).copy(deep=True)
    bad["filter"][3, 3] = 7
    with pytest.raises(UnitError, match=r"channel 7; expected 0\.\.2"):
        LinearIsp()(bad)
