"""Measured: the studies that make the tables of `docs/measured`. They run from a checkout, with
`python -m isethdr_measured NAME key=value ...`; the wheel does not contain them.

| module                | content                                                                  |
|-----------------------|--------------------------------------------------------------------------|
| `__main__`            | the command                                                              |
| `coloured_streaks`    | streaks of a dusty lens: one wavelength per band, and whole bands        |
| `convolution_methods` | error against run time next to lamps up to 1e12 times the background     |
| `denoised_scores`     | scores of the main job with and without denoising, and its MTF50         |
| `demosaic_methods`    | demosaic methods compared on charts                                      |
| `fireflies`           | single tiles that are far too bright, checked by a longer rendering      |
| `fog_reference`       | fog by Mitsuba's own volumetric path integrator                          |
| `fog_scattering`      | light that fog scatters once, and at any order                           |
| `job_paths`           | a job that builds its scene and tables once and renders many times       |
| `lens_kernels`        | point spread kernels against direct sums, also next to bright lamps      |
| `merge_rules`         | merge rules over eight decades of light                                  |
| `network_cost`        | seconds and memory of `isp=network`, with an untrained stand-in          |
| `photographs`         | statistics of rendered streets compared with those of photographs        |
| `renderer_noise`      | noise and light of adaptive renderings, against even passes              |
| `accuracy/`           | error against run time of each stage of the bundled components           |
| `budget/`             | whether the error allowed is kept                                        |
| `omission/`           | runs that leave out unneeded work, against runs that compute everything  |
| `stability/`          | hard cases for every stage and for the whole chain                       |
"""

from __future__ import annotations

# {name: "module:function" in this package}, in the form of `isethdr_workflows.STUDIES`
STUDIES = {
    "accuracy": "accuracy:accuracy",
    "budget": "budget:budget",
    "coloured_streaks": "coloured_streaks:coloured_streaks",
    "convolution_methods": "convolution_methods:convolution_methods",
    "demosaic_methods": "demosaic_methods:demosaic_methods",
    "denoised_scores": "denoised_scores:denoised_scores",
    "fireflies": "fireflies:fireflies",
    "fog_scattering": "fog_scattering:fog_scattering",
    "kernel_wings": "lens_kernels:kernel_wings",
    "kernels_beside_lamps": "lens_kernels:kernels_beside_lamps",
    "merge_rules": "merge_rules:merge_rules",
    "network_cost": "network_cost:network_cost",
    "omission": "omission:omission",
    "photographs": "photographs:photographs",
    "renderer_light": "renderer_noise:renderer_light",
    "renderer_noise": "renderer_noise:renderer_noise",
    "stability": "stability:stability",
}
