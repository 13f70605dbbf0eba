"""Picture error: the errors of all stages in one camera's picture, in units of the sensor's
noise.
"""

from __future__ import annotations

from ...uncertainty import ledger, propagation
from ...uncertainty.ledger import Row
from .camera import Camera, CameraAtWork


def state_picture(work: CameraAtWork, camera: Camera) -> None:
    """Add the row that states the error of the picture, and the time spent.

    Parameters
    ----------
    work : the camera at work.
    camera : its captures.
    """
    with ledger.stage(work.rows, f"picture {work.name}"):
        if lacking := propagation.missing(camera.captures):
            ledger.error(
                float("inf"),
                propagation.UNIT,
                "bound",
                f"not known: the captures lack {', '.join(lacking)}",
            )
            return
        rows = rows_of_camera(work)
        propagation.record_figures(
            electrons_of(work, camera, rows),
            rows,
            work.chain.allowed.noise_fraction,
            propagation.seconds(work.rows, work.name, work.shot.shot.scene),
        )


def rows_of_camera(work: CameraAtWork) -> list[Row]:
    """Return the rows of the ledger without those of other sensors."""
    own = f"sensor {work.name}"
    return [row for row in work.rows if row.stage == own or not row.stage.startswith("sensor ")]


def electrons_of(
    work: CameraAtWork, camera: Camera, rows: list[Row]
) -> list[propagation.Electrons]:
    """Return the electrons behind each capture and their errors, computed or kept by an earlier
    run.

    Parameters
    ----------
    work : the camera at work.
    camera : its captures.
    rows : rows of the ledger, as `rows_of_camera` returns them.
    """
    leave_out = work.chain.leave_out
    shot = work.shot.shot
    sampled = propagation.regular_sample(camera.captures) if leave_out else camera.captures
    noise = propagation.stated_noise(rows)
    exposure = propagation.Exposure(sampled, shot.light, shot.mixed, shot.scene)

    def computed() -> list[propagation.Electrons]:
        shots = propagation.electrons(exposure, noise, shot.imaging.light_errors)
        return propagation.with_parts(shots, sampled, rows)

    return shot.reuse.value(work.shot.electrons_name([noise, leave_out]), computed)
