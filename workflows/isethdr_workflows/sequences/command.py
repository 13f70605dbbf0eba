"""The command `isethdr sequence`. It has no slow imports, because every command line loads it."""

from __future__ import annotations

from importlib import import_module

import typer

HELP = """Run the frames of a scene that moves, with automatic exposure carried from frame to frame.

Example: isethdr sequence frames=10 frames_per_second=30 scene=street sensor=typical_bayer.
Settings: frames, frames_per_second, exposure.share_per_frame, exposure.delay_frames,
exposure.most_stops_per_frame, name. Everything else is an override of all frames. A sensor with
exposure_rule=fixed, such as bayer, keeps its exposure. Type the same command again to continue."""
INTERRUPTED = 130  # exit code after Ctrl-C: 128 + SIGINT


def sequence(
    settings: list[str] = typer.Argument(help="key=value, and overrides of all frames"),
    dry_run: bool = typer.Option(False, "--dry-run", help="show frames and expected run time"),
) -> None:
    """Make the frames, or show what would be made."""
    request = import_module(f"{__package__}.request").request_of(settings)
    if dry_run:
        import_module(f"{__package__}.runtime_estimate").print_runtime_estimate(request)
        return
    try:
        made = import_module(f"{__package__}.frames").make(request)
    except KeyboardInterrupt:
        print("interrupted; type the same command again to continue")
        raise typer.Exit(INTERRUPTED) from None
    import_module(f"{__package__}.table").show(made)
