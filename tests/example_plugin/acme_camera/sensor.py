"""A small sensor under a 2 x 2 array of three broad filters."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Literal

PEAKS_NM = {"R": 600.0, "G": 540.0, "B": 460.0}


@dataclass(frozen=True)
class AcmeNano:
    """Small sensor with shot and read noise, dead pixels, and two kinds of converter."""

    exposure_s: float = 0.01
    pitch_um: float = 4.0
    full_well_e: float = 8000.0
    read_noise_e: float = 2.5
    converter: Literal["ramp", "sar"] = "ramp"  # ramp has 12 bits, sar 10 bits
    dead_pixels: tuple[tuple[int, int], ...] = ()  # (row, column) of each dead pixel

    def expected(self, light):
        """Return mean electrons (capture, y, x)."""
        return self._mean(light)[0]

    def __call__(self, light, generator):
        """Return the captures of one shot."""
        import numpy as np
        import xarray as xr

        from isethdr_core.physics.detector.noise import normal, poisson_image
        from isethdr_core.physics.detector.random_words import words
        from isethdr_core.uncertainty import ledger

        ledger.error(0.01, "relative", "bound", "gaussian filter curves, read at band centres")
        mean, filters, qe = self._mean(light)
        height, width = filters.shape
        well = self.full_well_e
        charge = np.minimum(
            poisson_image(np.minimum(mean.values[0], 2 * well), generator.stream("acme", "shot")),
            well,
        )
        read = charge + self.read_noise_e * normal(
            words(generator.stream("acme", "read"), 0, height, 0, width)
        )
        top = 2 ** {"ramp": 12, "sar": 10}[self.converter] - 1
        gain = 0.9 * top / well
        black = 0.05 * top
        raw = np.clip(np.rint(black + gain * read), 0, top)
        saturated = charge >= well
        for row, column in self.dead_pixels:
            raw[row, column] = top
            saturated[row, column] = True
        one = {
            "exposure_s": self.exposure_s,
            "gain_dn_per_e": gain,
            "black_dn": black,
            "top_dn": top - 1.0,
            "dark_e": 0.0,
            "read_noise_e": self.read_noise_e,
            "quantisation_e": 1 / gain,
            "area_m2": (self.pitch_um * 1e-6) ** 2,
        }
        return xr.Dataset(
            {
                "raw": (("capture", "y", "x"), raw[None].astype(np.uint16)),
                "saturated": (("capture", "y", "x"), saturated[None]),
                "filter": (("y", "x"), filters),
                "charge": ("capture", [0]),
                "quantum_efficiency": (("capture", "channel", "wavelength"), qe[None]),
                **{k: ("capture", [v]) for k, v in one.items()},
            },
            coords={
                **mean.coords,
                "channel": np.array(list(PEAKS_NM), object),
                "wavelength": light.wavelength.values,
            },
            attrs={
                "pitch_um": self.pitch_um,
                "cfa": "RGGB",
                **{
                    k: light.attrs[k]
                    for k in ("f_number", "focal_length_mm", "throughput_sr", "falloff")
                },
            },
        )

    def _mean(self, light):
        """Return mean electrons (capture, y, x), filter index (y, x) and quantum efficiency
        (channel, wavelength).
        """
        import numpy as np
        import xarray as xr

        from isethdr_core.data import quantities
        from isethdr_core.data.temporal_modulation import time_mean
        from isethdr_core.physics.radiometry import band_widths_nm, photons_from_energy
        from isethdr_core.physics.resampling.area import integrate_tiles

        light = time_mean(light)  # each row of this sensor integrates many periods of any lamp
        quantities.check_irradiance(light)
        pitch = self.pitch_um * 1e-6
        nm = light.wavelength.values
        height, width = (
            int(light.attrs[side] / pitch + 1e-9) for side in ("field_height", "field_width")
        )
        y = quantities.centres(height, height * pitch)
        x = quantities.centres(width, width * pitch)
        qe = np.stack(
            [0.5 * np.exp(-0.5 * ((nm - peak) / 45.0) ** 2) for peak in PEAKS_NM.values()]
        )
        photons = (
            photons_from_energy(light.values.astype(float), nm) * band_widths_nm(nm)[:, None, None]
        )
        planes = integrate_tiles(
            np.tensordot(qe, photons, 1), light.x.values, light.y.values, x, y, pitch, pitch
        )
        filters = np.tile(np.array([[0, 1], [1, 2]], np.uint8), (height // 2 + 1, width // 2 + 1))[
            :height, :width
        ]
        mean = self.exposure_s * np.take_along_axis(planes, filters[None].astype(int), axis=0)
        return (
            xr.DataArray(
                mean,
                dims=("capture", "y", "x"),
                attrs={"units": "e"},
                coords={"capture": np.array(["single"], object), "y": y, "x": x},
            ),
            filters,
            qe,
        )
