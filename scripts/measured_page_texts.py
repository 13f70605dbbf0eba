"""Texts of the pages of docs/measured: titles, commands, meaning of rows, format of columns."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass, field


@dataclass(frozen=True)
class Column:
    """Format of one column of the rows on a page.

    Parameters
    ----------
    heading : heading on the page, with the unit; "" keeps the name of the column.
    digits : significant digits of its numbers.
    error : name of the column with their standard error. Numbers are rounded to the second digit of
        the error.
    shown : whether the page shows the column.
    """

    heading: str = ""
    digits: int = 4
    error: str = ""
    shown: bool = True


@dataclass(frozen=True)
class Page:
    """One page: its title, the commands that are run for it, and the meaning of their rows.

    Parameters
    ----------
    title : heading of the page.
    about : first paragraph: the meaning of the rows.
    commands : commands that are run for the page.
    takes : duration of the commands in words, from their last run.
    notes : paragraphs after the tables; an image or a table is a paragraph of its own.
    below : paragraphs below the table of one command, by command.
    is_stored : whether the page is made from stored rows, because its commands take hours.
    makes : file in the home that the command makes and that becomes the page; "" for a page of
        rows.
    columns : formats of columns by their name in the rows; others keep name and four digits.
    """

    title: str
    about: str
    commands: tuple[str, ...]
    takes: str
    notes: tuple[str, ...] = ()
    below: Mapping[str, tuple[str, ...]] = field(default_factory=dict)
    is_stored: bool = False
    makes: str = ""
    columns: Mapping[str, Column] = field(default_factory=dict)


def accuracy_of(stage: str) -> str:
    """Return the command that measures one stage and draws its diagram."""
    return f"python -m isethdr_measured accuracy stage={stage} pictures=docs/images"


# commands of the stages, and the paragraphs below each table
ACCURACY = {
    accuracy_of("transport"): (
        "![Paths](../images/accuracy_transport.png)",
        "A night drive of 96 x 54 tiles, without the time to build the scene. Half of the light"
        " of a group is in tiles with a smaller relative error than the stated one. The seconds"
        " of a group are those of the passes that it was part of, together with other groups."
        " Tiles that show a lamp or the sky itself are left out, because they need no paths. The"
        " reference has 2048 paths with other random numbers; errors near the dotted line are"
        " those of the reference. Four times the paths halve the error, as for random errors. `to"
        " a noise of 0.1` is `renderer.error_allowed=0.1`, the default for cameras without noise;"
        " otherwise the noise of the cameras decides ([renderer](../explanation/renderer.md)).",
    ),
    accuracy_of("denoise"): (
        "![Denoised](../images/accuracy_denoise.png)",
        "![8 paths as they are, and denoised](../images/accuracy_preview.png)",
        "`isethdr_core/display/preview.py` averages similar tiles of each group, by the stated"
        " noise of the renderer and by instance, normal and distance (Rousselle, Knaus, Zwicker"
        " 2012). It is for display only: it gives X, Y and Z, not light for a lens or a store."
        " `isethdr study preview` shows a scene with it (picture: 8 samples, 192 x 108 tiles)."
        " The rows of denoised light say how many paths have the same error without"
        " denoising. It is worth most for the light of the sky, and nothing for street lamps. It"
        " loses a little light where few paths meet lamps, because rare bright paths are treated"
        " as outliers. The common rule is non-local means of the logarithm with one noise for the"
        " whole picture (scikit-image); with 24 or more paths it makes the light of headlights and"
        " street lamps worse than it was.",
    ),
    accuracy_of("bands"): (
        "![Bands](../images/accuracy_bands.png)",
        "64 x 36 tiles, the electrons of a Bayer camera, median over pixels. The reference has"
        " bands of 2 nm and the same paths. Bands cost the renderer little, because all bands"
        " share the paths. Memory and the lens pay for bands"
        " ([omission](../explanation/omission.md)).",
    ),
    accuracy_of("stored"): (
        "![Bits kept](../images/accuracy_stored.png)",
        "Each bit of the mantissa halves the largest error. The reference is what was stored.",
    ),
    accuracy_of("psf"): (
        "![Sub-bands and reach of a point spread](../images/accuracy_psf.png)",
        "A clean round stop at f/4, a band of 30 nm, tiles of 3.75 um. The reference is Airy's"
        " formula with 24 x 24 points a tile and 48 wavelengths, extrapolated. Numbers in the left"
        " diagram are wavelengths per band. A single wavelength, as in other simulators, misplaces"
        " 26 times as much light as the choice of the lens, whose error is that of the reference."
        " Kernels that end at three tiles lose 2 % of the light.",
    ),
    accuracy_of("field"): (
        "![Field points](../images/accuracy_field.png)",
        "Coma and astigmatism of 0.13 um rms at the corner, 21 x 29 tiles, light over three"
        " decades; kernels made anew. The reference has one point spread per tile and direct sums;"
        " kernels themselves are the same on both sides. The error falls with the square of the"
        " distance between field points. `nearest` gives each tile the point spread of the nearest"
        " field point, without interpolation, and is 3 to 8 times as wrong. The lens reaches less"
        " than the error allowed, because it counts the worst position between field points and"
        " not the mean.",
    ),
    accuracy_of("ghosts"): (
        "![Ghosts](../images/accuracy_ghosts.png)",
        "A bare Cooke triplet at f/6 with a lamp 6 degrees off the axis. Errors are in blocks of 8"
        " tiles, over the light of the lamp's image; ghosts are 1.5 % of it. The reference is made"
        " of random photons, 8 x 16384 for each pair of surfaces. All 15 pairs matter in bare"
        " glass. Rays are cheap: 16 x 16 per beam leave 2 % of the light of the ghosts wrong."
        " Uniform discs by matrices, as in real-time rendering (Lee and Eisemann 2013), misplace"
        " two thirds of it.",
    ),
    accuracy_of("basis"): (
        "![Functionals of the spectrum](../images/accuracy_basis.png)",
        "48 x 64 tiles without aberrations. The reference are long double sums at 200 tiles. The"
        " fewest functionals are already 400 times better than the smallest error that was"
        " allowed for them, 0.01. Imaging band by band is 3000 times better. For the seconds of"
        " full frames see [lens speed](lens_speed.md).",
    ),
    accuracy_of("aberrated"): (
        "![The same through an aberrated pupil](../images/accuracy_aberrated.png)",
        "The same with 135 x 240 tiles and a wavefront of 0.072 um rms.",
    ),
    accuracy_of("convolve"): (
        "![Convolution](../images/accuracy_convolve.png)",
        "Lamps are 1e8 times as bright as the background. The reference are long double sums."
        " Circular transforms with the size of the frame, as in other simulators, have errors of 8"
        " times the pixel beside the lamps. A larger allowed error does not make isethdr's"
        " convolution cheaper, because few pixels need a direct sum.",
    ),
    accuracy_of("dynamics"): (
        "![Pixel dynamics](../images/accuracy_dynamics.png)",
        "A pixel that overflows, against its closed form in 60 digits. The closed form is exact"
        " and cheapest. Runge-Kutta fails up to 128 steps.",
    ),
    accuracy_of("demosaic"): (
        "![Demosaic](../images/accuracy_demosaic.png)",
        "Stripes that grow finer, 100 cd/m2, 77000 pixels, against the picture without noise and"
        " with every colour in every pixel. `default` is the method that the default camera of the"
        " main job would choose (`isp.demosaic=automatic`). On the arrays with white pixels no"
        " method is better than `learned`; on the plain array `menon` is better for these"
        " stripes.",
    ),
    accuracy_of("merge"): (
        "![Merge rules](../images/accuracy_merge.png)",
        "The error of a rule is the excess of its rms error over that of the best rule at the"
        " same level of light, in the mean over the levels. It is known to 0.35 %. Weights by the"
        " inverse variance are best, and `hard_switch` is equal within that error at half of the"
        " seconds. The others lose 60 % and more.",
    ),
    accuracy_of("metrics"): (
        "![Noise realisations](../images/accuracy_metrics.png)",
        "The scatter of a score, over that of one noise realisation. It falls with the root of the"
        " number of realisations (`draws`), and the time rises in proportion. Other simulators use"
        " one. The reference is the mean of the others of 96 realisations.",
    ),
}


# commands of the page on intervals of scores
INTERVALS = "python benchmarks/score_intervals.py --first-seed 3000"
LARGE_INTERVALS = "python benchmarks/score_intervals.py --large rural"

# commands of the figures of the paper, and the paragraphs below each table
PAPER_FIGURES = {
    "isethdr study paper_fig1 store=streets60 picture=docs/images/paper_fig1.jpg": (
        "Figure 1: light groups, and their sums by night and by day.",
        "![Four light groups in false colour; night, day, objects and"
        " distances](../images/paper_fig1.jpg)",
        "A village, the first scene of the dataset that `isethdr dataset generate streets60"
        " recipe=streets count=60 seed=1` makes. `store=` takes the name of a dataset, or the"
        " beginning of the name of a stored scene. Groups are shown at weight 1: the sky is that of"
        " the day. The paths of the renderer were distributed for a night, so its noise is visible"
        " by day.",
    ),
    "isethdr study paper_fig2 picture=docs/images/paper_fig2.jpg": (
        "Figure 2: beam angle control of area lights on a road. Nothing is rendered.",
        "![Illuminance on the road by beam angle; intensity over the angle](../images/paper_fig2"
        ".jpg)",
        "Area lights of 1000 lm, 0.65 m over the road, 1 % down, with the paper's rule for narrowed"
        " beams; false colours from 0.01 to 100 lx. The flux is the same for every beam angle. The"
        " last picture is the dipped beam of isethdr, a table of intensity with a cut-off.",
    ),
    "isethdr study paper_fig3 picture=docs/images/paper_fig3.jpg": (
        "Figure 3: one rendering mixed to night and to day, and the illuminance along a line"
        " through a headlight.",
        "![Night and day in false colour, and the profile through a headlight](../images/paper_fig3"
        ".jpg)",
        "The image of the headlight has nearly the same illuminance in both versions. The median"
        " of the scene differs by four decades.",
    ),
    "isethdr study paper_fig5 picture=docs/images/paper_fig5.jpg": (
        "Figure 5: the Pixel 4a model (IMX363, f/1.73, 4.38 mm) at four exposures.",
        "![Four exposures of a phone camera at night](../images/paper_fig5.jpg)",
        "All pictures have the same scale: white is 0.3 cd s/m2 over the exposure. The white"
        " balance is estimated from each shot. Signal to noise"
        " and contrast detection of people and cyclists rise with the exposure. The flare of the"
        " headlights grows over the cars beside them.",
    ),
    "isethdr study paper_fig6_7 picture=docs/images/paper_fig6.jpg": (
        "Figure 6: a split-pixel sensor in a tunnel: its three captures, the combination, a line"
        " profile.",
        "![Tunnel: three captures, their combination, and a line profile](../images/paper_fig6"
        ".jpg)",
        "Decades are counted from the darkest pixel whose signal exceeds its noise to the brightest"
        " pixel that is not saturated. The profile follows the row where most of the large"
        " photodiode is full: the exit of the tunnel. There the low gain has a gap, and the"
        " combination follows the reference picture.",
    ),
    "isethdr study paper_fig6_7 scene=night picture=docs/images/paper_fig7.jpg": (
        "Figure 7: the same sensor beside headlights whose flare fills the large photodiode.",
        "![Night: three captures, their combination, and a line profile](../images/paper_fig7.jpg)",
        "Most of the error is flare, which no merge removes.",
    ),
    "isethdr study paper_fig8_9_classical picture=docs/images/paper_fig8_9.jpg": (
        "Figures 8 and 9: RGB against RGBW filters, without a network.",
        "![Pictures at 0.1 and 0.25 lux, and both scores against illuminance]"
        "(../images/paper_fig8_9.jpg)",
        "Means of three shots: SSIM of the driving scene by daylight, CIEDE2000 of the colour"
        " chart. Two demosaic methods: bilinear, and linear per local class ([image"
        " processing](../explanation/isp.md)). The colour matrix is solved for the noise of each"
        " level (`design_snr`), because clear pixels help only where noise matters beside colour.",
        "RGBW is better in little light: in structure up to 0.22 lux with the bilinear demosaic and"
        " up to 1 lux with the learned one, in colour up to 0.1 and 0.46 lux. At more light RGB is"
        " as good or better: only one of four pixels of RGBW is green, and colour must be recovered"
        " by subtracting the clear pixel. At 10 lux 18 % of the clear pixels are saturated.",
    ),
}

PAGES = {
    "agreement": Page(
        "Agreement with ISETCam",
        "Quantities that ISETCam's own code computed, and the same quantities by isethdr. Each row"
        " names the test that compares them and bounds the difference. The reference numbers are"
        " not part of this project: set `ISETHDR_REFERENCE` to their folder. Where isethdr differs"
        " on purpose is [explained](../explanation/isetcam.md).",
        ("python scripts/agreement_isetcam.py",),
        "12 CPU s",
        (
            "`of the largest value`: the largest difference over the largest value of each array."
            " `standard errors`: the largest difference of a mean or a variance, over its standard"
            " error; of 72 normal numbers the largest is below 3.4 in 19 of 20 cases. In 9 and 12"
            " of the 18 cells the original clips the noise at 0 or at the swing.",
        ),
    ),
    "accuracy": Page(
        "Error against run time of each stage",
        "One row for each setting of a stage. `mark` is `default` for the default setting, `peer`"
        " for the rule of other simulators, and `view` for what is made for display only. `front`"
        " marks settings that no other setting beats in both error and time. Seconds are CPU"
        " seconds, the cheapest of up to eight calls; they differ by up to 1.5 times from one run"
        " to the next. Each diagram shows error and CPU seconds on logarithmic axes."
        " [Accuracy](../explanation/accuracy.md) explains how errors are stated.",
        tuple(ACCURACY),
        "4 minutes",
        below=ACCURACY,
        columns={
            "error": Column(digits=2),
            "error_of": Column(shown=False),
            "cpu_s": Column("CPU s", 2),
            "peak_mb": Column("peak MB", 2),
            "reference": Column(shown=False),
            "reference_error": Column("error of the reference", 2),
        },
    ),
    "budget": Page(
        "The allowed error: kept, and what it costs",
        "Three scenes with three allowed errors. Errors are against a reference in float64 whose"
        " kernels are computed for a ninth of the usual error, times against the cheapest of 24"
        " settings by hand.",
        ("python -m isethdr_measured budget",),
        "3 minutes",
        notes=(
            "- The field has 96 x 54 tiles of 10 um, 16 bands, and a lens of f/4 with dust."
            " Radiance is stored, read, mixed, sent through the lens and counted in every pixel,"
            " as in a run. `allowed`, `error_99`, `stated_99` and `truth_error`, that of the"
            " reference itself, are in standard deviations of the sensor's noise; 99 % of the"
            " unsaturated pixels have an error of at most `error_99`, and `stated_99` is what the"
            " ledger states for it; `within` is the share of the unsaturated pixels whose error"
            " is at most `allowed`.",
            "- `cold` is the CPU time with kernels to be made, `warm` with kernels at hand; `over"
            "_best` divides it by that of the cheapest of 24 settings (mantissa bits, error of"
            " kernels, irradiance or photocurrent) that keeps 99 % of the pixels within the same"
            " error. Only the reference can tell which one that is. CPU times of two runs differ"
            " by up to a fifth.",
            "- The stated error is several times the error found. It assumes that neighbouring"
            " tiles have equal errors, and that the error from the period of the computed"
            " diffraction pattern has one sign. Kernels are therefore refined although coarser"
            " ones would do, and some rows take several times as long as the best setting by hand."
            " A run makes its kernels once for all cameras and noise realisations.",
            "- [Budget](../explanation/budget.md) explains how the allowed error is divided.",
        ),
        columns={
            "error_99": Column(digits=2),
            "stated_99": Column(digits=2),
            "truth_error": Column(digits=2),
            "cold_cpu_s": Column(digits=2),
            "cold_over_best": Column(digits=2),
            "warm_cpu_s": Column(digits=2),
            "warm_over_best": Column(digits=2),
        },
    ),
    "catalog": Page(
        "Queries of the catalog",
        "Synthetic records: 150 properties, eight scores of the picture, four of objects and three"
        " objects each. Times of the library call, of DuckDB over a Parquet file of the same"
        " records (properties as JSON), the ratio of their CPU times, and the whole command. The"
        " 20,000 are stores on disk; the million exist in the index only. `CPU` counts all"
        " threads.",
        ("python benchmarks/catalog_queries.py million",),
        "8 CPU min",
        (
            "The time of a command is the least of three by the clock. Most of it is the start of"
            " Python and the import of libraries, so it depends on the load of the machine.",
        ),
    ),
    "charge_dynamics": Page(
        "Integrators of a pixel that overflows",
        "Error against run time of integrators of the charge equation ([charge"
        " dynamics](../explanation/charge_dynamics.md)): an exposure of 16 ms, a knee of 20 000"
        " e, a thermal charge of 530 e, one thread. `flow` and `flow_varying` are the closed form"
        " and the quadrature that sensors use. The tables of time give multiples of the classical"
        " Runge-Kutta method with the fewest equal steps that reach the error; its first line is"
        " in ns per pixel. Where 16 384 steps are not enough, at 1e4 and 1e6 x saturation, the"
        " steps of Runge-Kutta are those of its limit of stability, current x exposure / (2.8 x"
        " thermal charge). `never`, of the other methods: not within 16 384 steps. `fails`: not"
        " finite, or off by more than the charge.",
        ("python benchmarks/charge_dynamics.py",),
        "14 CPU s",
        (
            "![Error against run time of six integrators and the quadrature, 0.01 to 1e6 x"
            " saturation](../images/charge_dynamics.png)",
            "The picture shows a ripple of 100 Hz (`python"
            " benchmarks/charge_dynamics_picture.py`). Below saturation every method works. At"
            " 100 x saturation explicit Euler and Runge-Kutta need a thousand steps before they"
            " are right at all; at 1e6 x they never are. With ripple, implicit Euler is the"
            " cheapest at 1e3 and 1e4 x saturation; below saturation neither Euler method reaches"
            " an error of 1e-6. `flow_varying` takes as many panels as the brightest pixel of the"
            " frame needs.",
        ),
    ),
    "convolution": Page(
        "Convolution methods beside bright lamps",
        "A frame has 30 lamp pixels on a background of about 1. The kernel covers the whole frame"
        " and falls with the cube of the distance. Errors are relative to the value of the pixel:"
        " the largest of 41 pixels, the darkest among them, against direct sums in long double. The"
        " CPU time is that of one call with a prepared kernel.",
        ("python -m isethdr_measured convolution_methods rows=1080 columns=1920",),
        "a minute",
        (
            "isethdr computes in float64, and sums directly at each pixel whose rounding error"
            " may matter. Where a lamp is 1e8 times as bright as the background or more, the"
            " wings of the kernel are brighter than the background everywhere, so relative errors"
            " hardly grow any more. Kernels that fall faster leave far darker pixels; these are"
            " summed directly.",
        ),
        columns={
            "lamp_to_background": Column("lamp / background"),
            "largest_error": Column("largest relative error", 2),
            "negative_pixels": Column("negative pixels"),
            "cpu_s": Column("CPU s", 2),
        },
    ),
    "denoised_scores": Page(
        "Scores of the main job with and without denoising",
        "One shot of each camera of the main job at 320 x 180 tiles: scores of the whole frame, as"
        " the isp returns the picture (`denoised`) and of the same shot before denoising (`plain`)."
        " MTF50 is the mean of three shots of a slanted edge at 2 cd/m2 through the lens without"
        " dirt; denoising may lower it by at most 20 %.",
        ("python -m isethdr_measured denoised_scores",),
        "171 CPU s",
        (
            "Signal to noise, dynamic range and contrast detection read the picture before"
            " denoising, because a denoised picture states no variance: both columns agree.",
        ),
    ),
    "emva1288": Page(
        "Sensors measured by EMVA 1288",
        "Each sensor and preset is measured on simulated flat fields by EMVA 1288, release 4.0, and"
        " compared with the fields that describe it. A figure agrees within 4 standard errors.",
        ("isethdr study emva1288 sensor=all",),
        "10 CPU min",
        notes=(
            "A capture is one reading of a shot, for example LCG and HCG for low and high"
            " conversion gain; `single`: the sensor has one. Charge per light, and exposures, are"
            " per pixel and at one wavelength. `limit`: the standard states an upper limit, which"
            " holds. [Sensors](../explanation/sensors.md) says which model of the standard applies"
            " to which sensor, and how exact each figure is.",
        ),
        columns={
            "found": Column("measured", error="standard_error"),
            "standard_error": Column("standard error", 3),
            "true": Column("expected"),
            "off_in_errors": Column("difference, standard errors", 2),
            "within": Column("agrees"),
        },
    ),
    "experiments": Page(
        "Results of the experiments",
        "",  # the file that the command makes explains the tables
        ("isethdr experiments run",),
        "one to three hours, in the user's own home; steps that are done are not repeated",
        makes="experiments/results.md",
    ),
    "street_scores": Page(
        "Cameras over 60 streets",
        "",  # the file that the command makes explains the tables
        ("isethdr dataset score streets60 engine=processes workers=2",),
        "45 minutes, after the two to three hours of the dataset, in the user's own home",
        makes="datasets/streets60/scores.md",
    ),
    "isp": Page(
        "Merge rules and demosaic methods",
        "Signal-to-noise ratio, bias and stated variance of merge rules; errors of demosaic methods"
        " against reference pictures.",
        ("python -m isethdr_measured merge_rules", "python -m isethdr_measured demosaic_methods"),
        "a minute",
        notes=(
            "`merge_rules`: one pixel of the sensor `split_pixel` is simulated 100 000 times at"
            " each level and merged by each rule. SNR is the level over the rms error. The"
            " variance ratio is 1 where the merge states its own variance rightly. Levels from 4"
            " standard deviations of the shot noise below the end of a capture to 3 above it are"
            " marked, because rules may fail there. `own_noise` weights each charge by the"
            " inverse of its own noisy variance, `hard_switch` has no ramp; neither is offered as"
            " a rule. The last four rows state how far `inverse_variance`, the default, is from"
            " its limits, from 1 e to 4 standard deviations below the end of the small"
            " photodiode: its bias, its stated variance, and the lead of other rules.",
            "`demosaic_methods`: charts on 120 x 160 pixels of 3 um, f/2, 16 ms, with the noise of"
            " the sensor `bayer`. Stripes reach 0.4 cycles per pixel. PSNR is that of the displayed"
            " picture in 8 bit, dE00 the mean CIEDE2000; both are against the reference picture, 8"
            " pixels at the border left out. [Image signal processing](../explanation/isp.md) says"
            " what the methods do.",
        ),
        columns={
            "level_e": Column("level, e"),
            "snr_db": Column("SNR, dB"),
            "bias_percent": Column("bias, %", error="bias_error_percent"),
            "bias_error_percent": Column("its standard error, %", 2),
            "reported_over_true": Column("stated / true variance", 3),
            "near_top": Column("near the end of a capture"),
            "check": Column("compared with its limit"),
            "luminance_cd_m2": Column("white, cd/m2"),
            "cfa": Column("filter array"),
            "demosaic": Column("method"),
            "psnr_db": Column("PSNR, dB", 3),
            "ciede2000": Column("dE00", 3),
        },
    ),
    "lens_kernels": Page(
        "Point spread kernels against direct sums",
        "Tiles of 3 um, f/4, 6 mm, dusty hexagon, bands of 10 nm, 180 x 320 tiles. The reference"
        " integrates every chord of the pupil in closed form and adds points of a tile and"
        " wavelengths one by one. Patches are 4 x 4 tiles. Three times the chords change these"
        " sums by some 3e-5 at 69 tiles from the axis.",
        (
            "python -m isethdr_measured kernel_wings",
            "python -m isethdr_measured kernels_beside_lamps",
        ),
        "5 CPU min",
        (
            "`kernel_wings`: the L1 error of a patch and the error of its sum, relative, and the"
            " error per tile that the kernels state for that octave of distance. The exact core"
            " reaches 60 tiles along either axis at 400 nm, and 80 at 550 and 700 nm. An octave"
            " that lies inside it states the error of the core alone. The octave of 64 to 128"
            " tiles also has tiles beyond the core, so its stated error is far above the errors"
            " at 69 tiles.",
            "`kernels_beside_lamps`: one lamp of one tile on an even background of about 200"
            " electrons, 31 bands, Bayer sensor that allows 0.1 of its noise, of which kernels have"
            " 0.074. `largest_error` is that of a tile and channel below full scale, in standard"
            " deviations of the noise; nan where the patch is full. `stated` is what the plan"
            " states for 99 % of the tiles of the frame. Within `core_tiles` of the axis kernels"
            " are exact. `cpu_s` is that of the plan; with the first lamp it includes all kernels,"
            " afterwards what they lack.",
            "Figures that were measured by hand are in [lens kernel"
            " choices](../explanation/lens_kernel_choices.md).",
        ),
    ),
    "lens_speed": Page(
        "Speed of the lens",
        "A night with 40 lamps of up to 1e8 times the background, tiles of 3 um, f/4, dusty"
        " hexagon. The SciPy program is a linear float64 convolution that keeps its transfer"
        " functions; the shared rule is that of image simulators: a point spread per band by FFT on"
        " a padded square, then circular convolution. Cost against frame size and bands is one run"
        " each.",
        (
            "python benchmarks/spectral_path.py",
            "python benchmarks/spectral_path.py --table --largest 1080",
        ),
        "24 minutes",
        (
            "Rows with ducc0 need the extra `fast`. On 2026-11-26 it took, at 1080 x 1920 x 31 with"
            " kernels kept, 6.71 CPU s instead of 8.90 for irradiance, and 3.03 instead of 3.32 for"
            " photocurrent. The SciPy program is left out where it would"
            " take more than 8 GB. The table has lamps of up to 1e6. Frames of 2160 x 3840 are"
            " measured by the second command without `--largest`. Nine tenths of the CPU time of"
            " irradiance with kept kernels are Fourier transforms. On 2026-11-28 MKL's transforms"
            " took 0.85 of SciPy's time for the whole image (AMD EPYC, one run beside other work),"
            " and a near part in double precision with a far part in single precision took as long"
            " as the whole kernel in double precision.",
        ),
    ),
    "omission": Page(
        "Runs that leave out what they do not need",
        "Ten cases, in turn with omissions and with `leave_out=false`, each time in an empty home"
        " without kernels. `cpu_s` and `everything_cpu_s` are the least CPU time of two turns, of"
        " five where nothing is rendered. Code is imported and compiled, and surfaces are made,"
        " before the clock starts. [Omission](../explanation/omission.md) explains what is left"
        " out.",
        ("python -m isethdr_measured omission",),
        "a quarter of an hour",
        (
            "The readings of all captures are compared. Each reading has a bound. `difference_e`"
            " and `bound_e`, both in electrons, are those of the reading that comes nearest to"
            " its bound. Where only needless work was left out, the bits are the same. Where the"
            " lens returned photocurrent, or a band was dropped, readings may differ by twice the"
            " bound of the light plus one electron and one code, because both are whole numbers."
            " `plan_percent` is the time of the plan, as percent of `everything_cpu_s`.",
            "Rendered cases go on until the noise of each light group is 0.1. Noon has the tiles of"
            " the main job, the other two 192 x 108. If paths follow the noise of the cameras"
            " instead, which is the default, those that one light group does not need go to the"
            " others, and the readings differ by the noise of the rendering. The tunnel and the"
            " five lights need nearly everything.",
            "The ratios depend on the cases, and these were chosen while their ratios were"
            ' known. The cases named "mean" and "edge, photons counted" ask for four noise'
            " realisations, which they do not need: their sensor gives mean electrons.",
        ),
    ),
    "paper_figures": Page(
        "The paper's figures",
        "Figures of the ISETHDR paper, repeated with the scenes, lenses and sensors of this"
        " simulator. They can be compared in kind, not pixel by pixel, because the scenes are other"
        " ones. Each command reads the stored radiance of its scene, and renders it only where it"
        " is missing. Figure 4 is in [flare](../explanation/flare.md). Figures 8 and 9 with trained"
        " networks (`isethdr study paper_fig8_9_networks`) are in"
        " [experiments](experiments.md#filters_networks).",
        tuple(PAPER_FIGURES),
        "9 minutes, without the dataset of figure 1",
        (
            "## Where text and scripts differ",
            "The published scripts do not use all numbers of the paper's text. `parameters=paper`"
            " and `parameters=scripts` choose; every other number is the same.",
            "| figure | `paper` | `scripts` |\n"
            "|---|---|---|\n"
            "| 5 (default `paper`) | Pixel 4a (IMX363), 5, 10, 20, 40 ms | AR0132AT with pixels of"
            " 3 um, 5, 40.5, 324.2 ms |\n"
            "| 6, 7 (default `paper`) | no exposure is named: 16 ms, pixels of 2.8 um | 120 ms in"
            " the tunnel, 342 ms by night; pixels of 3 um, no converter, no fixed pattern |\n"
            "| 8, 9 (default `own`: 0.01 to 10 lux) | 0.1 to 1 and 2 to 10 lux | 0.01, 0.32 and 10"
            " lux; both with pixels of 3 um, 1/60 s |",
            "Figures 1 and 2 have no script. Figure 4 has densities of dirt that are assumed.",
        ),
        PAPER_FIGURES,
        is_stored=True,
    ),
    "photographs": Page(
        "How unlike photographs rendered streets are",
        "Statistics of the luminance of rendered radiance, before any lens or camera: three"
        " streets (seed 1) under three lightings, nine pictures of 192 x 108 tiles with 32 paths"
        " per tile and light group. The radiance of a street is rendered once; its light groups"
        " are weighted for each lighting. `spread_decades` is the standard"
        " deviation of log10 luminance, `skew` its skewness. `slope` is the slope of the"
        " amplitude spectrum of luminance on log-log axes, `log_slope` that of log luminance."
        " `kurtosis` is that of the differences of log luminance between neighbours along a row;"
        " a normal distribution has 3.",
        ("python -m isethdr_measured photographs",),
        "3 CPU min",
        (
            "`slope_seen`: whether the slope is within -1.5 to -0.8, the range over 135"
            " photographs of natural scenes, whose mean is -1.2 (Tolhurst, Tadmor and Chao 1992,"
            " abstract). `kurtosis_seen`: whether the kurtosis is above 3. Statistics of natural"
            " images have high kurtosis, heavy tails and a sharp cusp (Srivastava, Lee, Simoncelli"
            " and Zhu 2003, abstract); the abstract states no number.",
            "For pictures of a very high dynamic range the power law of the spectrum breaks down"
            " (Grimaldi, Kane and Bertalmio 2019, abstract), and localised light sources may"
            " dominate the spectrum (Dror, Willsky and Adelson 2004, abstract). With lamps on,"
            " `slope` is therefore that of lamps; `log_slope` depends less on them. Spread and skew"
            " are given without a comparison: no published figure was found in a text that could be"
            " read.",
            "Limits. Nine pictures of three scenes are few, and a street is not the scene of those"
            " photographs. Small frames hold a decade of frequency less than a photograph of 1000"
            " rows, and a tile averages what is smaller than 0.3 degrees. The noise of 32 paths"
            " makes slopes shallower and differences more normal. Most of a street at this size is"
            " smooth: sky, asphalt and walls.",
        ),
    ),
    "published_figures": Page(
        "Sensors against published figures",
        "Figures that data sheets and papers state, or that follow from them by a closed form"
        " (column `how`), and the same figures of the simulated sensor.",
        ("isethdr study published_figures",),
        "5 CPU s",
    ),
    "renderer": Page(
        "Noise and run time of the renderer",
        "The renderer against the best use of Mitsuba's own `path` that is known here; its noise"
        " where it goes by the cameras, as a share of the noise of the least noisy camera, in the"
        " main job (`main`), a tunnel, and a country road; the light of each group against even"
        " passes; tiles that are too bright; and many lamps against few.",
        (
            "python benchmarks/render_light_groups.py",
            "python -m isethdr_measured renderer_noise",
            "python -m isethdr_measured renderer_noise scene=tunnel shares=0.8",
            "python -m isethdr_measured renderer_noise scene=country shares=0.8",
            "python -m isethdr_measured renderer_light",
            "python -m isethdr_measured fireflies width=640 height=360",
            "python benchmarks/render_many_lamps.py 96",
        ),
        "25 CPU min",
        (
            "`renderer_noise`: `share` is `renderer.noise_share_allowed`. `stated_90` is the"
            " stated noise that 90 % of the tiles are below. `over_true_90` is stated over true"
            " noise at 90 % of the tiles. The stated noise is sampled for as many renderings as"
            " there are, so that both have the scatter of few renderings. `error_99` is the"
            " standard error of the ratio at 99 %, from leaving out each rendering in turn."
            " `worst_99` is the ratio of the one rendering that is farthest off at 99 %. `cpu_s`"
            " is that of one rendering, without `tables_s`, the tables of the scene, which are"
            " made once. `paths` are samples per tile and light group, the mean over all tiles"
            " and groups. The tunnel has at most 512 of them, because its limit is out of reach."
            " Where few renderings miss the rarest light, the ratio at 99 % is too large, as in"
            " the tunnel. Where it is below 1, as in the country road, the stated noise of these"
            " tiles is too small.",
            "`renderer_light`: `need_over_even` is the light of a group where paths follow need,"
            " over that of even passes, before rare light is moved. A few glints decide this ratio."
            " `known_need_over_even` is that of the tiles in which even passes scatter by at most"
            " 5 %; they hold `known_share` of the light.",
            "`fireflies`: `standing_out` are tiles far brighter than their neighbours"
            " ([definition](../explanation/renderer.md#how-it-works)). A firefly is one of them"
            " that a judge with `judge_paths` does not confirm; the goal is 0. Many lamps: time to"
            " equal noise with 1,000 lamps over that with 10 of the same flux and area; the goal is"
            " 3.",
        ),
    ),
    "scores": Page(
        "Intervals of scores",
        "The share of 95 % intervals that contain the score without renderer noise; stated errors"
        " of scores against repeated renderings; and the run time of intervals."
        " [Metrics](../explanation/metrics.md#the-interval-of-a-score) and"
        " [accuracy](../explanation/accuracy.md#from-the-renderers-noise-to-scores) explain them."
        " Measurements behind single choices are in [score"
        " choices](../explanation/score_choices.md).",
        (
            INTERVALS,
            LARGE_INTERVALS,
            "python benchmarks/score_errors.py",
            "python benchmarks/truth_machinery.py",
            "python benchmarks/isp_sweep.py",
        ),
        "half an hour",
        below={
            INTERVALS: (
                "`inside` is the share of the renderings whose interval contains the true score."
                " `off` is the distance of a score from the true one, `half` half the length of"
                " its interval. `apart` is half the difference of the two long renderings whose"
                " mean counts as true. In small pictures the white is the luminance of few tiles,"
                " so its intervals may miss the true white more often than others. A rendering"
                " that has not found rare light has narrow intervals about too low a value: in"
                " `rural`, those of mean luminance ([score"
                " choices](../explanation/score_choices.md#rare-light)).",
            ),
            LARGE_INTERVALS: (
                "Pictures of 288 pixels and more along both axes are scored in parts. Here, too,"
                " renderings that have not found rare light have narrow intervals: those of mean"
                " luminance, of the brightest luminance with the ranges below it, and of SNR at"
                " 1 cd/m2.",
            ),
            "python benchmarks/score_errors.py": (
                "`off` is the rms distance of a score from the true one, `shift` the mean distance."
                " The last columns are the rms of the stated errors over `off`; the goal is within"
                " 1.5. `off` itself is known to an eighth with 32 renderings, and to a quarter with"
                " 10. Changes of the whole picture are in use below 288 pixels, parts above; the"
                " pictures of the night drive have 384 x 216 pixels.",
            ),
            "python benchmarks/truth_machinery.py": (
                "Rows with `machinery` are the cost of four noise realisations in place of one, and"
                " of stated errors of scores and pictures. The goal is 0.25 of the time from the"
                " radiance to the written store. It is out of reach as long as every further"
                " realisation is a whole picture with all its scores: `draws` alone takes more.",
            ),
            "python benchmarks/isp_sweep.py": ("The goal is a ratio of at most 1.5.",),
        },
    ),
    "sensor_speed": Page(
        "Speed of a shot",
        "1080 x 1920 pixels of the sensor `split_pixel`, three captures, all noise, one thread. The"
        " ratio is the CPU time of a shot over that of three NumPy Poisson draws at 1000 e and the"
        " projection of 31 bands onto three filters by one matrix product. The first shot of a"
        " device also makes its fixed pattern.",
        ("python benchmarks/shot.py",),
        "11 CPU s",
    ),
    "stability": Page(
        "Stability: hard cases and their verdicts",
        "Each case drives one stage, or the whole chain, to an end of its range. A case is"
        " **right** where a result was expected and its error lies within the bound. The stage"
        " states the bound; where it states none, this study requires one. A case is **refused**"
        " where the expected error of isethdr was raised, with a text that says what to do."
        " Anything else is **WRONG**: beyond the bound, NaN, a crash, a numerical warning. The"
        " last column names the closed form or the exact sum that a result is compared with, or"
        " the text of the error.",
        ("python -m isethdr_measured stability",),
        "10 CPU s",
    ),
}
