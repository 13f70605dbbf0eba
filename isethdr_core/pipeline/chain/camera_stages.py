"""Camera stages: from the light on the sensor plane to the scores of one camera."""

from __future__ import annotations

from dataclasses import replace
from functools import partial
from typing import TYPE_CHECKING, Any

from ...data.derived_once import read_only, shared
from ...data.reference_picture import labels_on, truth
from ...uncertainty import ledger
from ...uncertainty.ledger import Ledger
from ..shot import CameraShot, Shot, developed
from .camera import Camera, CameraAtWork
from .camera_scores import averaged_scores, first_scores
from .picture_error import state_picture
from .side_by_side import sharing, side_by_side, threads_for
from .stages import stage

if TYPE_CHECKING:
    from .components import Chain


def camera_threads(chain: Chain) -> int:
    """Return how many threads work on the cameras of a chain.

    Parameters
    ----------
    chain : components of the run.
    """
    return threads_for((*chain.cameras.values(), chain.isp, *chain.metrics.values()))


def through_cameras(chain: Chain, rows: Ledger, shot: Shot) -> dict[str, Camera]:
    """Return the results of all cameras by name, computed by as many threads as there are
    processors if all components allow it.

    Parameters
    ----------
    chain : components of the run.
    rows : ledger that gets the rows of the cameras' stages, camera by camera.
    shot : light on the sensor plane, its reference, and the noise key of the shot.
    """
    own_rows = {name: Ledger(rows) for name in chain.cameras}
    parts = [partial(through_camera, chain, own, name, shot) for name, own in own_rows.items()]
    with sharing(camera_threads(chain)):
        cameras = side_by_side(parts)
    before = len(rows)
    for own in own_rows.values():
        rows += own[before:]
    return dict(zip(own_rows, cameras, strict=True))


def through_camera(chain: Chain, rows: Ledger, name: str, shot: Shot) -> Camera:
    """Return the results of one camera, with its scores against the reference picture.

    Parameters
    ----------
    chain : components of the run.
    rows : ledger that gets the rows of the camera's stages.
    name : name of the camera in the config.
    shot : light on the sensor plane, its reference, and the noise key of the shot.
    """
    work = CameraAtWork(chain, rows, name, CameraShot(shot, chain.cameras[name], chain.isp))
    captures = captured(work)
    picture = processed(work, captures)
    with ledger.stage(rows, f"truth {name}"):
        reference = truth(shot.reference, picture)
        labels = labels_on(shot.scene, picture)
    camera = Camera(captures, read_only(picture), read_only(reference), read_only(labels))
    # Metrics get Datasets of their own: a variable that one of them adds or replaces is not stored.
    # All metrics get the same, by which `once` knows results that they share.
    scored = replace(
        camera,
        picture=camera.picture.copy(deep=False),
        truth=camera.truth.copy(deep=False),
        labels=camera.labels.copy(deep=False),
    )
    with shared(scored.truth, scored.labels, shot.light, scored.picture):
        scored.scores_of = first_scores(work, scored)
        camera.scores = averaged_scores(work, scored)
    camera.scores_of = scored.scores_of
    state_picture(work, camera)
    return camera


def captured(work: CameraAtWork) -> Any:
    """Return the captures of the first noise realisation, a stage of the run."""
    shot = work.shot.shot
    sensor = work.shot.sensor
    return stage(
        work.rows,
        "sensor",
        work.name,
        sensor,
        lambda: sensor(shot.light, shot.generator),
        work.shot.kept_captures(),
    )


def processed(work: CameraAtWork, captures: Any) -> Any:
    """Return the picture that the isp makes of the captures, a stage of the run."""
    isp = work.chain.isp
    return stage(
        work.rows,
        "isp",
        work.name,
        isp,
        lambda: developed(isp, captures),
        work.shot.kept_picture(),
    )
