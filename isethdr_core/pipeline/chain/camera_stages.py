"""Camera stages: from the light on the sensor plane to the scores of one camera."""

from __future__ import annotations

from functools import partial
from typing import TYPE_CHECKING, Any

from ...data.derived_once import shared
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
    import xarray as xr

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
    with shared(camera.truth, camera.labels, shot.light, camera.picture):
        camera.scores_of = first_scores(work, camera)
        camera.scores = averaged_scores(work, camera)
    state_picture(work, camera)
    return camera


def read_only(data: xr.Dataset) -> xr.Dataset:
    """Return a Dataset of the same arrays, which cannot be changed through it. A metric that writes
    into its picture then fails, and the run does not store what it wrote.
    """
    locked = {}
    for name, array in data.data_vars.items():
        view = array.values.view()
        view.flags.writeable = False
        locked[name] = array.copy(deep=False, data=view)
    return data.assign(locked)


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
