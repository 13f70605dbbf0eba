"""Cost of imaging a night scene through a dusty hexagonal stop at f/4 onto 3 um pixels, against two
other programs.

"The program" has twenty lines: a linear float64 convolution per band by SciPy, with kernels and
their transforms made beforehand; rows without light are skipped. "The rule" is what image
simulators share: per band a point spread function by FFT on the frame padded by an eighth, then a
circular float64 convolution by FFT. isethdr convolves linearly over the full frame, to irradiance
of every band or to photocurrent of the sensor's channels. All run in turn on the same scene, in
processes forked from this one, with the default allocator. Each figure is the worst of all turns;
ratios are between figures of one turn. Images with kept kernels or transforms are timed as the best
of three per turn.

    OMP_NUM_THREADS=2 python benchmarks/spectral_path.py [--rows 1080 --columns 1920 --bands 31]
    OMP_NUM_THREADS=2 python benchmarks/spectral_path.py --table [--largest 540]

`--table` prints the cost against frame size and bands, one turn of each, with SciPy's transforms
and, if ducc0 is installed, with its transforms. Frames of more than `--largest` rows are left out.
"""

from __future__ import annotations

import argparse
import ctypes
import multiprocessing
import os
import sys
import tempfile
import threading
import time
from dataclasses import dataclass, replace
from importlib.metadata import version

import numpy as np
import scipy.fft as sf

FIRST_NM = 400.0
LAST_NM = 700.0
PITCH_UM = 3.0
FOCAL_MM = 6.0
F_NUMBER = 4.0
LEVEL = 2.5e-4  # radiance of the background, W m-2 sr-1 nm-1: some hundred electrons in green
WORKERS = int(os.environ.get("OMP_NUM_THREADS") or os.cpu_count())
# frames (rows, columns) of the table, numbers of bands, and largest memory of a row
FRAMES = ((270, 480), (540, 960), (1080, 1920), (2160, 3840))
BANDS = (8, 31, 61)
MOST_BYTES = 8e9
# bytes per tile and band in memory, float32: scene, half a kernel of four times as many tiles, and
# irradiance
CUBES_BYTES = 4 + 8 + 4
GROUP_BYTES = 2.1e9  # largest size of these cubes at a time; more bands are imaged in groups
GROUP_CACHE_BYTES = 1 << 30  # size of the kernels of groups that are kept in memory
# brightest lamp of the table over the background; with 1e8 small frames are imaged band by band
TABLE_LAMP = 1e6
# targets at 1080 x 1920 x 31: irradiance without stored kernels, memory with the scene
COLD_S = 11.0
COLD_CPU_S = 16.0
COLD_BYTES = 1.4e9
WITH_PHASE = 3.0  # factor on the targets of time with a wavefront
# CPU seconds over those of the program: irradiance, photocurrent
SHARE = 0.65
STRAIGHT_SHARE = 0.25
NOISE_SHARE = 0.1, 0.2  # error of photocurrent over the noise, below full well and above
FULL_WELL_E = 1e5


@dataclass(frozen=True)
class Case:
    """A frame and its bands."""

    rows: int = 1080
    columns: int = 1920
    bands: int = 31
    aberrated: bool = False

    @property
    def bands_nm(self):
        """Centres of the bands, nm."""
        return np.linspace(FIRST_NM, LAST_NM, self.bands)

    @property
    def values(self) -> int:
        """Number of tiles times bands."""
        return self.rows * self.columns * self.bands

    def groups(self) -> list[slice]:
        """Return the groups of bands that are imaged together."""
        count = int(np.ceil(CUBES_BYTES * self.values / GROUP_BYTES))
        borders = np.linspace(0, self.bands, count + 1).round().astype(int)
        return [slice(first, last) for first, last in zip(borders, borders[1:])]


def bump(bands_nm, centre, width):
    """Return a Gaussian line over the bands."""
    return np.exp(-0.5 * ((bands_nm - centre) / width) ** 2)


def lights(bands_nm):
    """Return spectra of the night: sky, halogen, sodium, mercury, white LED; (light, band),
    mean 1.
    """

    def line(centre, width):
        return bump(bands_nm, centre, width)

    micron = bands_nm * 1e-3
    planck = [micron**-5 / np.expm1(14388 / (micron * t)) for t in (9000, 3000)]
    lines = [
        0.03 + line(589, 7) + 0.4 * line(568, 4) + 0.5 * line(616, 4),
        0.02 + line(436, 3) + line(546, 3) + 0.8 * line(578, 3),
    ]
    out = np.stack([*planck, *lines, line(452, 9) + 0.7 * line(560, 55)])
    return out / out.mean(1, keepdims=True)


def materials(bands_nm):
    """Return reflectances (material, band): asphalt, concrete, grass, red, blue, yellow."""

    def rise(at, width):
        return 1 / (1 + np.exp((at - bands_nm) / width))

    return np.stack(
        [
            0.08 + 0.02 * rise(600, 80),
            0.3 + 0.1 * rise(520, 60),
            0.05 + 0.1 * bump(bands_nm, 550, 25) + 0.4 * rise(690, 10),
            0.05 + 0.6 * rise(600, 12),
            0.04 + 0.4 * bump(bands_nm, 455, 30),
            0.06 + 0.7 * rise(515, 12),
        ]
    )


def night(case: Case, lamp=1e8):
    """Return mixed radiance float32: materials under five lights over two decades, 40 lamps up to
    `lamp` times as bright, 0.5 % noise.
    """
    from isethdr_core.quantities import RADIANCE, centres, plane

    height = case.rows
    width = case.columns
    bands_nm = case.bands_nm
    rng = np.random.default_rng(3)
    spectra = lights(bands_nm)
    y, x = np.mgrid[:height, :width].astype(np.float32)
    kind = (
        rng.integers(0, 6, (-(-height // 30), -(-width // 40)))
        .repeat(30, 0)
        .repeat(40, 1)[:height, :width]
    )
    waves = [
        sum(np.sin(x * a + y * b + c) for a, b, c in rng.uniform(0.002, 0.03, (4, 3)))
        for _ in spectra
    ]
    amounts = np.stack(
        [10 ** (0.5 * wave - shade) for wave, shade in zip(waves, (1.0, 0.5, 0.5, 1.0, 0.8))]
    )
    values = np.empty((case.bands, height, width), np.float32)
    seen = spectra[:, None] * materials(bands_nm)
    for band in range(case.bands):
        values[band] = sum(
            amount * part[kind]
            for amount, part in zip(amounts, seen[:, :, band].astype(np.float32))
        )
    values /= np.median(values.mean(0))
    for size in rng.choice([1, 1, 3, 9], 40):
        i = int(rng.uniform(0, height - size))
        j = int(rng.uniform(0, width - size))
        values[:, i : i + size, j : j + size] += (
            lamp * 10 ** -rng.uniform(0, 3) * spectra[rng.integers(1, 5)]
        )[:, None, None]
    for band in values:
        band *= (1 + 0.005 * rng.standard_normal((height, width), np.float32)) * np.float32(LEVEL)
    step = PITCH_UM * 1e-3 / FOCAL_MM
    return plane(
        values,
        bands_nm,
        centres(width, width * step),
        centres(height, height * step),
        RADIANCE,
        field_width=width * step,
        field_height=height * step,
    )


def optics(aberrated=False):
    """Return the lens and its flares."""
    from isethdr_core.plugins.registry import build

    name, more = (
        ("wavefront", {"zernike_um": {7: 0.05}}) if aberrated else ("diffraction_limited", {})
    )
    return build("lens", name, f_number=F_NUMBER, focal_length_mm=FOCAL_MM, **more), (
        build("flare", "aperture"),
    )


def camera():
    """Return the sensor, and the response that it adds to the demand."""
    from isethdr_core.demand import Demand
    from isethdr_core.plugins.registry import build

    sensor = build("sensor", "bayer", pitch_um=PITCH_UM)
    return sensor, sensor.narrow(Demand()).response


def aperture(samples=1024):
    """Return the pupil's amplitude on a square grid across the stop."""
    radius = FOCAL_MM / F_NUMBER / 2
    at = ((np.arange(samples) + 0.5) / samples * 2 - 1) * radius
    return np.asarray(optics()[1][0].pupil(at[None, :], at[:, None], 550.0), float) * (
        np.hypot(at[None, :], at[:, None]) < radius
    )


def shared_rule(radiance, bands_nm, pupil):
    """Return irradiance by the rule of image simulators."""
    count, ny, nx = radiance.shape
    n = max(ny + 2 * round(ny / 8), nx + 2 * round(nx / 8))
    oy = (n - ny) // 2
    ox = (n - nx) // 2
    out = np.empty((count, ny, nx))
    padded = np.zeros((n, n))
    for band, wave in enumerate(bands_nm):
        # spacing in the pupil for which a sample of the image is a pixel
        spacing_mm = wave * 1e-3 * FOCAL_MM / (n * PITCH_UM)
        size = min(n, round(FOCAL_MM / F_NUMBER / spacing_mm))
        at = np.arange(size) * len(pupil) // size
        first = (n - size) // 2
        field = np.zeros((n, n), complex)
        field[first : first + size, first : first + size] = pupil[np.ix_(at, at)]
        field = sf.fft2(field, workers=WORKERS, overwrite_x=True)
        spread = field.real**2 + field.imag**2
        spread /= spread.sum()
        otf = sf.rfft2(spread, workers=WORKERS)
        padded[oy : oy + ny, ox : ox + nx] = radiance[band]
        otf *= sf.rfft2(padded, workers=WORKERS)
        out[band] = sf.irfft2(otf, s=(n, n), workers=WORKERS)[oy : oy + ny, ox : ox + nx]
    return out


def private_bytes() -> int:
    """Return the private memory of this process, bytes, without mapped files, which are cache."""
    with open("/proc/self/status") as status:
        return next(int(line.split()[1]) * 1024 for line in status if line.startswith("RssAnon"))


def clocked(call):
    """Return wall seconds, CPU seconds, and the peak of private bytes: above those before the call,
    and in total.
    """
    # return the memory that earlier calls freed, so that it counts when it is allocated again
    ctypes.CDLL(None).malloc_trim(0)
    before = private_bytes()
    peak = [0]
    done = threading.Event()

    def watch():
        while not done.wait(0.004):
            peak[0] = max(peak[0], private_bytes())

    watcher = threading.Thread(target=watch)
    watcher.start()
    wall = time.perf_counter()
    cpu = time.process_time()
    call()
    wall = time.perf_counter() - wall
    cpu = time.process_time() - cpu
    done.set()
    watcher.join()
    return wall, cpu, peak[0] - before, peak[0]


def in_child(function, *args):
    """Return the result of a function in a forked process, which inherits the scene."""
    context = multiprocessing.get_context("fork")
    queue = context.Queue()
    child = context.Process(target=lambda: queue.put(function(*args)))
    child.start()
    result = queue.get()
    child.join()
    return result


def program_row(scene, case: Case):
    """Return the clocking of the program, best of three; kernels and transforms exist already."""
    from isethdr_optics.psf.kernels import KernelRequest, kernels

    lens, flares = optics(case.aberrated)
    reach = (case.rows - 1, case.columns - 1)
    bands = kernels(KernelRequest(lens, flares, case.bands_nm, (PITCH_UM, PITCH_UM), reach)).bands
    size = transform_size(case)
    transfer = np.empty((case.bands, size[0], size[1] // 2 + 1), complex)
    for band, kernel in zip(transfer, bands):
        band[...] = transfer_function(kernel, size)
    del bands
    return min(clocked(lambda: program(scene.values, transfer, size)) for _ in range(3))


def transform_size(case: Case) -> tuple[int, int]:
    """Return the size of the program's transforms."""
    return tuple(sf.next_fast_len(2 * n, real=True) for n in (case.rows, case.columns))


def transfer_function(kernel, size):
    """Return the transform of a kernel of odd size, its centre in the middle."""
    padded = np.zeros(size)
    rows, columns = kernel.shape
    padded[:rows, :columns] = kernel
    padded = np.roll(padded, (-(rows // 2), -(columns // 2)), (0, 1))
    return sf.rfft2(padded, workers=WORKERS)


def program_bytes(case: Case) -> float:
    """Return the memory of the program with its transfer functions and the scene, bytes."""
    rows, columns = transform_size(case)
    return case.bands * (16.0 * rows * (columns // 2 + 1) + 12.0 * case.rows * case.columns)


def program_of_any_kernel(scene, case: Case):
    """Return the clocking of the program, best of two, with a kernel that falls with the third
    power of the distance. The time does not depend on the kernel.
    """
    y, x = np.mgrid[1 - case.rows : case.rows, 1 - case.columns : case.columns]
    kernel = (1 + np.hypot(y, x)) ** -3.0
    size = transform_size(case)
    transfer = np.empty((case.bands, size[0], size[1] // 2 + 1), complex)
    transfer[...] = transfer_function(kernel / kernel.sum(), size)
    del y, x, kernel
    return min(clocked(lambda: program(scene.values, transfer, size)) for _ in range(2))


def program(radiance, transfer, size):
    """Return irradiance by a plain convolution with given transfer functions."""
    _, ny, nx = radiance.shape
    out = np.empty(radiance.shape)
    for band, light in enumerate(radiance):
        rows = sf.rfft(light.astype(float), size[1], axis=1, workers=WORKERS)
        spectrum = sf.fft(rows, size[0], axis=0, workers=WORKERS, overwrite_x=True)
        spectrum *= transfer[band]
        rows = sf.ifft(spectrum, axis=0, workers=WORKERS, overwrite_x=True)[:ny]
        out[band] = sf.irfft(rows, size[1], axis=1, workers=WORKERS)[:, :nx]
    return out


def rule_row(scene, case: Case):
    """Return the clocking of the shared rule."""
    pupil = aperture()
    return clocked(lambda: shared_rule(scene.values, case.bands_nm, pupil))


def our_rows(scene, case: Case, repeats=3):
    """Return the clockings of irradiance and of photocurrent: of the first image of a process, and
    of the best of `repeats` more. No kernels are stored on disk.
    """
    lens, flares = optics(case.aberrated)
    _, response = camera()
    groups = [scene.isel(wavelength=bands) for bands in case.groups()]

    def irradiance():
        for group in groups:
            lens(group, flares)

    def photocurrent():
        for group in groups:
            lens.photocurrent(group, flares, response)

    ways = {"irradiance": irradiance, "photocurrent": photocurrent}
    with tempfile.TemporaryDirectory() as folder:
        os.environ["ISETHDR_HOME"] = folder
        return {
            name: (
                clocked(way),
                min((clocked(way) for _ in range(repeats)), key=lambda row: row[1]),
            )
            for name, way in ways.items()
        }


def our_rows_by(library: str, scene, case: Case):
    """Return `our_rows` with the transforms of one library. The second image of a process makes the
    transforms of the kernels, and the third one reuses them.
    """
    from isethdr_optics.psf.kernels import lookup

    from isethdr_core.physics.convolution import fourier

    if library == "SciPy":
        fourier.duccs = None
    if len(case.groups()) > 1:
        lookup.CACHE_BYTES = GROUP_CACHE_BYTES
    return our_rows(scene, case, 2)


def errors(scene, aberrated):
    """Return the largest differences between photocurrent computed directly and from irradiance by
    the same kernels, in standard deviations of the noise: below full well, and above it.
    """
    lens, flares = optics(aberrated)
    sensor, response = camera()
    short = lens.photocurrent(scene, flares, response)
    if "channel" not in short.dims:
        return float("nan"), float("nan")
    short = sensor.expected(short).values
    long = sensor.expected(
        replace(lens.plan(flares, scene, response), response=None, error_allowed=0.0).image(scene)
    ).values
    share = np.abs(short - long) / np.sqrt(long + response.read_noise_e**2)
    return share[long < FULL_WELL_E].max(initial=0.0), share[long >= FULL_WELL_E].max(initial=0.0)


def show(name, rows, base=None):
    """Print the worst clocking of all turns, and the worst ratio to the CPU seconds of `base`."""
    wall, cpu, held = (max(row[k] for row in rows) for k in range(3))
    share = f"  {worst_share(rows, base):.2f} of its CPU" if base else ""
    print(
        f"{name:32s} {wall:7.2f} s wall {cpu:7.2f} s CPU {held / 2**20:7.0f} MiB{share}"
        f"  load {os.getloadavg()[0]:.1f}",
        flush=True,
    )


def worst_share(rows, base):
    """Return the largest ratio of CPU seconds within one turn."""
    return max(row[1] / other[1] for row, other in zip(rows, base))


def table(largest: int) -> None:
    """Print the cost of frames of up to `largest` rows against their size and bands."""
    from isethdr_optics.psf import kernel_store
    from isethdr_optics.psf.kernels import KernelRequest

    from isethdr_core.physics.convolution import fourier

    libraries = ["SciPy", *["ducc0"] * bool(fourier.duccs)]
    if not fourier.duccs:
        print("ducc0 is not installed (extra `fast`): its rows are left out")
    else:
        print(f"SciPy {version('scipy')}, ducc0 {version('ducc0')}")
    print("anew: first image of a process, kernels included; kept: with its kernels, or transfer")
    print("functions, the best of two; GB: peak of the process, with the scene")
    print(f"{'frame x bands':19s} {'what':30s} {'wall s':>8s} {'CPU s':>8s} {'GB':>8s}")
    for rows, columns in FRAMES:
        for bands in BANDS:
            case = Case(rows, columns, bands)
            if rows > largest:
                continue
            scene = night(case, TABLE_LAMP)
            # compute the digests of the code once, for all forked processes
            kernel_store.name(KernelRequest(*optics(), case.bands_nm, (1.0, 1.0), (1, 1)))
            name = f"{rows} x {columns} x {bands}"
            if program_bytes(case) > MOST_BYTES:
                print(
                    f"{name:19s} SciPy program: needs {program_bytes(case) / 1e9:.1f} GB, not run"
                )
            else:
                row = in_child(program_of_any_kernel, scene, case)
                print_row(name, "SciPy program, kept", row)
            for library in libraries:
                ours = in_child(our_rows_by, library, scene, case)
                anew, kept = ours["irradiance"]
                print_row(name, f"irradiance, anew, {library}", anew)
                print_row(name, f"irradiance, kept, {library}", kept)
                print_row(name, f"photocurrent, kept, {library}", ours["photocurrent"][1])
            if len(case.groups()) > 1:
                print(f"{name:19s} imaged in {len(case.groups())} groups of bands, whose kernels")
                print(f"{'':19s} come from the disk where memory does not keep all")
            del scene


def print_row(name: str, what: str, row) -> None:
    """Print one clocking."""
    wall, cpu, _, peak_bytes = row
    print(f"{name:19s} {what:30s} {wall:8.2f} {cpu:8.2f} {peak_bytes / 1e9:8.2f}", flush=True)


def compare(case: Case, turns=3) -> int:
    """Print the figures; return 1 if a target is missed."""
    from isethdr_optics.psf import kernel_store
    from isethdr_optics.psf.kernels import KernelRequest

    aberrated = case.aberrated
    scene = night(case)
    # compute the digests of the code once, for all forked processes
    kernel_store.name(KernelRequest(*optics(aberrated), case.bands_nm, (1.0, 1.0), (1, 1)))
    programs = []
    rules = []
    ours = []
    for _ in range(turns):
        ours.append(in_child(our_rows, scene, case))
        rules.append(in_child(rule_row, scene, case))
        programs.append(in_child(program_row, scene, case))
    below, above = in_child(errors, scene, aberrated)
    cold, warm = ([one["irradiance"][k] for one in ours] for k in (0, 1))
    straight = [one["photocurrent"][1] for one in ours]
    show("SciPy, transfer functions kept", programs)
    show("shared rule, everything anew", rules)
    show("irradiance from nothing", cold)
    show("irradiance, kernels in memory", warm, programs)
    show("photocurrent, kernels in memory", straight, programs)
    print(
        f"irradiance from nothing: {worst_share(cold, rules):.2f} of the rule's CPU seconds; all"
        f" that it holds with the scene {(max(c[2] for c in cold) + scene.nbytes) / 1e9:.2f} GB"
    )
    if np.isnan(below):
        print("photocurrent: imaged band by band, because the error that the kernels state leaves")
        print("too little of the error allowed for functionals of the spectrum")
    else:
        print(
            f"photocurrent against irradiance: {below:.3f} of the noise below full well,"
            f" {above:.3f} above, at most"
        )
    more = WITH_PHASE if aberrated else 1.0
    targets = {
        f"irradiance from nothing within {more * COLD_S:g} s": max(c[0] for c in cold)
        <= more * COLD_S,
        f"within {more * COLD_CPU_S:g} CPU s": max(c[1] for c in cold) <= more * COLD_CPU_S,
        "within the rule's CPU seconds": aberrated or worst_share(cold, rules) <= 1,
        f"within {COLD_BYTES / 1e9:g} GB": aberrated
        or max(c[2] for c in cold) + scene.nbytes <= COLD_BYTES,
        f"irradiance, kernels in memory, within {SHARE:g} of the program": worst_share(
            warm, programs
        )
        <= SHARE,
        f"photocurrent within {STRAIGHT_SHARE:g} of the program": worst_share(straight, programs)
        <= STRAIGHT_SHARE,
    }
    if not np.isnan(below):
        targets |= {
            f"photocurrent within {NOISE_SHARE[0]:g} of the noise below full well": below
            <= NOISE_SHARE[0],
            f"photocurrent within {NOISE_SHARE[1]:g} of the noise above full well": above
            <= NOISE_SHARE[1],
        }
    for target, met in targets.items():
        print(f"{'met' if met else 'missed'}: {target}")
    return int(not all(targets.values()))


def main() -> int:
    """Run the comparison or the table that the command line selects."""
    parser = argparse.ArgumentParser(description="Speed of the lens over many bands.")
    parser.add_argument("--rows", type=int, default=1080, help="tiles along y")
    parser.add_argument("--columns", type=int, default=1920, help="tiles along x")
    parser.add_argument("--bands", type=int, default=31, help="bands from 400 to 700 nm")
    parser.add_argument("--aberrated", action="store_true", help="with a wavefront: coma")
    parser.add_argument("--table", action="store_true", help="cost against frame size and bands")
    parser.add_argument("--largest", type=int, default=2160, help="rows of the table's frames")
    args = parser.parse_args()
    if args.table:
        table(args.largest)
        return 0
    return compare(Case(args.rows, args.columns, args.bands, args.aberrated))


if __name__ == "__main__":
    sys.exit(main())
