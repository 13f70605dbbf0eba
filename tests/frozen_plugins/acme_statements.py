"""The lines of documentation that were no whole plugin, made one."""

import math
from dataclasses import dataclass, field
from typing import Annotated

from isethdr_core import Component, Range, hookimpl
from isethdr_core.light_in_time import components, each_component, time_mean


@dataclass(frozen=True)
class Stating:
    """A lens without blur that states errors of every form."""

    share: Annotated[float, Range(0, 1)] = 0.001  # both ends are allowed
    lines: Annotated[int, Range(1, 4096)] | None = None  # the range belongs to the number
    gain_db: dict[float, Annotated[float, Range(-60, 60)]] = field(default_factory=dict)
    distance_m: Annotated[float, Range(0.1, math.inf)] = math.inf  # infinity is meant

    def __post_init__(self):
        from isethdr_core.ranges import check_ranges

        check_ranges(self)

    def narrow(self, demand):
        """Return the demand unchanged."""
        return demand

    @each_component
    def __call__(self, mixed, flares=()):
        """Return irradiance, an eighth of the radiance."""
        from isethdr_core import ledger, quantities
        from isethdr_core.error_terms import SPREAD, ErrorNote, Quantity

        quantities.check_mixed(mixed)
        f_m = 4e-3
        light = quantities.plane(
            (0.125 * mixed.values).astype("float32"),
            mixed.wavelength.values,
            mixed.x.values * f_m,
            mixed.y.values * f_m,
            quantities.IRRADIANCE,
            f_number=4.0,
            focal_length_mm=4.0,
            throughput_sr=0.125,
            falloff="none",
            field_width=mixed.attrs["field_width"] * f_m,
            field_height=mixed.attrs["field_height"] * f_m,
        )
        ghosts = 0.01 * light
        ledger.error(0.01, "relative", "bound", "blur beyond the kernel")
        ledger.left_out("bands above 680 nm", "the sensor is blind there", 0.0, "e")
        ledger.light_part("light of ghosts", ghosts)
        ledger.add_error(
            ErrorNote(
                0.1,
                "relative",
                "measured",
                "ghosts of lamps",
                "ghost drawing",
                Quantity.IRRADIANCE,
                "light of ghosts",
            )
        )
        ledger.add_error(
            ErrorNote(
                0.02, "um rms", "measured", "wavefront fit", "Zernike fit", Quantity.POINT_SPREAD
            )
        )
        ledger.add_error(
            ErrorNote(0.03, "relative", "bound", "haze", "haze", Quantity.IRRADIANCE, SPREAD)
        )
        return light


@dataclass(frozen=True)
class Counting:
    """A sensor without pixels of its own: each tile of light is one pixel."""

    exposure_s: float = 0.01
    area_m2: float = 1e-11

    def expected(self, light):
        """Return mean electrons (capture, y, x)."""
        import xarray as xr

        from isethdr_core.physics.radiometry import band_widths_nm, photons_from_energy

        nm = light.wavelength.values
        parts = [part for modulation, part in components(light) if modulation.duty > 0]
        assert len(parts) == len(components(light))
        photons = photons_from_energy(time_mean(light).values.astype(float), nm)
        photons = (photons * band_widths_nm(nm)[:, None, None]).sum(axis=0)
        return xr.DataArray(
            0.5 * self.exposure_s * self.area_m2 * photons[None],
            dims=("capture", "y", "x"),
            attrs={"units": "e"},
        )

    def __call__(self, light, generator):
        """Return noisy electrons as captures of one DN per electron."""
        from isethdr_core.physics.noise import normal
        from isethdr_core.physics.random_words import words

        mean = self.expected(light)
        height, width = mean.shape[1:]
        drawn = normal(words(generator.stream("acme", "read"), 0, height, 0, width))
        return mean.copy(data=mean.values + drawn[None]).to_dataset(name="raw")


@hookimpl
def isethdr_components():
    return [Component("lens", "acme_stating", Stating), Component("sensor", "acme_counting", Counting)]
