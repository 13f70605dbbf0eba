"""Kernel store: processes share its files, damaged files are computed again, and a name depends on
everything that determines the kernels.
"""

import dataclasses
import os
import subprocess
import sys

import numpy as np
import pytest
from isethdr_optics import ApertureFlare, DiffractionLimitedLens, PrescribedLens, WavefrontLens
from isethdr_optics.psf import kernel_store, kernels
from isethdr_optics.psf.kernels import KernelRequest, computing, lookup

BANDS = np.array([500.0, 600.0])
SAMPLING = (BANDS, (3.0, 3.0), (30, 40))
LENS = DiffractionLimitedLens()  # without flares, its kernels here have a closed form
FLARES = (ApertureFlare(),)
OTHER = {
    float: lambda v: v * 0.9 + 0.01,
    int: lambda v: v + 1,
    bool: lambda v: not v,
    dict: lambda v: {4: 0.01},
    tuple: lambda v: (v[0] * 0.9, *v[1:]),
}
SCRIPT = """
from isethdr_optics.psf import kernel_store, kernels
from isethdr_optics.psf.kernels import KernelRequest
from test_kernel_store import LENS, SAMPLING
kernel_store.WORTH_KEEPING_S = 0.0
made = kernels.kernels(KernelRequest(LENS, (), *SAMPLING))
print(repr(float(made.bands[1].sum(dtype=float))))
"""


@pytest.fixture(autouse=True)
def everything_is_kept(monkeypatch):
    monkeypatch.setattr(kernel_store, "WORTH_KEEPING_S", 0.0)
    kernels.forget()


def fresh_kernels(monkeypatch=None):
    """Return kernels with an empty memory cache; with `monkeypatch`, computing kernels fails."""
    kernels.forget()
    if monkeypatch:
        monkeypatch.setattr(computing, "computed", None)
    return kernels.kernels(KernelRequest(LENS, (), *SAMPLING))


def files(home):
    return sorted((home / "kernels").glob("*"))


def started():
    folder = os.path.dirname(__file__)
    return subprocess.Popen(
        [sys.executable, "-c", SCRIPT],
        stdout=subprocess.PIPE,
        text=True,
        cwd=folder,
    )


@pytest.mark.slow
def test_three_processes_share_one_file(isethdr_home, monkeypatch):
    both = [started() for _ in range(2)]
    sums = [float(p.communicate(timeout=600)[0]) for p in both]
    assert len(files(isethdr_home)) == 1  # one name, and no temporary file is left
    third = fresh_kernels(monkeypatch)  # read from the file: computing kernels would fail
    assert [float(third.bands[1].sum(dtype=float))] * 2 == sums


@pytest.mark.slow
def test_bands_of_an_interrupted_run_are_not_computed_again(monkeypatch, isethdr_home):
    band = kernels.BandPlan.band
    done = []

    def one(plan, centre, width):
        if done and centre not in done:
            raise KeyboardInterrupt
        done.append(centre)
        return band(plan, centre, width)

    whole = kernels.computed(KernelRequest(LENS, (), *SAMPLING))
    monkeypatch.setattr(kernels.BandPlan, "band", one)
    monkeypatch.setenv("OMP_NUM_THREADS", "1")
    with pytest.raises(KeyboardInterrupt):
        fresh_kernels()
    assert done == [500.0] and len(files(isethdr_home)) == 1
    monkeypatch.setattr(
        kernels.BandPlan,
        "band",
        lambda plan, centre, width: done.append(centre) or band(plan, centre, width),
    )
    found = fresh_kernels()
    assert done == [500.0, 600.0]  # only the second band was computed
    [file] = files(isethdr_home)  # one file of both bands; the file of one band was removed
    assert kernel_store.PART not in file.name
    for name in ("speckle", "deviation", "transmitted", "core", "outside"):
        np.testing.assert_array_equal(getattr(found, name), getattr(whole, name))
    for have, want in zip(found.bands, whole.bands):
        np.testing.assert_array_equal(have, want)


def test_stored_kernels_equal_computed_kernels(monkeypatch):
    computed = kernels.computed(KernelRequest(LENS, (), *SAMPLING))
    fresh_kernels()
    back = fresh_kernels(monkeypatch)
    assert all(isinstance(b, np.memmap) for b in back.bands)
    assert back.held_bytes == 0
    for a, b in zip(computed.bands, back.bands):
        np.testing.assert_array_equal(a, b)
    for fact in ("outside", "speckle", "transmitted", "wrap"):
        np.testing.assert_array_equal(getattr(computed, fact), getattr(back, fact))


@pytest.mark.slow
@pytest.mark.parametrize("where", ["cut", "facts", "kernels", "empty", "text"])
def test_a_damaged_file_is_computed_again(isethdr_home, where):
    want = [np.array(b) for b in fresh_kernels().bands]
    (path,) = files(isethdr_home)
    content = bytearray(path.read_bytes())
    if where in ("facts", "kernels"):
        content[{"facts": -150, "kernels": len(content) // 2}[where]] ^= 64
    else:
        content = {"cut": content[:-10], "empty": b"", "text": b"no kernels"}[where]
    path.unlink()
    path.write_bytes(content)
    assert kernel_store.load(path.stem) is None
    for a, b in zip(want, fresh_kernels().bands):
        np.testing.assert_array_equal(a, b)
    assert kernel_store.load(path.stem) is not None  # the damaged file was replaced


@pytest.mark.parametrize(
    "component", [WavefrontLens(), ApertureFlare()], ids=lambda c: type(c).__name__
)
def test_the_name_changes_with_any_field(component):
    def name(c):
        lens, flares = (c, FLARES) if isinstance(c, WavefrontLens) else (LENS, (c,))
        return kernel_store.name(KernelRequest(lens, flares, *SAMPLING))

    names = [name(component)]
    for field in dataclasses.fields(component):
        value = getattr(component, field.name)
        if isinstance(value, str):
            new = {
                "tangent": "aplanatic",
                "cos4": "none",
                "hyperfocal": 3.0,
                "none": {"model": "brown_conrady", "k1": 0.1},
            }[value]
        elif value == float("inf"):
            new = 2.0
        elif field.name == "field_zernike_um":
            new = {0: {}, 20: {4: 0.01}}
        elif field.name in ("focal_shift_um", "lateral_colour_percent"):
            new = {450.0: 0.01}
        else:
            new = OTHER[type(value)](value)
        names.append(name(dataclasses.replace(component, **{field.name: new})))
    assert None not in names
    assert len(set(names)) == len(names)


def test_the_name_changes_with_sampling_class_and_code(monkeypatch):
    def name(lens=LENS, flares=FLARES, sampling=SAMPLING):
        return kernel_store.name(KernelRequest(lens, flares, *sampling))

    names = {
        name(),
        name(lens=WavefrontLens()),
        name(flares=()),
        name(sampling=(BANDS + 1, *SAMPLING[1:])),
        name(sampling=(BANDS, (3.0, 3.1), (30, 40))),
        name(sampling=(BANDS, (3.0, 3.0), (30, 41))),
    }
    assert len(names) == 6
    monkeypatch.setattr(
        kernel_store.provenance, "fingerprint", lambda *a, **k: {"isethdr_optics": "other code"}
    )
    assert name() not in names


@pytest.mark.slow
def test_kernels_are_computed_where_the_store_cannot_be_written(tmp_path, monkeypatch):
    (tmp_path / "file").write_text("a file, no folder")
    monkeypatch.setenv("ISETHDR_HOME", str(tmp_path / "file"))
    assert float(fresh_kernels().bands[0].sum()) > 0.5


def test_least_recently_used_files_are_removed_first(isethdr_home, monkeypatch):
    def save(key):
        kernel_store.save(key, (1, 50, 50), "<f4", [np.ones((50, 50))], lambda: np.zeros((4, 1)))

    for i, key in enumerate("abc"):
        save(key)
        os.utime(isethdr_home / "kernels" / f"{key}.npy", (i, i))
    kernel_store.load("a")  # used just now
    monkeypatch.setattr(kernel_store, "LIMIT_BYTES", 25000)  # two of 10 kB
    save("d")
    assert [p.stem for p in files(isethdr_home)] == ["a", "d"]


@pytest.mark.parametrize(
    "old, new",
    [
        (b"'<f4'", b"'>f4'"),  # other numbers from the same bytes
        (b"'<f8'", b"'>f8'"),
        (b"(2, 3, 3)", b"(2, 3, 3 "),  # NumPy raises an error of the tokenizer
        (b"'descr'", b"'descr "),
    ],
)
def test_a_file_with_a_damaged_header_counts_as_absent(isethdr_home, old, new):
    bands = [np.ones((3, 3), np.float32), np.zeros((3, 3), np.float32)]
    kernel_store.save("some", (2, 3, 3), "<f4", bands, lambda: np.ones((4, 2)))
    facts, stored = kernel_store.load("some")
    np.testing.assert_array_equal(stored, bands)
    np.testing.assert_array_equal(facts, 1.0)
    del stored  # the file stays mapped as long as the array exists
    path = isethdr_home / "kernels" / "some.npy"
    path.write_bytes(path.read_bytes().replace(old, new, 1))
    assert kernel_store.load("some") is None


def test_a_changed_prescription_file_is_not_taken_for_the_one_before(bare):
    request = KernelRequest(PrescribedLens(f_number=8.0, prescription=bare), (), *SAMPLING)
    before = lookup._key(request)
    assert lookup._key(request) == before
    with open(bare, "a") as file:
        file.write("source: changed\n")
    assert lookup._key(request) != before
