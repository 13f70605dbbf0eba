"""Loss of a detector: focal loss of the centres, overlap and logarithms of the boxes."""

from __future__ import annotations

from ..torch_library import functional, torch

SIDES_WEIGHT = 0.2  # weight of the distance of logarithms; the overlap has the weight 1


def loss_of(
    logits: torch.Tensor, logs: torch.Tensor, targets: tuple[torch.Tensor, ...]
) -> torch.Tensor:
    """Return the loss of a batch.

    Parameters
    ----------
    logits, logs : outputs of the network: logits of centres, and logarithms of distances.
    targets : heat, asked, sides and inside, as in `patches.Targets`.
    """
    heat, asked, sides, inside = targets
    boxes = 1 - overlap(logs, sides)
    distance = functional.smooth_l1_loss(logs, sides, reduction="none").sum(1)
    count = inside.sum().clamp(min=1)
    of_boxes = ((boxes + SIDES_WEIGHT * distance) * inside[:, 0]).sum() / count
    return focal(logits, heat, asked) + of_boxes


def focal(logits: torch.Tensor, heat: torch.Tensor, asked: torch.Tensor) -> torch.Tensor:
    """Return the focal loss of centres (Law and Deng 2018, equation 1, exponents 2 and 4), divided
    by the number of objects.

    Parameters
    ----------
    logits : (n, classes, y, x) outputs of the network.
    heat : (n, classes, y, x) map of centres: 1 at a centre, falling to 0 around it.
    asked : weight of each point, 0 or 1; it broadcasts to `logits`.
    """
    centre = heat == 1
    yes = functional.logsigmoid(logits)
    no = functional.logsigmoid(-logits)
    p = torch.sigmoid(logits)
    of_centres = (1 - p) ** 2 * yes * centre
    of_others = (1 - heat) ** 4 * p**2 * no * ~centre
    return -((of_centres + of_others) * asked).sum() / (centre * asked).sum().clamp(min=1)


def overlap(logs: torch.Tensor, sides: torch.Tensor) -> torch.Tensor:
    """Return the intersection over union (n, y, x) of two boxes around each place.

    Parameters
    ----------
    logs, sides : (n, 4, y, x) logarithms of the distances from the place to the sides of each box.
    """
    ours = logs.exp()
    theirs = sides.exp()
    shared = torch.minimum(ours, theirs)
    both = _area(shared)
    return both / (_area(ours) + _area(theirs) - both)


def _area(distances: torch.Tensor) -> torch.Tensor:
    return (distances[:, 0] + distances[:, 2]) * (distances[:, 1] + distances[:, 3])
