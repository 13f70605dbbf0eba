"""Joints of a rider: seated on the saddle, hands on the grips, feet on pedals, pegs or floor."""

from __future__ import annotations

from dataclasses import replace

import numpy as np

from ...geometry.mesh.piece import unit
from ...geometry.road_users.poses import two_bone
from ..riding import RidingPosition
from .body import ANKLE_M, SIDES, Body, Joints, spine

BALL_M = 0.105  # distance from the ankle forward to the ball of the foot, for a height of 1.76 m
PALM_M = 0.075  # distance from the wrist to the middle of a closed hand, for this height
SEATED_M = 0.095  # height of the pelvis above the saddle, for this height and girth 1
FOOT_DEG = -10.0  # pitch of a foot, toe up; the heel is slightly higher than the toe
LEANS_DEG = np.arange(-6.0, 48.0, 1.0)
SLIDES_M = np.arange(0.0, 0.36, 0.02)  # slides forward on the saddle, tried if leans do not suffice
STRETCHED = 0.93  # largest distance of shoulder and grip / length of the arm; arms stay bent
TALLEST_M = 2.05
ROUNDING_M = 1e-9  # length that exceeds the rounding error of any distance


def seated(body: Body, position: RidingPosition) -> tuple[Body, Joints]:
    """Return the body and its joints in the coordinates of the vehicle, m.

    The back leans forward until the arms reach the grips. If leaning is not enough, the rider also
    slides forward. A body with legs that are too short for the vehicle is replaced by a taller one
    of the same build, because riders choose vehicles that fit them.
    """
    at = _leaning(body, position)
    while body.height_m < TALLEST_M and not _reaches(body, at["pelvis"], position):
        body = replace(body, height_m=body.height_m + 0.02)
        at = _leaning(body, position)
    pelvis = at["pelvis"]
    for tag, side in SIDES:
        hip, ankle, foot = _leg(body, pelvis, position, side)
        bend = np.array([1.0, 0.15 * side, 0.3])
        at |= {
            f"hip_{tag}": hip,
            f"knee_{tag}": two_bone(hip, ankle, body.thigh_m, body.shin_m, bend),
            f"ankle_{tag}": ankle,
            f"foot_{tag}": foot,
        }
        elbow, wrist = _arm(body, at[f"shoulder_{tag}"], _grip(position, side), side)
        at |= {f"elbow_{tag}": elbow, f"wrist_{tag}": wrist}
    return body, at


def _grip(position: RidingPosition, side: float) -> np.ndarray:
    return np.asarray(position.grips[0 if side > 0 else 1], float)


def _pelvis(body: Body, position: RidingPosition) -> np.ndarray:
    return np.asarray(position.saddle, float) + [0.0, 0.0, SEATED_M * body.scale * body.girth]


def _leg(
    body: Body, pelvis: np.ndarray, position: RidingPosition, side: float
) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
    """Return hip, ankle and the direction of the foot, each (3,)."""
    k = body.scale
    pitch = np.radians(FOOT_DEG)
    hip = pelvis + [0.0, side * 0.052 * body.height_m, -0.03 * k]
    foot = np.array([np.cos(pitch), 0.0, np.sin(pitch)])
    across = np.array([-foot[2], 0.0, foot[0]])
    ball = np.asarray(position.feet[0 if side > 0 else 1], float)
    return hip, ball - BALL_M * k * foot + ANKLE_M * k * across, foot


def _reaches(body: Body, pelvis: np.ndarray, position: RidingPosition) -> bool:
    """Return whether both feet reach their places."""
    legs = 0.985 * (body.thigh_m + body.shin_m)
    ends = [_leg(body, pelvis, position, side) for _, side in SIDES]
    return all(np.linalg.norm(ankle - hip) <= legs for hip, ankle, _ in ends)


def _leaning(body: Body, position: RidingPosition) -> Joints:
    """Return the joints of the back at the least slide and lean at which the arms reach the
    grips.
    """
    arm = STRETCHED * (body.upper_arm_m + body.forearm_m + PALM_M * body.scale)
    saddle = _pelvis(body, position)
    grip = _grip(position, 1.0)

    def back(slide: float, lean_deg: float) -> Joints:
        return spine(body, saddle + [slide, 0.0, 0.0], float(np.radians(lean_deg)))

    away = np.linalg.norm(grip - _left_shoulders(body, saddle), axis=-1)
    for slide, lean in np.argwhere(away <= arm + ROUNDING_M).tolist():
        at = back(SLIDES_M[slide], LEANS_DEG[lean])
        if np.linalg.norm(grip - at["shoulder_l"]) <= arm:
            return at
    return back(SLIDES_M[-1], LEANS_DEG[-1])


def _left_shoulders(body: Body, saddle: np.ndarray) -> np.ndarray:
    """Return the left shoulder (slides, leans, 3) for each slide and lean, m, as `spine` does."""
    lean = np.radians(LEANS_DEG)
    bent = lean + 0.9 * np.radians(body.stoop_deg)
    ahead = 0.5 * np.sin(lean) + 0.365 * np.sin(bent)
    up = 0.5 * np.cos(lean) + 0.365 * np.cos(bent)
    left = np.full(len(lean), body.shoulders * body.height_m)
    at = saddle + np.stack([body.torso_m * ahead, left, body.torso_m * up], 1)
    return at + np.stack([SLIDES_M, 0 * SLIDES_M, 0 * SLIDES_M], 1)[:, None]


def _arm(
    body: Body, shoulder: np.ndarray, grip: np.ndarray, side: float
) -> tuple[np.ndarray, np.ndarray]:
    """Return elbow and wrist of an arm with its closed hand around the grip."""
    bend = np.array([-0.2, 0.6 * side, -1.0])
    palm = PALM_M * body.scale
    wrist = grip - palm * unit(grip - shoulder)
    for _ in range(8):  # iterate, because hand and forearm depend on each other
        elbow = two_bone(shoulder, wrist, body.upper_arm_m, body.forearm_m, bend)
        wrist = grip - palm * unit(grip - elbow)
    return two_bone(shoulder, wrist, body.upper_arm_m, body.forearm_m, bend), wrist
