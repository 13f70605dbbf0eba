"""Reused results of earlier runs are identical to computed ones."""

import shutil
import time
from collections import Counter
from dataclasses import dataclass, replace
from types import SimpleNamespace

import numpy as np
import pytest
from isethdr_isp.linear import LinearIsp
from isethdr_sensors.bayer import BayerSensor

import isethdr_core as hdr
from isethdr_core.errors import ConfigError
from isethdr_core.pipeline.demand import Response
from isethdr_core.runs import result_names, reuse
from isethdr_core.storage.bounded_cache import entries
from isethdr_core.storage.manifest import read_manifest

CALLS: Counter = Counter()


@dataclass(frozen=True)
class CountingSensor(BayerSensor):
    """Sensor: counts its shots."""

    def __call__(self, irradiance, generator):
        CALLS["sensor"] += 1
        return super().__call__(irradiance, generator)


@dataclass(frozen=True)
class SlowIsp(LinearIsp):
    """Isp: counts its pictures; each takes so long that keeping it is worth the space."""

    def __call__(self, captures):
        CALLS["isp"] += 1
        end = time.process_time() + 0.01
        while time.process_time() < end:
            pass
        return super().__call__(captures)


@dataclass(frozen=True)
class Mean:
    """Metric: mean luminance."""

    power: float = 1.0

    def __call__(self, picture, truth, labels):
        CALLS["metric"] += 1
        value = float((picture["xyz"][..., 1] ** self.power).mean())
        name = f"mean_power_{self.power:g}"
        return [hdr.Score(name, value, "cd/m2", low=0.9 * value, high=1.1 * value)]


SMALL = [
    "experiment=five_lights",
    "scene=macbeth",
    "scene.width=48",
    "scene.height=32",
    "~flare.dirt",
    *(f"~metric.{name}" for name in "shares dynamic_range snr ssim log_luminance".split()),
    *("~metric.contrast", "~metric.detection"),
    "+metric@metric.mean=mean",
    "lens=ideal",
    "lens.focal_length_mm=0.25",
    "sensor=counting",
    "sensor.rows=24",
    "sensor.columns=36",
    "isp=slow",
    "report=false",
]


@pytest.fixture(autouse=True)
def components(offer):
    offer("sensor", "counting", CountingSensor)
    offer("isp", "slow", SlowIsp)
    offer("metric", "mean", Mean)
    CALLS.clear()


def run(*overrides):
    return hdr.run(hdr.compose([*SMALL, *overrides]))


def calls(*overrides):
    """Return how often the components were called in a run."""
    CALLS.clear()
    assert run(*overrides).computed
    return dict(CALLS)


def arrays(result):
    """Return the checksums of all files of a run except its record."""
    files = read_manifest(result.path).files
    return {name: record for name, record in files.items() if name != "zarr.json"}


def stated(result):
    """Return what the rows of the ledger state, apart from seconds and memory."""
    return [
        (row.stage, [(t.identity(), t.value) for t in row.errors], row.left_out)
        for row in result.ledger
    ]


def assert_same(one, other):
    assert repr(one.scores) == repr(other.scores)
    assert arrays(one) == arrays(other)
    assert stated(one) == stated(other)
    assert one.warnings == other.warnings and one.key == other.key


def forget_runs(home):
    shutil.rmtree(home / "runs")


def test_a_run_has_the_same_bytes_with_an_empty_cache_a_full_a_damaged_one_and_none(isethdr_home):
    without = run("draws=2", "cache_gb=0")
    assert not (isethdr_home / reuse.FOLDER).exists()
    assert not any(row.reused for row in without.ledger)
    kept_apart = isethdr_home.rename(isethdr_home.with_name("without"))
    without.path = kept_apart / "runs" / without.path.name
    first = run("draws=2")
    forget_runs(isethdr_home)
    CALLS.clear()
    again = run("draws=2")
    assert not CALLS  # sensor, isp and metric are not called
    kinds = {row.kind for row in again.ledger if row.reused}
    assert kinds == {"lighting", "lens", "sensor", "isp", "metric"}
    seconds = {row.stage: row.seconds for row in first.ledger}
    assert all(row.seconds == seconds[row.stage] for row in again.ledger if row.reused)
    for other in (first, again):
        assert_same(without, other)
    for entry in entries(isethdr_home / reuse.FOLDER):  # damaged entries are not used
        data = bytearray(entry.path.read_bytes())
        data[len(data) // 2] ^= 1
        entry.path.write_bytes(data)
    forget_runs(isethdr_home)
    damaged = run("draws=2")
    assert not any(row.reused for row in damaged.ledger)
    assert_same(without, damaged)


def test_more_realisations_make_only_those_that_are_new():
    assert calls("draws=2") == {"sensor": 2, "isp": 2, "metric": 2}
    assert calls("draws=3") == {"sensor": 1, "isp": 1, "metric": 1}


def test_another_isp_reads_captures_and_another_metric_reads_pictures():
    run("draws=2")
    assert calls("draws=2", "isp.demosaic=malvar") == {"isp": 2, "metric": 2}
    assert calls("draws=2", "+metric@metric.other=mean", "metric.other.power=2") == {"metric": 2}


def test_results_that_are_computed_together_are_kept_one_by_one(tmp_path, monkeypatch):
    monkeypatch.setenv("ISETHDR_HOME", str(tmp_path))
    keeping = reuse.Reuse.below(10**6)
    asked = []

    def squares(places):
        asked.append(places)
        return [float(place**2) for place in places]

    assert keeping.values(["a", None], squares) == [0.0, 1.0]
    assert keeping.values(["a", None, "c"], squares) == [0.0, 1.0, 4.0]
    assert keeping.values(["c", "a"], squares) == [4.0, 0.0]
    assert asked == [[0, 1], [1, 2]]
    assert reuse.NOTHING_KEPT.values(["a"], squares) == [0.0]


def test_light_is_named_by_the_pixels_for_which_it_was_planned():
    """A lens compares the blur of near objects with a pixel. With four times the area and a quarter
    of the exposure, two sensors differ in nothing else.
    """
    chain = SimpleNamespace(
        cameras={"one": hdr.build("sensor", "ideal")},
        lens=hdr.build("lens", "ideal"),
        flares={},
        leave_out=True,
    )
    mixed = SimpleNamespace(wavelength=SimpleNamespace(values=np.array([500.0, 510.0])))
    small = Response(("W",), lambda nm: np.ones((1, len(nm))), 1e-13, 2.0, pixel_m=2e-6)
    demands = [hdr.Demand(response=r) for r in (small, replace(small, pixel_m=4e-6))]
    one, other = (result_names.of_light("mixed", chain, demand, mixed) for demand in demands)
    assert one is not None and one != other


@pytest.mark.slow
def test_names_that_a_user_chose_are_those_of_the_run():
    first = run("draws=1")
    second = run("~metric.colour", "+metric@metric.own=ciede2000", "draws=1")
    assert [row.stage for row in second.ledger if row.reused and row.kind == "metric"] == [
        "metric mean counting",
        "metric own counting",
    ]
    names = {
        str(term.source).partition(":")[0]
        for row in second.ledger
        for term in row.errors
        if row.kind == "metric"
    }
    assert names == {"metric/mean counting", "metric/own counting"}
    assert sorted(map(repr, second.scores)) == sorted(map(repr, first.scores))


def test_unused_cameras_and_the_space_for_results_change_no_name_and_are_in_no_record():
    first = run("draws=1")
    unused = ["cameras.bayer.exposure_s=0.5", "cameras.rgbw=null", "cache_gb=1"]
    second = run("draws=1", *unused)
    assert not second.computed and second.key == first.key
    assert not {"cameras", "cache_gb"} & first.attributes["config"].keys()


@pytest.mark.parametrize("asked", ["-1", ".inf", "true"])
def test_the_space_for_results_is_a_number_of_gigabytes(asked):
    with pytest.raises(ConfigError, match="cache_gb is .*gigabytes.*cache_gb=4"):
        run(f"cache_gb={asked}")
