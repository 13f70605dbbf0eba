"""Draw error against run time of every integrator, for docs/measured/charge_dynamics.md.

The methods, the light (100 Hz ripple) and the references are those of `charge_dynamics.py`. Run:

    python benchmarks/charge_dynamics_picture.py [picture, a .png file]
"""

from __future__ import annotations

import sys
import warnings

import matplotlib
import numpy as np
from charge_dynamics import (
    LEVELS,
    METHODS,
    STEPS,
    TIMES_SATURATION,
    WELL,
    T,
    light_of,
    reference,
    relative,
    seconds,
    step_costs,
)

from isethdr_core.physics.detector.charge_dynamics import flow_varying
from isethdr_core.physics.detector.temporal_modulation import ripple_s

SHOWN = (0.01, 1.0, 100.0, 1e6)
DEPTH = 0.5
FAILS = 1e2
FLOOR = 1e-16
STYLE = {
    "explicit Euler": "#c0392b",
    "Runge-Kutta 4": "#7f8c8d",
    "exponential Rosenbrock": "#8e5ea2",
    "implicit Euler, omega": "#d68910",
    "exponential, uniform": "#7fb3d5",
    "exponential, graded": "#2c6fad",
}


def exact_ns(level):
    """Return the nanoseconds per pixel of `flow_varying` in a frame of this light."""
    frame = np.full(45000, level)
    return (
        seconds(
            flow_varying,
            0.0,
            lambda s, d: frame * ripple_s(s, d, 100.0, DEPTH, -0.25),
            0.0,
            T,
            WELL,
        )
        / frame.size
        * 1e9
    )


def main(path):
    """Write the picture."""
    matplotlib.use("Agg")
    from matplotlib import pyplot as plt

    warnings.simplefilter("ignore")  # explicit methods overflow, which the picture shows
    costs = step_costs()
    wanted = [reference(level, DEPTH) for level in LEVELS]
    errors = {
        name: np.array(
            [
                relative(
                    method(np.zeros(LEVELS.size), light_of(LEVELS, DEPTH), times(n), WELL), wanted
                )
                for n in STEPS
            ]
        )
        for name, (method, times) in METHODS.items()
    }
    exact = relative(
        flow_varying(0.0, lambda s, d: LEVELS * ripple_s(s, d, 100.0, DEPTH, -0.25), 0.0, T, WELL)[
            0
        ],
        wanted,
    )
    figure, axes = plt.subplots(1, len(SHOWN), figsize=(13, 4.3), sharey=True, layout="constrained")
    for ax, factor in zip(axes, SHOWN, strict=True):
        k = int(np.argmin(np.abs(np.log(TIMES_SATURATION / factor))))
        for name, colour in STYLE.items():
            ax.plot(
                np.array(STEPS) * costs[name],
                np.clip(errors[name][:, k], FLOOR, FAILS),
                "o-",
                ms=3,
                lw=1,
                color=colour,
                label=name,
            )
        ax.plot(
            exact_ns(LEVELS[k]),
            max(exact[k], FLOOR),
            "D",
            ms=9,
            color="black",
            label="flow_varying",
        )
        ax.axhspan(1.0, 2 * FAILS, color="#f3dede", zorder=0)
        ax.set(
            xscale="log",
            yscale="log",
            xlabel="ns per pixel",
            title=f"{factor:g} x saturation",
            ylim=(FLOOR / 5, 2 * FAILS),
        )
        ax.grid(True, color="#eee")
    axes[0].set_ylabel("relative error of the charge; shaded: fails")
    figure.legend(
        *axes[0].get_legend_handles_labels(),
        fontsize=9,
        loc="outside lower center",
        ncols=len(STYLE) + 1,
    )
    figure.savefig(path, dpi=90)


if __name__ == "__main__":
    main(sys.argv[1] if sys.argv[1:] else "docs/images/charge_dynamics.png")
