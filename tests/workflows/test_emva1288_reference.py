"""The open reference implementation of the standard (`pip install emva1288`), if installed, finds
the same figures from the same pictures.
"""

import numpy as np
import pytest
from isethdr_workflows.emva1288 import estimates as find
from isethdr_workflows.emva1288.camera import BORDER, Bench, Pair, Stack
from isethdr_workflows.emva1288.study import chosen

SIDE = 128 - 2 * BORDER
STACK = 16


@pytest.fixture
def reference(monkeypatch):
    """Return (data class, results class, function that sums pictures) of the package. The package
    calls `np.asfarray`, which numpy 2 no longer has, so the fixture adds it.
    """
    monkeypatch.setattr(np, "asfarray", lambda a: np.asarray(a, float), raising=False)
    pytest.importorskip(
        "emva1288", reason="the reference implementation of EMVA 1288 is not installed"
    )
    from emva1288.process import routines
    from emva1288.process.data import Data1288
    from emva1288.process.results import Results1288

    return Data1288, Results1288, routines.get_int_imgs


def pictures(bench, photons, count):
    """Return `count` pictures of one level in whole codes, as the loader of the package returns
    them.
    """
    return [bench.shot(photons, k)[0].reshape(SIDE, SIDE).astype(np.int64) for k in range(count)]


def test_gain_quantum_efficiency_noise_and_patterns_agree(reference):
    data_of, results_of, summed = reference
    sensor = chosen("single")
    bench = Bench(sensor, 0, 0, 540.0, 128, 3)
    top = 25455.0 / bench.efficiency()
    levels = [share * top for share in (0.0, *np.linspace(0.02, 1.05, 45))]
    pairs = {level: pictures(bench, level, 2) for level in levels}
    stacks = {level: pictures(bench, level, STACK) for level in (0.0, 0.5 * top)}

    temporal = {
        level: {k: np.sum(v) if k != "dmean" else v for k, v in summed(images).items()}
        for level, images in pairs.items()
    }
    spatial = {level: summed(images) for level, images in stacks.items()}
    theirs = results_of(
        data_of(
            {
                "width": SIDE,
                "height": SIDE,
                "temporal": {0.016: temporal},
                "spatial": {0.016: spatial},
            }
        ).data
    )

    ours = [
        Pair(level, float(np.mean(a + b) / 2), float(np.var(a - b, ddof=1) / 2), 0.0, SIDE**2)
        for level, (a, b) in pairs.items()
    ]
    dark, unlit, half = ours[0], *(stack_of(images) for images in stacks.values())
    gain, responsivity = find.gain_and_responsivity(ours[1:], dark, True)
    efficiency = find.quantum_efficiency(gain, responsivity)
    noise = find.dark_noise_e(dark, gain, True)
    prnu = find.prnu_percent(half, unlit)

    # the reference gives all levels equal weights, so its line is a little less certain: 6 standard
    # errors of isethdr, or 2 %
    for found, true in (
        (theirs.K, 4031 / 25455),
        (theirs.QE / 100, bench.efficiency()),
        (theirs.sigma_d, np.hypot(9.1, np.sqrt(9.1 * 0.016))),
    ):
        assert found == pytest.approx(true, rel=0.02)
    assert theirs.K == pytest.approx(
        gain.value, abs=6 * gain.error
    ) and theirs.QE / 100 == pytest.approx(efficiency.value, abs=6 * efficiency.error)
    # one is a mean of squares and the other a variance, so they differ by 1 / pixels
    assert theirs.sigma_d * theirs.K == pytest.approx(noise.value * gain.value, rel=1e-3)
    # the same formula on the same pictures
    assert theirs.PRNU1288 == pytest.approx(prnu.value, rel=1e-9)
    assert theirs.s_2_y_dark == pytest.approx(find.spatial(unlit).value, abs=1e-9)


def stack_of(images) -> Stack:
    """Return the stack of these pictures, as `isethdr_workflows.emva1288.camera.stack` makes it."""
    temporal = float(np.mean(np.var(images, axis=0, ddof=1)))
    return Stack(
        np.mean(images, axis=0).ravel(), temporal / len(images), images[0].size, len(images)
    )
