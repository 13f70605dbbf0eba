"""The conformance kit catches the mistakes it is made for: components with one deliberate fault
each.
"""

from __future__ import annotations

import itertools
import time
from dataclasses import dataclass, field, fields, replace
from types import SimpleNamespace
from typing import Annotated, Literal

import numpy as np
import pytest

from isethdr_core import quantities
from isethdr_core.component import KINDS
from isethdr_core.conformance.inputs import THROUGHPUT_SR
from isethdr_core.conformance.lens import _check_psf
from isethdr_core.conformance.ranges import outside
from isethdr_core.data.scores import Score
from isethdr_core.errors import ConfigError, IsetHdrError, UnitError
from isethdr_core.plugins.protocols import HasPointSpread
from isethdr_core.plugins.ranges import Range
from isethdr_core.plugins.registry import build, components
from isethdr_core.testing import check
from isethdr_core.uncertainty import ledger
from isethdr_core.uncertainty.error_terms import ErrorMaps

COUNTER = itertools.count()  # hidden state, as a careless component has it


def wrapped(kind, name, change):
    """Return a component class like `kind/name` whose result goes through `change(result,
    *arguments)`.
    """
    base = components()[kind, name].cls

    @dataclass(frozen=True)
    class Faulty(base):
        """A component with one fault."""

        def __call__(self, *arguments, **options):
            return change(base.__call__(self, *arguments, **options), *arguments)

    return Faulty


def caught(offer, kind, cls, promise, **fields):
    # pickle looks the class up in its module, so it has to be there
    cls.__qualname__ = cls.__name__
    cls.__module__ = __name__
    globals()[cls.__name__] = cls
    offer(kind, "faulty", cls)
    with pytest.raises(AssertionError, match=promise) as found:
        check(kind, "faulty", **fields)
    assert f"{kind} 'faulty'" in str(found.value)


def brighter(result, *_):
    return result * np.float32(1.1)


def keep(data, values):
    """Return `data` with other values and the same attributes."""
    return data.copy(data=np.asarray(values, data.dtype))


def some_quickly(faults: dict) -> list:
    """Return the names of faults; the quick tests run every third one, the slow tests run all."""
    return [
        name if number % 3 == 0 else pytest.param(name, marks=pytest.mark.slow)
        for number, name in enumerate(faults)
    ]


LENS_FAULTS = {
    "light from nothing": (lambda out, *_: keep(out, out.values + 1e-9), "linear|no light"),
    "hidden state": (
        lambda out, *_: keep(out, out.values * (1 + 1e-3 * (next(COUNTER) % 3))),
        "twice gives the same bits",
    ),
    "normalised": (lambda out, *_: keep(out, out.values / max(out.values.max(), 1e-30)), "linear"),
    "mirrored": (lambda out, *_: keep(out, out.values[:, :, ::-1]), "lands at"),
    "upside down": (lambda out, *_: keep(out, out.values[:, ::-1]), "lands at"),
    "10 % too bright": (lambda out, *_: keep(out, out.values * 1.1), "throughput"),
    "brighter towards the border than it states": (
        lambda out, *_: keep(
            out, out.values * (1 + 1e5 * (out.x.values**2 + out.y.values[:, None] ** 2))
        ),
        "the stated relative illumination",
    ),
    "one tile too bright": (
        lambda out, *_: keep(
            out, out.values * (1 + 0.1 * ((np.arange(32) == 20) & (np.arange(24)[:, None] == 4)))
        ),
        "exceeds the stated light nowhere",
    ),
    "bands mixed": (lambda out, *_: keep(out, out.values * 0.5 + out.values.mean(0) * 0.5), "band"),
    "focal length misstated": (
        lambda out, *_: out.assign_attrs(focal_length_mm=2 * out.attrs["focal_length_mm"]),
        "that focal length and distortion",
    ),
    "other units": (lambda out, *_: out.assign_attrs(units="lx"), "returns irradiance"),
    "throughput missing": (
        lambda out, *_: (out.attrs.pop("throughput_sr"), out)[1],
        "returns irradiance",
    ),
    "the border missing": (
        lambda out, *_: out.isel(x=slice(2, -2)),
        "its light covers field_width and field_height.: it covers",
    ),
    "falloff missing": (
        lambda out, *_: (out.attrs.pop("falloff"), out)[1],
        "falloff of its light is one of .*: None",
    ),
    "falloff unknown": (
        lambda out, *_: out.assign_attrs(falloff="cos3"),
        "falloff of its light is one of .*: 'cos3'",
    ),
}


@pytest.mark.parametrize("fault", LENS_FAULTS)
def test_lens_faults(fault, offer):
    change, promise = LENS_FAULTS[fault]
    caught(offer, "lens", wrapped("lens", "ideal", change), promise)


def test_a_lens_whose_photocurrent_is_not_its_irradiance(offer):
    faulty = wrapped("lens", "ideal", lambda out, *_: out)
    base = components()["lens", "ideal"].cls
    faulty.photocurrent = lambda self, mixed, flares, response: (
        base.photocurrent(self, mixed, flares, response) * np.float32(1.1)
    )
    caught(offer, "lens", faulty, "photocurrent makes the electrons that its irradiance makes")


def planned_with(**faults):
    """Return the class of a lens that works like the ideal lens, apart from its plan: the given
    attributes replace those of the ideal lens's plan.
    """
    ideal = build("lens", "ideal")

    @dataclass(frozen=True)
    class Faulty:
        """A lens with one fault in its plan."""

        def __call__(self, mixed, flares=()):
            return ideal(mixed, flares=flares)

        def plan(self, flares, field, response, budget):
            own = ideal.plan(flares, field, response, budget)
            names = ("terms", "left_out", "image", "light_errors")
            return SimpleNamespace(**({name: getattr(own, name) for name in names} | faults))

    return Faulty


def light_of_plan(change):
    """Return the method `image` of a plan, whose light goes through `change`."""
    return lambda mixed: change(build("lens", "ideal")(mixed))


PLAN_FAULTS = {
    "half the light": (
        {"image": light_of_plan(lambda light: light.copy(data=0.5 * light.values))},
        "its plan makes the light of its call",
    ),
    "no light": ({"image": light_of_plan(lambda light: None)}, "its plan images the field"),
    "fewer bands": (
        {"image": light_of_plan(lambda light: light.isel(wavelength=slice(1, 3)))},
        "its plan makes the light of its call",
    ),
    "a part of the field": (
        {"image": light_of_plan(lambda light: light.isel(x=slice(5, -5)))},
        "its plan makes the light of its call",
    ),
    "no terms": ({"terms": None}, "the sequences `terms`"),
    "terms that are no terms": ({"terms": (0.1,)}, "the sequences `terms`"),
    "errors without channels": (
        {"light_errors": lambda mixed, weights: ErrorMaps(*2 * [np.zeros(mixed.shape[1:])])},
        "light_errors returns ErrorMaps",
    ),
    "errors below 0": (
        {
            "light_errors": lambda mixed, weights: ErrorMaps(
                *2 * [np.full((len(weights), *mixed.shape[1:]), -1.0)]
            )
        },
        "light_errors are 0 or more",
    ),
}


@pytest.mark.parametrize("fault", PLAN_FAULTS)
def test_a_lens_with_a_plan_of_other_light(fault, offer):
    attributes, promise = PLAN_FAULTS[fault]
    caught(offer, "lens", planned_with(**attributes), promise)


def test_a_lens_with_an_outline_of_another_form(offer):
    faulty = planned_with()
    faulty.outline = lambda self, flares, ahead, budget: None
    caught(offer, "lens", faulty, "outline returns an ImagingOutline")


def test_a_lens_with_errors_of_another_shape(offer):
    faulty = wrapped("lens", "ideal", lambda out, *_: out)
    faulty.light_errors = lambda self, mixed, flares, weights, response: (
        np.zeros(mixed.shape[1:]),
        np.zeros(mixed.shape[1:]),
    )
    caught(offer, "lens", faulty, "light_errors returns ErrorMaps")


def test_a_lens_may_be_brighter_off_the_axis_where_it_says_so():
    check("lens", "ideal", falloff={0: 1, 10: 1.3, 30: 1.5})


def test_a_lens_that_changes_its_input(offer):
    def spoil(out, mixed, *_):
        mixed.values[...] = 0.0
        return out

    caught(offer, "lens", wrapped("lens", "ideal", spoil), "does not change its input")


def test_a_lens_that_accepts_anything(offer):
    def forgiving(self, mixed, flares=()):
        clean = mixed
        if "wavelength" in mixed.dims and mixed.sizes.get("x", 0) and "wavelength" in mixed.coords:
            clean = mixed.fillna(0.0)
        return components()["lens", "ideal"].cls.__call__(self, clean, flares=flares)

    faulty = wrapped("lens", "ideal", lambda out, *_: out)
    faulty.__call__ = forgiving
    caught(offer, "lens", faulty, "refuses NaN light")


def _without_cfa(shot):
    shot.attrs.pop("cfa")
    return shot


SENSOR_FAULTS = {
    "noise by order of calls": (
        lambda shot, *_: shot.assign(raw=shot["raw"] + next(COUNTER) % 5),
        "twice gives the same bits",
    ),
    "gain misstated": (
        lambda shot, *_: shot.assign(gain_dn_per_e=shot["gain_dn_per_e"] * 1.2),
        "agrees with expected",
    ),
    "black level misstated": (
        lambda shot, *_: shot.assign(black_dn=shot["black_dn"] - 20),
        "agrees with expected",
    ),
    "auto exposure": (
        lambda shot, *_: shot.assign(raw=shot["raw"] * 0 + shot["raw"] - shot["raw"].mean()),
        "elsewhere in the frame",
    ),
    "no filter curves": (
        lambda shot, *_: shot.drop_vars("quantum_efficiency"),
        "quantum_efficiency",
    ),
    "saturation hidden": (
        lambda shot, *_: shot.assign(saturated=shot["saturated"] & False),
        "blinding light",
    ),
    "read noise stated twice too large": (
        lambda shot, *_: shot.assign(read_noise_e=2 * shot["read_noise_e"]),
        "scatter by the shot noise",
    ),
    "filter map one pixel off": (
        lambda shot, *_: shot.assign(filter=shot["filter"].roll(x=1)),
        "the pattern of the attribute 'cfa'",
    ),
    "filter map one pixel off, no cfa": (
        lambda shot, *_: _without_cfa(shot.assign(filter=shot["filter"].roll(x=1))),
        "expected electrons are",
    ),
    "another lens": (
        lambda shot, *_: shot.assign_attrs(throughput_sr=0.1),
        "'throughput_sr' of the light unchanged",
    ),
    "150 % efficiency": (
        lambda shot, *_: shot.assign(quantum_efficiency=shot["quantum_efficiency"] * 0 + 1.5),
        "0..1",
    ),
    "filter curves at other bands": (
        lambda shot, *_: shot.isel(wavelength=slice(1, None)),
        "at the wavelengths of the light",
    ),
}


def more_light(share):
    """Return a sensor class that counts more electrons than its captures state, in its shots and in
    `expected` alike.
    """
    base = components()["sensor", "bayer"].cls

    @dataclass(frozen=True)
    class Faulty(base):
        """A sensor with an optimistic quantum efficiency."""

        def __call__(self, light, generator):
            return base.__call__(self, keep(light, light.values * (1 + share)), generator)

        def expected(self, light):
            return base.expected(self, keep(light, light.values * (1 + share)))

    return Faulty


def same_read_noise():
    """Return a sensor class whose read noise is the same in every shot, of the right size; its shot
    noise follows the key.
    """
    base = components()["sensor", "bayer"].cls

    @dataclass(frozen=True)
    class Faulty(base):
        """A sensor with frozen read noise."""

        def __call__(self, light, generator):
            shot = base.__call__(replace_read_noise(self), light, generator)
            noise_e = np.random.default_rng(0).normal(0, self.read_noise_e, shot["raw"].shape)
            raw = shot["raw"].values + np.rint(noise_e * float(shot["gain_dn_per_e"][0]))
            raw = np.clip(raw, 0, float(shot["top_dn"].max())).astype(shot["raw"].dtype)
            return shot.assign(
                raw=shot["raw"].copy(data=raw),
                read_noise_e=shot["read_noise_e"] * 0 + self.read_noise_e,
            )

    def replace_read_noise(sensor):
        values = {f.name: getattr(sensor, f.name) for f in fields(base)}
        return base(**values | {"read_noise_e": 0.0})

    return Faulty


def test_a_sensor_that_counts_ten_percent_too_many_electrons(offer):
    caught(
        offer,
        "sensor",
        more_light(0.1),
        "expected electrons are irradiance x photons per joule x quantum_efficiency",
    )


def test_a_sensor_whose_read_noise_ignores_the_key(offer):
    caught(
        offer,
        "sensor",
        same_read_noise(),
        "scatter by the shot noise, read_noise_e and quantisation_e",
    )


def test_a_sensor_whose_expected_electrons_are_labelled_dn(offer):
    base = components()["sensor", "bayer"].cls
    faulty = wrapped("sensor", "bayer", lambda shot, *_: shot)
    faulty.expected = lambda self, light: base.expected(self, light).assign_attrs(units="DN")
    caught(offer, "sensor", faulty, "expected has the units 'e', electrons': it has 'DN'")


@pytest.mark.parametrize("fault", some_quickly(SENSOR_FAULTS))
def test_sensor_faults(fault, offer):
    change, promise = SENSOR_FAULTS[fault]
    caught(offer, "sensor", wrapped("sensor", "bayer", change), promise)


def clipped(picture, *_):
    return picture.assign(xyz=picture["xyz"].clip(min=0.0).assign_attrs(picture["xyz"].attrs))


ISP_FAULTS = {
    "clips estimates": (clipped, "not clipped"),
    "relative luminance": (
        lambda p, *_: p.assign(xyz=(p["xyz"] / 50).assign_attrs(p["xyz"].attrs)),
        "comes back as 100",
    ),
    "all valid": (lambda p, *_: p.assign(valid=p["valid"] | True), "saturated pixels"),
    "a quarter of the variance": (
        lambda p, *_: p.assign(variance=(p["variance"] / 4).assign_attrs(p["variance"].attrs)),
        "within a factor of 3",
    ),
    "X and Z exchanged": (
        lambda p, *_: p.assign(xyz=p["xyz"].copy(data=p["xyz"].values[..., ::-1])),
        "has its X and Z beside Y",
    ),
    "mirrored": (
        lambda p, *_: p.assign(xyz=p["xyz"].copy(data=p["xyz"].values[:, ::-1])),
        "light up and to the right",
    ),
    "channels without names": (
        lambda p, *_: p.drop_vars("xyz_channel"),
        "returns a picture.*expected .'X', 'Y', 'Z'.",
    ),
    "no variance": (lambda p, *_: p.assign(variance=p["variance"] * 0), "variance above 0"),
}


def deaf_to(name, value):
    """Return an isp class that uses `value` for the number `name`, whatever the captures state."""
    base = components()["isp", "linear"].cls

    @dataclass(frozen=True)
    class Faulty(base):
        """An isp that knows one sensor only."""

        def __call__(self, captures):
            if name in captures.attrs:
                return base.__call__(self, captures.assign_attrs({name: value}))
            return base.__call__(
                self,
                captures.assign({name: captures[name] * 0 + value})
                if name in captures
                else captures,
            )

    return Faulty


@pytest.mark.parametrize(
    ("name", "value"),
    [
        ("gain_dn_per_e", 0.5),
        pytest.param("throughput_sr", THROUGHPUT_SR, marks=pytest.mark.slow),
        pytest.param("area_m2", 9e-12, marks=pytest.mark.slow),
    ],
)
def test_an_isp_that_knows_one_sensor_only(offer, name, value):
    caught(offer, "isp", deaf_to(name, value), f"reads '{name}' from the captures")


@pytest.mark.parametrize("fault", some_quickly(ISP_FAULTS))
def test_isp_faults(fault, offer):
    change, promise = ISP_FAULTS[fault]
    caught(offer, "isp", wrapped("isp", "linear", change), promise)


METRIC_FAULTS = {
    "the truth compared with itself": (
        lambda scores, picture, truth, *_: components()["metric", "ideal"].cls()(
            truth, truth, None
        ),
        "depend on the picture",
    ),
    "a number, no list": (lambda scores, *_: 0.5, "list of Score"),
    "NaN": (lambda scores, *_: [replace(scores[0], value=float("nan"))], "is a number"),
    "interval elsewhere": (
        lambda scores, *_: [replace(scores[0], low=1e9, high=2e9)],
        "low <= value <= high",
    ),
    "the same row twice": (lambda scores, *_: scores * 2, "one row per"),
    "the first values in memory": (
        lambda scores, picture, *_: [
            replace(scores[0], value=float(picture["xyz"].values.ravel(order="K")[:9].sum()))
        ],
        "order of its input in memory",
    ),
}


@pytest.mark.parametrize("fault", METRIC_FAULTS)
def test_metric_faults(fault, offer):
    change, promise = METRIC_FAULTS[fault]
    caught(offer, "metric", wrapped("metric", "ideal", change), promise)


def with_method(name, method):
    """Return the metric `ideal` with one method more."""
    faulty = wrapped("metric", "ideal", lambda scores, *_: scores)
    setattr(faulty, name, method)
    return faulty


def spoils_its_picture(self, picture, first, *rest):
    scores = self(picture, *rest)
    picture["xyz"].values[...] = 7.0
    return scores


FURTHER_FAULTS = {
    "a changed picture": (spoils_its_picture, "further does not change the further picture"),
    "none": (lambda self, *_: None, "further returns a list of scores"),
    "twice": (lambda self, picture, _, *rest: self(picture, *rest) * 2, "further returns a list"),
    "an error": (lambda self, *_: {}["missing"], "further returns a list of scores': KeyError"),
    "the first again": (
        lambda self, picture, first, *rest: self(first.assign(xyz=1.1 * first["xyz"]), *rest),
        "further returns the value of .* that the call returns",
    ),
    "another score": (
        lambda self, picture, _, *rest: [replace(s, metric="b") for s in self(picture, *rest)],
        "further returns the scores that the call returns",
    ),
}


@pytest.mark.parametrize("fault", FURTHER_FAULTS)
def test_a_metric_with_other_scores_of_further_realisations(fault, offer):
    method, promise = FURTHER_FAULTS[fault]
    caught(offer, "metric", with_method("further", method), promise)


PARTS_FAULTS = {
    "none": (lambda self, *_: None, "one list of scores for each part"),
    "one too few": (lambda self, p, t, part: [[]] * int(part.max()), "one list of scores for each"),
    "another score": (
        lambda self, p, t, part: [[Score("b", 1.0, "")]] * (int(part.max()) + 1),
        "of_parts returns scores that the call returns",
    ),
}


@pytest.mark.parametrize("fault", PARTS_FAULTS)
def test_a_metric_with_wrong_scores_of_parts(fault, offer):
    method, promise = PARTS_FAULTS[fault]
    caught(offer, "metric", with_method("of_parts", method), promise)


def test_a_metric_that_reads_labels_it_never_asked_for(offer):
    def greedy(scores, picture, truth, labels, *_):
        labels["instance"]
        return scores

    caught(offer, "metric", wrapped("metric", "dynamic_range", greedy), "accepts valid input")


def test_a_metric_that_mixes_up_its_threads(offer):
    last = []

    def forgetful(scores, *_):
        last[:] = [scores]
        time.sleep(0.05)  # the other thread answers meanwhile
        return last[0]

    caught(offer, "metric", wrapped("metric", "ideal", forgetful), "overlap in several threads")


LIGHTING_FAULTS = {
    "weights misstated": (
        lambda m, *_: m.assign_attrs(weights={g: 2.0 * w for g, w in m.attrs["weights"].items()}),
        "sum of weight",
    ),
    "weights missing": (lambda m, *_: (m.attrs.pop("weights"), m)[1], "states the weight"),
    "normalised": (lambda m, *_: keep(m, m.values / m.values.max()), "sum of weight"),
}


@pytest.mark.parametrize("fault", LIGHTING_FAULTS)
def test_lighting_faults(fault, offer):
    change, promise = LIGHTING_FAULTS[fault]
    caught(offer, "lighting", wrapped("lighting", "ideal", change), promise)


def test_a_scene_with_hidden_state(offer):
    caught(
        offer,
        "scene",
        wrapped(
            "scene",
            "uniform",
            lambda ds, *_: ds.assign(radiance=ds["radiance"] * (1 + next(COUNTER))),
        ),
        "valid|seed",
    )


def test_a_renderer_that_accumulates_samples_is_called_as_its_protocol_says(offer):
    @dataclass(frozen=True)
    class Dark:
        """A renderer of no light that continues from stored samples."""

        def enough(self, paths, noise):
            return True

        def __call__(self, description, demand, known):
            x = quantities.centres(6, 0.6)
            y = quantities.centres(4, 0.4)
            dark = np.zeros((len(known), 2, 4, 6))
            return quantities.scene_radiance(dark, tuple(known), [450.0, 550.0], x, y)

    caught(offer, "renderer", Dark, "a uniform sky has the stated radiance everywhere")


def test_flares_that_amplify(offer):
    @dataclass(frozen=True)
    class Amplifying:
        """An aperture that makes light."""

        def pupil(self, x_mm, y_mm, wavelength_nm):
            return 1.5 + 0.0 * x_mm * y_mm

    caught(offer, "flare", Amplifying, "never amplifies")

    @dataclass(frozen=True)
    class Scattering:
        """A scatter that spreads more light than there is."""

        def scatter(self, wavelength_nm, angle_rad):
            return np.full(np.shape(angle_rad), 1.0)

    caught(offer, "flare", Scattering, "at most 1")

    @dataclass(frozen=True)
    class Nothing:
        """A flare without any method."""

    caught(offer, "flare", Nothing, "at least one")


def test_a_lens_that_reads_light_before_it_looks_at_its_form(offer):
    def hasty(self, mixed, flares=()):
        np.max(mixed.values)
        return components()["lens", "ideal"].cls.__call__(self, mixed, flares=flares)

    faulty = wrapped("lens", "ideal", lambda out, *_: out)
    faulty.__call__ = hasty
    caught(offer, "lens", faulty, "refuses unsorted wavelengths .*ReadTooEarly")


def test_a_metric_and_an_isp_that_read_before_they_look(offer):
    def hasty(of):
        def call(self, data, *others):
            for name in {"raw", "xyz"} & set(data):
                np.sum(data[name].values)
            return of(self, data, *others)

        return call

    for kind, base in (("metric", "ideal"), ("isp", "linear")):
        faulty = wrapped(kind, base, lambda out, *_: out)
        faulty.__call__ = hasty(components()[kind, base].cls.__call__)
        caught(offer, kind, faulty, "refuses .*ReadTooEarly")


def test_a_sensor_that_cannot_read_from_a_store(offer):
    def needs_memory(self, light, generator):
        lazy = not light.variable._in_memory
        shot = components()["sensor", "bayer"].cls.__call__(self, light, generator)
        return shot.assign(raw=shot["raw"] + 1) if lazy else shot

    faulty = wrapped("sensor", "bayer", lambda shot, *_: shot)
    faulty.__call__ = needs_memory
    caught(offer, "sensor", faulty, "opened from a store")


def test_an_error_that_does_not_say_what_was_expected(offer):
    def curt(self, mixed, flares=()):
        try:
            return components()["lens", "ideal"].cls.__call__(self, mixed, flares=flares)
        except IsetHdrError:
            raise UnitError("bad light") from None

    faulty = wrapped("lens", "ideal", lambda out, *_: out)
    faulty.__call__ = curt
    caught(offer, "lens", faulty, "says what it expected .*bad light")


def test_a_lens_that_states_no_error(offer):
    caught(
        offer,
        "lens",
        wrapped(
            "lens",
            "ideal",
            lambda out, *_: (ledger._row.get() and ledger._row.get().errors.clear(), out)[1],
        ),
        "states its error",
    )


def test_narrow_that_drops_what_is_needed(offer):
    sensor = wrapped("sensor", "bayer", lambda shot, *_: shot)
    sensor.narrow = lambda self, demand: replace(
        demand,
        wavelength_nm=demand.wavelength_nm
        and demand.wavelength_nm[: len(demand.wavelength_nm) // 2],
    )
    caught(offer, "sensor", sensor, "needs no band that its narrow drops")
    lighting = wrapped("lighting", "ideal", lambda mixed, *_: mixed)
    lighting.narrow = lambda self, demand: (
        demand.with_groups(demand.groups[:1]) if demand.groups else demand
    )
    caught(offer, "lighting", lighting, "needs no light group that its narrow drops")
    metric = wrapped("metric", "ideal", lambda scores, *_: scores)
    metric.narrow = lambda self, demand: (
        demand.with_groups(demand.groups[:1]) if demand.groups else demand
    )
    caught(offer, "metric", metric, "narrow drops no light group")
    lens = wrapped("lens", "ideal", lambda light, *_: light)
    lens.narrow = lambda self, demand: replace(
        demand, wavelength_nm=demand.wavelength_nm and demand.wavelength_nm[1:]
    )
    caught(offer, "lens", lens, "passes no light in a band that its narrow drops")


def test_greedy_demand(offer):
    faulty = wrapped("metric", "ideal", lambda scores, *_: scores)
    faulty.narrow = lambda self, demand: replace(demand, groups=None)
    caught(offer, "metric", faulty, "never asks for more")


@pytest.mark.parametrize(
    ("annotation", "value", "bad_values"),
    [
        (float | tuple[float, ...], 1.0, [np.nan, np.inf, -np.inf]),
        (int | None, 1, [np.nan, 0.5, np.inf, -np.inf]),
        # a fraction fits the other type, and so does a name outside the range
        (int | float, 1, 2 * [np.nan, np.inf, -np.inf]),
        (Annotated[int, Range(1, 9)] | Literal[0], 1, [np.nan, 1.5, np.inf, -np.inf, 10]),
    ],
)
def test_bad_values_of_a_union_fit_none_of_its_types(annotation, value, bad_values):
    np.testing.assert_array_equal(list(outside(annotation, value)), bad_values)


def test_fields_that_cannot_be_compared_are_named(offer):
    @dataclass(frozen=True)
    class Faulty:
        """A metric with an array."""

        weights: np.ndarray = field(default_factory=lambda: np.ones(2))

        def __call__(self, picture, truth, labels):
            return []

    caught(offer, "metric", Faulty, "equal component.*ValueError")


def test_every_kind_has_a_check():
    import importlib

    for kind in KINDS:
        assert callable(importlib.import_module(f"isethdr_core.conformance.{kind}").check)
    with pytest.raises(ConfigError, match="did you mean 'sensor'"):
        check("sensr", "ideal")
    with pytest.raises(ConfigError, match="did you mean 'ideal'"):
        check("sensor", "idael")
    with pytest.raises(ConfigError, match="no field 'exposure'; did you mean 'exposure_s'"):
        check("sensor", "ideal", exposure=1.0)
    assert build("sensor", "ideal") == build("sensor", "ideal")


@dataclass(frozen=True)
class Spreads:
    """A lens with the value `axis` at the centre of its point spread function, and `beside` at the
    border.
    """

    axis: float
    beside: float = 0.0
    extra: int = 0  # rows beyond the requested size

    def psf(self, wavelength_nm, pitch_um, size):
        values = np.zeros((len(wavelength_nm), size + self.extra, size))
        values[:, size // 2, size // 2] = self.axis
        values[:, size // 2, 0] = self.beside
        return values


@pytest.mark.parametrize(
    ("lens", "promise"),
    [
        (Spreads(0.5, 0.6), "sums to at most 1"),
        (Spreads(1.0, -0.1), "no negative energy"),
        (Spreads(1.0, extra=1), "shape"),
    ],
)
def test_a_point_spread_function_with_a_fault(lens, promise):
    assert isinstance(lens, HasPointSpread)
    with pytest.raises(AssertionError, match=promise):
        _check_psf("lens 'faulty'", lens)


def test_a_point_spread_function_is_asked_of_lenses_that_have_one():
    _check_psf("lens 'toy'", Spreads(0.9, 0.1))
    assert isinstance(build("lens", "diffraction_limited"), HasPointSpread)
    assert not isinstance(build("scene", "uniform"), HasPointSpread)
