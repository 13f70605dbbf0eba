"""Proportions of a body, and the joints of a standing, walking or riding pose."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from ...geometry.mesh.piece import unit

TALL_M = 1.76  # height of the template, to which all lengths of clothes and all radii refer
HEAD_M = 0.235  # height of the template's head from chin to crown
ANKLE_M = 0.087  # height of the template's ankle above the sole
UP = np.array([0.0, 0.0, 1.0])
LEFT = np.array([0.0, 1.0, 0.0])
SIDES = (("l", 1.0), ("r", -1.0))
Joints = dict[str, np.ndarray]

# pitch of a walker's foot, toe up, at phases of its leg: heel strike, stance, push-off, swing
PITCH_PHASE = (0.0, 0.10, 0.33, 0.5, 0.68, 0.85, 1.0)
PITCH_DEG = (16.0, 0.0, 0.0, -34.0, -24.0, 6.0, 16.0)


USUAL_HIP_DEG = 26.0  # swing of the hips to which `PITCH_DEG` refers
STANCE = 0.5  # share of the gait during which a foot is on the ground
AHEAD = 0.05  # mean distance of a standing foot's ankle ahead of the hip / length of the leg
LEAST_BEND_DEG = 6.0  # least bend of a knee
LIFT_M = 0.06  # lift of an ankle that swings forward, for the template
# ends of a shoe: distance along the foot ahead of the ankle, and radius of the round end, m, for
# the template
HEEL = (-0.050, 0.041)
TOE = (0.172, 0.032)


@dataclass(frozen=True)
class Swing:
    """Swing of a person's legs and arms; see `data/people.yaml`."""

    hip_deg: float  # swing of a straight leg to the front and to the rear, which makes one step
    arms_deg: float = 15.0  # swing of an upper arm to the front and to the rear
    elbow_deg: float = 20.0  # bend

    def step_m(self, body: Body) -> float:
        """Return the length of one step, m."""
        return 2 * (body.thigh_m + body.shin_m) * float(np.sin(np.radians(self.hip_deg)))


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
        """Return the height / height of the template."""
        return self.height_m / TALL_M

    @property
    def head_scale(self) -> float:
        """Return the size of the head / size of the template's head."""
        return self.height_m / self.heads / HEAD_M

    @property
    def thigh_m(self) -> float:
        """Return the distance from hip to knee, m."""
        return 0.506 * (self.leg * self.height_m - ANKLE_M * self.scale)

    @property
    def shin_m(self) -> float:
        """Return the distance from knee to ankle, m."""
        return 0.494 * (self.leg * self.height_m - ANKLE_M * self.scale)

    @property
    def torso_m(self) -> float:
        """Return the distance from the pelvis to the neck, m."""
        neck = self.height_m - 0.280 * self.head_scale
        return neck - self.leg * self.height_m - 0.03 * self.scale

    @property
    def upper_arm_m(self) -> float:
        """Return the distance from shoulder to elbow, m."""
        return 0.170 * self.height_m

    @property
    def forearm_m(self) -> float:
        """Return the distance from elbow to wrist, m."""
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
    """Angles of both sides, and the lean of the back, which is added to the body's stoop."""

    left: Limbs
    right: Limbs
    lean_deg: float = 1.5


def walking(body: Body, phase: float, gait: Swing) -> Pose:
    """Return the pose of a walker at a phase of the gait.

    Each foot is on the ground for half of the gait. During that time its ankle moves back by one
    step relative to the body. So the foot stands still while the body moves on. It rolls over heel
    and toe.

    Parameters
    ----------
    body : measures of the person.
    phase : phase of the gait, 0 to 1; the legs are half a period apart.
    gait : length of the steps and swing of the arms.
    """
    hip_m = _hip_height_m(body, phase, gait)
    sides = []
    for shift in (0.0, 0.5):
        at = (phase + shift) % 1.0
        ahead_m, height_m = _ankle_m(body, at, gait)
        hip, knee = _leg_deg(body, ahead_m, hip_m - height_m)
        arm = -gait.arms_deg * np.cos(2 * np.pi * at) + 2
        sides.append(Limbs(hip, knee, _pitch_deg(at, gait), arm, gait.elbow_deg))
    return Pose(sides[0], sides[1])


def _pitch_deg(at: float, gait: Swing) -> float:
    """Return the pitch of a foot, toe up, at a phase of its leg, degrees."""
    return gait.hip_deg / USUAL_HIP_DEG * float(np.interp(at, PITCH_PHASE, PITCH_DEG))


def _hip_height_m(body: Body, phase: float, gait: Swing) -> float:
    """Return the height of the hips above the ground at a phase of the gait, m.

    It is least when both feet are on the ground, and largest in the middle of a leg's stance.
    """
    heights = []
    for at in (0.0, STANCE / 2):
        ahead_m, height_m = _ankle_m(body, at, gait)
        heights.append(height_m + np.sqrt(_reach_m(body, LEAST_BEND_DEG) ** 2 - ahead_m**2))
    low, high = heights
    return float(low + (high - low) * (1 - np.cos(2 * np.pi * phase / STANCE)) / 2)


def _ankle_m(body: Body, at: float, gait: Swing) -> tuple[float, float]:
    """Return the distance of an ankle ahead of its hip, and its height above the ground, m.

    Parameters
    ----------
    body : measures of the person.
    at : phase of the leg, 0 to 1, from heel strike.
    gait : length of the steps.
    """
    if at <= STANCE:
        return _ankle_on_ground_m(body, at, gait)
    share = (at - STANCE) / (1 - STANCE)
    forward = (1 - np.cos(np.pi * share)) / 2
    off = np.array(_ankle_on_ground_m(body, STANCE, gait))
    on = np.array(_ankle_on_ground_m(body, 0.0, gait))
    ahead_m, height_m = (off + forward * (on - off)).tolist()
    lift = LIFT_M * body.scale * gait.hip_deg / USUAL_HIP_DEG
    return ahead_m, height_m + lift * float(np.sin(np.pi * share)) ** 2


def _ankle_on_ground_m(body: Body, at: float, gait: Swing) -> tuple[float, float]:
    """Return the same as `_ankle_m` for a foot on the ground.

    A flat foot moves back at constant speed. A pitched foot rolls on the round end of its heel or
    toe.
    """
    even = gait.step_m(body) * (0.5 - at / STANCE) + AHEAD * (body.thigh_m + body.shin_m)
    pitch = np.radians(_pitch_deg(at, gait))
    along = foot_along(pitch, 1.0)
    across = foot_across(along)
    reach, radius = HEEL if pitch > 0 else TOE
    turned = float(np.arcsin(along[2]))
    shift = reach * (foot_along(0.0, 1.0) - along)[0] + (ANKLE_M - radius) * across[0]
    height = radius - reach * along[2] + (ANKLE_M - radius) * across[2]
    return float(even + body.scale * (shift - radius * turned)), float(body.scale * height)


def _reach_m(body: Body, bend_deg: float) -> float:
    """Return the distance from hip to ankle, m, of a leg with its knee bent by `bend_deg`."""
    bend = np.radians(bend_deg)
    straight = body.thigh_m + body.shin_m * np.cos(bend)
    return float(np.hypot(straight, body.shin_m * np.sin(bend)))


def _leg_deg(body: Body, ahead_m: float, below_m: float) -> tuple[float, float]:
    """Return the angle of the thigh and the bend of the knee, degrees, for a place of the ankle.

    Parameters
    ----------
    body : measures of the person.
    ahead_m : distance of the ankle ahead of the hip, m.
    below_m : distance of the ankle below the hip, m.
    """
    thigh = body.thigh_m
    shin = body.shin_m
    away2 = ahead_m**2 + below_m**2
    bend = np.arccos(np.clip((away2 - thigh**2 - shin**2) / (2 * thigh * shin), -1, 1))
    lag = np.arctan2(shin * np.sin(bend), thigh + shin * np.cos(bend))
    return float(np.degrees(np.arctan2(ahead_m, below_m) + lag)), float(np.degrees(bend))


def foot_along(pitch_rad: float, side: float) -> np.ndarray:
    """Return the unit vector (3,) along a foot, which points slightly outwards.

    Parameters
    ----------
    pitch_rad : pitch of the foot, toe up, radians.
    side : +1 for the left foot, -1 for the right foot.
    """
    return unit(np.array([np.cos(pitch_rad), 0.13 * side, np.sin(pitch_rad)]))


def foot_across(along: np.ndarray) -> np.ndarray:
    """Return the unit vector (3,) upwards from the sole, perpendicular to the foot `along`."""
    return unit(np.cross(along, np.cross(UP, along)))


def standing(rng: np.random.Generator) -> Pose:
    """Return the pose of a person at rest, with the weight on both legs."""
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
    """Return the joints (3,) of a body in a pose, m, by name. The pelvis is above the origin."""
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
            f"foot_{tag}": foot_along(pitch, side),
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
    """Return the joints of a back, m, by name: pelvis, chest, neck, head, shoulders.

    The joints also have `up`, the unit vector from pelvis to neck. The stoop of the body bends the
    upper half of the back in addition to the lean.

    Parameters
    ----------
    body : measures of the person.
    pelvis : (3,) place of the pelvis, m.
    lean : lean of the lower back, forward from upright, radians.
    """
    stoop = np.radians(body.stoop_deg)
    lower = np.array([np.sin(lean), 0.0, np.cos(lean)])
    upper = np.array([np.sin(lean + 0.9 * stoop), 0.0, np.cos(lean + 0.9 * stoop)])
    torso = body.torso_m
    head = body.head_scale
    middle = pelvis + 0.5 * torso * lower
    ahead = np.array([upper[2], 0.0, -upper[0]])
    neck = middle + 0.5 * torso * upper + 0.02 * body.scale * ahead
    # the neck turns the head up again, so that a person with a bent back looks ahead
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
