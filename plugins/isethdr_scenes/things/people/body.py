"""Proportions of a body, and the joints of a standing, walking or riding pose."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from ...geometry.mesh.piece import unit

# height of the body for which the lengths of clothes and all radii are given
TALL_M = 1.76
HEAD_M = 0.235  # head of that height, chin to crown
ANKLE_M = 0.087  # ankle over the sole
UP = np.array([0.0, 0.0, 1.0])
LEFT = np.array([0.0, 1.0, 0.0])
SIDES = (("l", 1.0), ("r", -1.0))
Joints = dict[str, np.ndarray]

# pitch of a walker's foot, toe up, over the phase of its leg: heel strike, stance, push-off, swing
PITCH_PHASE = (0.0, 0.10, 0.33, 0.5, 0.68, 0.85, 1.0)
PITCH_DEG = (16.0, 0.0, 0.0, -34.0, -24.0, 6.0, 16.0)


@dataclass(frozen=True)
class Body:
    """Proportions; see `data/people.yaml`."""

    height_m: float = 1.76
    heads: float = 7.5
    leg: float = 0.511
    shoulders: float = 0.101
    girth: float = 1.0
    paunch: float = 0.0
    bust: float = 0.0
    stoop_deg: float = 0.0

    @property
    def scale(self) -> float:
        """Return the height over that of the template."""
        return self.height_m / TALL_M

    @property
    def head_scale(self) -> float:
        """Return the size of the head over that of the template."""
        return self.height_m / self.heads / HEAD_M

    @property
    def thigh_m(self) -> float:
        """Return the distance from hip to knee."""
        return 0.506 * (self.leg * self.height_m - ANKLE_M * self.scale)

    @property
    def shin_m(self) -> float:
        """Return the distance from knee to ankle."""
        return 0.494 * (self.leg * self.height_m - ANKLE_M * self.scale)

    @property
    def torso_m(self) -> float:
        """Return the distance from the pelvis to the neck."""
        neck = self.height_m - 0.280 * self.head_scale
        return neck - self.leg * self.height_m - 0.03 * self.scale

    @property
    def upper_arm_m(self) -> float:
        """Return the distance from shoulder to elbow."""
        return 0.170 * self.height_m

    @property
    def forearm_m(self) -> float:
        """Return the distance from elbow to wrist."""
        return 0.142 * self.height_m


@dataclass(frozen=True)
class Limbs:
    """Angles of one side, degrees: forward and up are positive."""

    hip: float
    knee: float  # bend
    foot: float  # pitch, toe up
    arm: float
    elbow: float  # bend
    arm_out: float = 9.0


@dataclass(frozen=True)
class Pose:
    """Angles of both sides, and the lean of the back besides the body's own stoop."""

    left: Limbs
    right: Limbs
    lean_deg: float = 1.5


def walking(phase: float, stride_deg: float, arms_deg: float = 22.0) -> Pose:
    """Return a walker at a phase of the gait, 0 to 1.

    Parameters
    ----------
    phase : of the gait, 0 to 1; both legs are half a period apart.
    stride_deg : swing of a thigh to either side of its middle, degrees.
    arms_deg : swing of the arms at a stride of 26 degrees, degrees.
    """
    sides = []
    for shift in (0.0, 0.5):
        at = (phase + shift) % 1.0
        c = np.cos(2 * np.pi * at)
        s = np.sin(2 * np.pi * at)
        vigour = stride_deg / 26.0
        knee = 6 + vigour * (36 * max(0.0, -s) ** 1.5 + 12 * max(0.0, -c))
        sides.append(
            Limbs(
                hip=stride_deg * c + 3,
                knee=knee,
                foot=vigour * float(np.interp(at, PITCH_PHASE, PITCH_DEG)),
                arm=-arms_deg * vigour * c + 2,
                elbow=20.0,
            )
        )
    return Pose(sides[0], sides[1])


def standing(rng: np.random.Generator) -> Pose:
    """Return a person at rest, the weight on both legs."""
    sides = [
        Limbs(
            hip=float(rng.uniform(-4, 6)),
            knee=float(rng.uniform(3, 9)),
            foot=0.0,
            arm=float(rng.uniform(-6, 10)),
            elbow=float(rng.choice([14.0, 22.0, 95.0], p=[0.5, 0.35, 0.15])),
            arm_out=float(rng.uniform(6, 14)),
        )
        for _ in range(2)
    ]
    return Pose(sides[0], sides[1], 0.0)


def joints(body: Body, pose: Pose) -> Joints:
    """Return the joints of a body in a pose, m; the hips are at the origin's height of the legs."""
    k = body.scale
    pelvis = np.array([0.0, 0.0, body.leg * body.height_m + 0.03 * k])
    lean = np.radians(0.5 * body.stoop_deg + pose.lean_deg)
    out = spine(body, pelvis, lean)
    for tag, side in SIDES:
        limbs = pose.left if side > 0 else pose.right
        hip = pelvis + [0.0, side * 0.052 * body.height_m, -0.03 * k]
        thigh = np.radians(limbs.hip)
        knee = hip + body.thigh_m * np.array([np.sin(thigh), 0.0, -np.cos(thigh)])
        shin = thigh - np.radians(limbs.knee)
        ankle = knee + body.shin_m * np.array([np.sin(shin), 0.0, -np.cos(shin)])
        pitch = np.radians(limbs.foot)
        out |= {
            f"hip_{tag}": hip,
            f"knee_{tag}": knee,
            f"ankle_{tag}": ankle,
            f"foot_{tag}": unit(np.array([np.cos(pitch), 0.13 * side, np.sin(pitch)])),
        }
        shoulder = out[f"shoulder_{tag}"]
        arm = np.radians(limbs.arm) + 0.4 * lean
        outward = np.radians(limbs.arm_out)
        upper = unit(np.array([np.sin(arm), side * np.tan(outward), -np.cos(arm)]))
        elbow = shoulder + body.upper_arm_m * upper
        fore = arm + np.radians(limbs.elbow)
        inward = side * 0.15 if limbs.elbow < 60 else -side * 0.35
        lower = unit(np.array([np.sin(fore), inward * np.tan(outward), -np.cos(fore)]))
        out |= {f"elbow_{tag}": elbow, f"wrist_{tag}": elbow + body.forearm_m * lower}
    return out


def spine(body: Body, pelvis: np.ndarray, lean: float) -> Joints:
    """Return pelvis, chest, neck, head and shoulders of a back that leans forward, in radians.

    The upper half of the back bends by the body's stoop besides.

    Parameters
    ----------
    body : measures of the person.
    pelvis : (3,) place of the pelvis, m.
    lean : of the lower back, forward from upright, radians.
    """
    stoop = np.radians(body.stoop_deg)
    lower = np.array([np.sin(lean), 0.0, np.cos(lean)])
    upper = np.array([np.sin(lean + 0.9 * stoop), 0.0, np.cos(lean + 0.9 * stoop)])
    torso = body.torso_m
    head = body.head_scale
    middle = pelvis + 0.5 * torso * lower
    ahead = np.array([upper[2], 0.0, -upper[0]])
    neck = middle + 0.5 * torso * upper + 0.02 * body.scale * ahead
    # the neck brings the head back up: one looks ahead, however much the back bends
    nod = 0.35 * (lean + 0.9 * stoop)
    way = np.array([np.sin(nod), 0.0, np.cos(nod)])
    out = {
        "pelvis": pelvis,
        "chest": middle + 0.21 * torso * upper + 0.012 * body.scale * ahead,
        "neck": neck,
        "head": neck + 0.155 * head * way + 0.022 * head * np.array([1.0, 0.0, 0.0]),
        "up": unit(neck - pelvis),
    }
    for tag, side in SIDES:
        shoulder = middle + 0.365 * torso * upper
        out[f"shoulder_{tag}"] = shoulder + side * body.shoulders * body.height_m * LEFT
    return out
