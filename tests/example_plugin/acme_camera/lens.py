"""A lens without blur. Its plastic absorbs a share of the light."""

from __future__ import annotations

from dataclasses import dataclass

from isethdr_core.data.temporal_modulation import each_component


@dataclass(frozen=True)
class AcmePlastic:
    """Plastic lens without blur, with cos^4 falloff."""

    f_number: float = 2.0
    focal_length_mm: float = 3.0
    transmittance: float = 0.9  # share of the light that passes

    @each_component
    def __call__(self, mixed, flares=()):
        """Return irradiance on the sensor plane; flares are not modelled and are refused."""
        from isethdr_core.data import quantities
        from isethdr_core.errors import ConfigError
        from isethdr_core.physics.radiometry import cos4_falloff, irradiance_factor
        from isethdr_core.uncertainty import ledger

        if flares:
            raise ConfigError(
                "lens 'acme_plastic' models no flare; type '~flare.dirt' or choose another lens"
            )
        quantities.check_mixed(mixed)
        f_m = self.focal_length_mm * 1e-3
        x_m = mixed.x.values * f_m
        y_m = mixed.y.values * f_m
        throughput_sr = self.transmittance * irradiance_factor(self.f_number)
        ledger.error(2.0**-24, "relative", "bound", "a product, rounded to float32")
        light = mixed.values * (throughput_sr * cos4_falloff(x_m[None, :], y_m[:, None], f_m))
        return quantities.plane(
            light.astype("float32"),
            mixed.wavelength.values,
            x_m,
            y_m,
            quantities.IRRADIANCE,
            f_number=self.f_number,
            focal_length_mm=self.focal_length_mm,
            throughput_sr=throughput_sr,
            falloff="cos4",
            field_width=mixed.attrs["field_width"] * f_m,
            field_height=mixed.attrs["field_height"] * f_m,
        )
