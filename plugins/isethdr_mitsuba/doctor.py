"""Doctor: tests in a child process which Mitsuba variants work on this machine, and says what to
install.
"""

from __future__ import annotations

import glob
import importlib.metadata
import json
import os
import platform
import subprocess
import sys
from functools import cache
from pathlib import Path

from isethdr_core.errors import ConfigError

from .llvm import use_unpacked

VARIANTS = {"cuda": "cuda_ad_spectral", "llvm": "llvm_ad_spectral", "scalar": "scalar_spectral"}
HELP = {
    "llvm": (
        "install LLVM 17 or newer (tested: 19), for example `apt-get install libllvm19`, or set"
        " DRJIT_LIBLLVM_PATH to its libLLVM.so; LLVM 15 and 16 stop the process with Mitsuba 3.9.1"
    ),
    "cuda": "needs an NVIDIA graphics card with a driver of version 535 or newer",
    "scalar": "reinstall mitsuba: `pip install --force-reinstall 'isethdr[mitsuba]'`",
}
NOT_INSTALLED = "is not installed; type pip install 'isethdr[mitsuba]'"
PROBE_S = 300.0  # longest time of a test
# a small scene with compiled code that fails with old LLVM versions
PROBE = """
import sys, mitsuba as mi
mi.set_variant(sys.argv[1])
import drjit as dr, numpy as np
scene = mi.load_dict({'type': 'scene', 'a': {'type': 'sphere'}, 'e': {'type': 'constant'},
    'i': {'type': 'path', 'max_depth': 3},
    's': {'type': 'perspective', 'to_world': mi.ScalarTransform4f().look_at(
        origin=[0, 0, 4], target=[0, 0, 0], up=[0, 1, 0]),
          'film': {'type': 'hdrfilm', 'width': 4, 'height': 4}}}, optimize=False)
image = np.array(mi.render(scene, spp=4))
if dr.is_jit_v(mi.Float):
    image = image + np.array(dr.maximum(mi.Float([1., 2.]), 1.5)).sum()
assert np.isfinite(image).all()
"""


def choose_variant(requested: str) -> str:
    """Return the Mitsuba variant for "auto", "cuda", "llvm" or "scalar".

    Raises
    ------
    ConfigError : mitsuba is not installed, or the requested variant does not work here.
    """
    working = doctor()
    if not working["mitsuba"]:
        raise ConfigError(
            "renderer mitsuba needs the package mitsuba, which is not installed; type pip install"
            " 'isethdr[mitsuba]'"
        )
    chosen = requested
    if requested == "auto":
        chosen = next(name for name in VARIANTS if working[name] == "works" or name == "scalar")
    if working[chosen] != "works":
        instead = "" if requested == "auto" else "; or type renderer.variant=auto"
        raise ConfigError(
            f"renderer variant {chosen!r} does not work here: {working[chosen]};"
            f" {HELP[chosen]}{instead}"
        )
    return VARIANTS[chosen]


@cache
def doctor() -> dict[str, str]:
    """Return {"mitsuba": version or "", "cuda": ..., "llvm": ..., "scalar": ...}. The value of each
    variant is "works" or the error message.

    Each variant is tried in a child process, because some LLVM versions abort the process. That
    costs seconds, so the answer is kept in the user's cache folder until Mitsuba, the LLVM
    libraries or CUDA_VISIBLE_DEVICES change.
    """
    try:
        version = importlib.metadata.version("mitsuba")
    except importlib.metadata.PackageNotFoundError:
        return {"mitsuba": "", **dict.fromkeys(VARIANTS, "mitsuba is not installed")}
    use_unpacked()
    key = json.dumps(
        [
            version,
            platform.node(),
            sys.executable,
            os.environ.get("DRJIT_LIBLLVM_PATH", ""),
            os.environ.get("CUDA_VISIBLE_DEVICES"),
            _llvm_libraries(),
        ]
    )
    stored = _read()
    if stored.get("key") != key:
        stored = {
            "key": key,
            "found": {"mitsuba": version, **{name: _probe(v) for name, v in VARIANTS.items()}},
        }
        _write(stored)
    return stored["found"]


def doctor_command(fresh: bool = False) -> None:
    """Show which renderer variants work, and what the others lack.

    The answer is kept for later calls; --fresh tests the variants again.
    """
    if fresh:
        _write({})
        doctor.cache_clear()
    working = doctor()
    print(f"mitsuba {working['mitsuba'] or NOT_INSTALLED}")
    for name in VARIANTS:
        print(
            f"{name:7s} {working[name]}"
            + ("" if working[name] == "works" else f"\n        {HELP[name]}")
        )


def _probe(variant: str) -> str:
    try:
        done = subprocess.run(
            [sys.executable, "-c", PROBE, variant],
            check=False,
            capture_output=True,
            text=True,
            timeout=PROBE_S,
        )
    except subprocess.TimeoutExpired:
        return f"no result after {PROBE_S:g} s"
    if done.returncode == 0:
        return "works"
    last = (done.stderr.strip().splitlines() or ["no message"])[-1]
    return f"exit status {done.returncode}: {last[:200]}"


def _llvm_libraries() -> list[str]:
    folders = ("/usr/lib/*", "/usr/lib/llvm-*/lib", "/usr/lib64", "/opt/homebrew/opt/llvm/lib")
    return sorted(path for folder in folders for path in glob.glob(f"{folder}/libLLVM*.so*"))


def _file() -> Path:
    return (
        Path(os.environ.get("XDG_CACHE_HOME") or Path.home() / ".cache")
        / "isethdr"
        / "mitsuba_variants.json"
    )


def _read() -> dict[str, dict[str, str] | str]:
    try:
        return json.loads(_file().read_text())
    except (OSError, ValueError):
        return {}


def _write(content: dict[str, dict[str, str] | str]) -> None:
    try:
        _file().parent.mkdir(parents=True, exist_ok=True)
        _file().write_text(json.dumps(content))
    except OSError:
        pass  # without a writable home folder, the probe runs again next time
