"""Output of `isethdr plan`: the stages of a run, stored results, and omissions with their
reasons.
"""

from __future__ import annotations

from collections.abc import Sequence

from ..config.composition import compose
from ..motion.run_time import sub_frame_work
from ..pipeline import memory_estimate, runtime_estimate
from ..pipeline.chain import camera_threads, chain, frame_of, plan
from ..runs import radiance_cache, run
from ..storage.home_folder import home
from ..storage.object_home.calls import follow_home
from ..uncertainty.ledger import Ledger
from .summary_tables import memory_text, print_statements, runtime_estimate_table
from .terminal import console as open_console
from .terminal import print_text


def print_plan(overrides: Sequence[str]) -> None:
    """Print the stages that a run would compute, the stored results, and the omissions with their
    reasons.
    """
    console = open_console()
    rows = Ledger()
    config = compose(overrides)
    planned_chain = chain(config)
    follow_home(home())
    demand = plan(planned_chain, rows)
    stored = run.find_run(config, planned_chain)
    if stored:
        console.print(f"run {stored.stem} is stored: nothing to compute")
    console.print(f"light groups  {', '.join(demand.groups) if demand.groups else 'all'}")
    console.print(f"labels        {', '.join(sorted(demand.labels)) or 'none'}")
    bands = demand.wavelength_nm
    console.print(
        f"bands         {f'{len(bands)} from {bands[0]:g} to {bands[-1]:g} nm' if bands else 'all'}"
    )
    window = "all"
    if demand.window_m:
        sides_mm = " x ".join(f"{1e3 * side:.4g}" for side in demand.window_m)
        window = f"{sides_mm} mm of the image plane"
    console.print(f"window        {window}")
    console.print(f"cameras       {', '.join(planned_chain.cameras)}")
    stores, missing = radiance_cache.held_and_missing(planned_chain, demand)
    if planned_chain.renderer is not None:
        groups = sorted({g for s in stores for g in s["groups"]})
        console.print(
            f"radiance      recipe {radiance_cache.recipe_hash(planned_chain)}: "
            + (f"stored groups {', '.join(groups)}" if groups else "nothing stored")
        )
    if not stored:
        plain_config = run.plain(config)
        frame = frame_of(planned_chain, demand)
        moving = sub_frame_work(planned_chain, demand, runtime_estimate.newest("runs"))
        expected = runtime_estimate.expected_s(planned_chain, plain_config, missing, frame, moving)
        if moving is not None:
            console.print(f"sub-frames    {moving.count or 'not known before a first run'}")
        peak = memory_estimate.expected_memory(planned_chain, plain_config, missing, frame)
        if peak is not None:
            print_text(memory_text(peak), hanging=14 * " ")
        console.print(
            runtime_estimate_table(
                {
                    stage: expected.get(stage)
                    for stage in runtime_estimate.stages(planned_chain, plain_config, missing)
                },
                camera_threads(planned_chain),
            )
        )
    print_statements(rows)
