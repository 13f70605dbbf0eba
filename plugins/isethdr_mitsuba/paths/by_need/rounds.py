"""Rounds of adaptive sampling: a pilot pass, then more paths in tiles with noise that cameras can
see.

There are two half buffers of independent paths, with the same weight in the result. The paths of a
buffer in a tile are planned from the light of the other buffer, and from that of both buffers in
the tiles around it. With one buffer, tiles that found little light by chance would stop early and
be too dark. From the second round on, the other paths have in turn been planned from this buffer.
The weight of a round is therefore fixed before these are used (`mean_of_rounds`). The light of a
path then influences its own weight only through the limits of the noise and one factor of its light
group (`spread_of_buffers`), which follow from the whole picture.
"""

from __future__ import annotations

import math
import sys
import time
from collections.abc import Callable
from dataclasses import dataclass, field, replace
from typing import Any, NamedTuple

import numpy as np

from isethdr_core import ledger
from isethdr_core.cli import progress
from isethdr_core.demand import NoiseLimit
from isethdr_core.runs.sample_accumulation import Known

from ..integrator import Launch, Paths
from ..passes import Estimate, group_noise, with_known
from ..work_items import Work, listed_work
from . import plan
from .fireflies import move_fireflies
from .moved_light import CameraNoise, MovedLight
from .plan import Lot
from .rare_light import move_rare_light
from .tallies import Neighbours, Tally, path_variance, spread_of_buffers, variance_for_plan

PILOT = 16  # number of paths of the pilot pass per tile, both buffers together
# the same beyond the camera's field: light from there reaches pixels only by blur and flare, which
# average it over many tiles
PILOT_BEYOND = 4
# largest ratio of the paths of a tile after a round to those before, because early estimates of the
# need are uncertain
GROWTH = 4.0
# A tile gets more paths after the first ones if it would need them with this many times the
# estimated variance. Otherwise its first paths get all of the weight, and none can be added later
CAUTION = 2.0
MOST_ROUNDS = 6  # largest number of rounds
LITTLE = 0.5  # a round that adds fewer paths per tile than this is the last one
LARGEST_LIST = 1 << 17  # largest number of tiles of one launch; limits memory
# largest number of paths of a tile in one launch; float32 sums of more paths in a lane would be
# inaccurate
LONGEST = 4096
USUAL = 70  # samples per tile of the main job, all light groups together
MANY = 500  # samples per tile above which a message is printed
EXPOSURE_CHANGED = 0.1  # relative change of the exposure above which the need is computed again


class _Running(NamedTuple):
    """A launch that is running."""

    buffer: int  # number of the buffer that receives its results
    work: Work
    launch: Launch


@dataclass(eq=False)
class Rounds:
    """Two half buffers that grow round by round.

    Attributes
    ----------
    paths : the integrator.
    instance : (row, column) number of the object in each tile.
    seed, first : seed of the renderer and number of the first path, from which the random numbers
        follow.
    most : largest number of paths per tile and group, in both buffers together.
    most_mean : largest mean over tiles of the paths of all groups, in both buffers together.
    in_field : (rows, columns) slices of the tiles in the camera's field; all by default.
    affordable : smallest share of the needed paths that `most_mean` allowed in a round.
    moved : light of rare bright paths that was moved to other tiles; None before `move_rare_light`.
    checked : number of tiles that stood out and got further paths (`fireflies`).
    spread : ratio (group, 1, 1) of the variance found from both buffers to that found from their
        batches, before light was moved; None before `move_rare_light`.
    """

    paths: Paths
    instance: np.ndarray
    seed: int
    first: int = 0
    most: int = 4096
    most_mean: float = math.inf
    in_field: tuple[slice, slice] = (slice(None), slice(None))
    affordable: float = 1.0
    moved: MovedLight | None = None
    checked: int = 0
    spread: np.ndarray | None = None
    buffers: list[Tally] = field(default_factory=list)
    launches: int = 0
    running: _Running | None = None

    def __post_init__(self) -> None:
        shape = len(self.paths.lamps.groups), len(self.paths.wavelength_nm), self.instance.size
        self.buffers = [Tally.empty(*shape) for _ in range(2)]
        self.near = Neighbours(self.instance)
        lit = [self.paths.lamps.has_lamps(g) for g in range(shape[0])]
        us = np.where(lit, plan.LAMPS_US, plan.SKY_US)
        self.group_us = us + plan.BASE_US / 2
        self.sky = sum(1 << g for g, has_lamps in enumerate(lit) if not has_lamps)

    def follow(self, buffer: int, lot: Lot) -> None:
        """Follow the paths of a lot, and add their light to a buffer. The last launch may still run
        when this returns; `finish` waits for it.
        """
        for start in range(0, len(lot.tiles), LARGEST_LIST):
            part = slice(start, start + LARGEST_LIST)
            paths_left = lot.paths[part]
            while paths_left.any():
                now = np.minimum(paths_left, LONGEST)
                on = np.flatnonzero(paths_left)
                work = listed_work(lot.tiles[part][on], now[on], lot.groups[part][on], sky=self.sky)
                launch = self.paths.record(self._next_seed(), work)
                self._run(_Running(buffer, work, launch))
                paths_left = paths_left - now

    def finish(self) -> None:
        """Wait for the last launch, and add its results."""
        self._run(None)

    def _run(self, following: _Running | None) -> None:
        """Start the launch `following` when the previous launch has ended. The results of the
        previous launch are added to its buffer while `following` runs.
        """
        before = self.running
        if before is not None:
            before.launch.wait()
        if following is not None:
            following.launch.start()
        self.running = following
        if before is not None:
            self.buffers[before.buffer].add(before.work, before.launch.found())

    def pilot(self) -> None:
        """Follow the first paths of all tiles and groups."""
        tiles = self.instance.size
        every = np.full(tiles, self.paths.all_groups())
        paths = np.full(self.instance.shape, PILOT_BEYOND // 2)
        paths[self.in_field] = PILOT // 2
        for buffer in progress.track(range(2), "first paths of all tiles"):
            self.follow(buffer, Lot(np.arange(tiles), paths.ravel(), every))
        self.finish()

    def add_needed(
        self, limit: NoiseLimit, share: float, number: int = 1, *, reopen: bool = False
    ) -> float:
        """Add paths so that the noise becomes `share` of the limit, and return their mean number
        per tile.

        Parameters
        ----------
        limit : noise that the cameras allow.
        share : wanted noise as a share of the limit.
        number : number of the round, for messages. The first round may print a message.
        reopen : also add paths in tiles that were finished under another limit.
        """
        weights = [limit.weights.get(group, 0.0) for group in self.paths.lamps.groups]
        allowed = share * limit.xyz.reshape(3, -1)
        scale = spread_of_buffers(*self.buffers, self._variance_of_batches())
        plans = []
        later = []
        factors = []
        wanted = 0.0
        for buffer, other in zip(self.buffers, reversed(self.buffers)):
            variance = variance_for_plan(buffer, other, self.near)
            enough = plan.needed(scale * variance, allowed, weights, self.group_us) / 2
            paths_needed = buffer.paths + self._later_paths(buffer, enough, reopen)
            # a multiple of STEP, because numbers of added paths are rounded up to one
            paths_needed = np.minimum(paths_needed, self.most // (2 * plan.STEP) * plan.STEP)
            wanted += float(np.maximum(paths_needed, buffer.paths).sum(0).mean())
            # The factor follows from all needed paths, not from the paths of this round. If a round
            # adds only some of them, the tiles that need most get the rest in later rounds.
            factor = plan.affordable(paths_needed, buffer.paths, self.most_mean / 2)
            # tiles that are finished had the factor of an earlier round, and ask for no more
            factor = min(factor, self.affordable)
            factors.append(factor)
            now = np.minimum(factor * paths_needed, GROWTH * buffer.paths)
            more = plan.more_paths(now, buffer.paths)
            plans.append(more)
            later.append(
                np.where(more > 0, np.maximum(factor * paths_needed - buffer.paths, more), 0)
            )
        # both plans are made before any weight is given: they need the light of both buffers
        for buffer, more, expected in zip(self.buffers, plans, later):
            buffer.light.give_weight(expected)
            if reopen:
                buffer.light.reopen(more)
        self.affordable = min(factors)
        if number == 1 and min(wanted, self.most_mean) > MANY:
            print(
                f"renderer: noise below that of the cameras needs about {wanted:.2g} samples per"
                f" tile, all light groups together; a night drive needs {USUAL}. For less time and"
                " more noise type renderer.most_mean_samples=128",
                file=sys.stderr,
                flush=True,
            )
        added = float(sum(more.max(0).mean() for more in plans))
        title = f"round {number}: {added:.3g} paths per tile where noise is seen"
        every = [(buffer, lot) for buffer in range(2) for lot in plan.lots(plans[buffer])]
        for buffer, lot in progress.track(every, title):
            self.follow(buffer, lot)
        self.finish()
        return added

    def _later_paths(self, buffer: Tally, enough: np.ndarray, reopen: bool) -> np.ndarray:
        """Return the paths (group, tile) that a buffer needs in addition to those that it has.

        Parameters
        ----------
        buffer : the buffer.
        enough : (group, tile) paths that would be enough if all had the same weight.
        reopen : whether tiles that were finished may need paths.
        """
        light = buffer.light
        later = light.later_paths(enough)
        unsure = light.is_first & (CAUTION * enough * light.variance_factor() > 1)
        later = np.where(unsure, np.maximum(later, plan.STEP), later)
        if not reopen:
            return later
        finished = light.left == 0
        return np.where(finished, enough - 1 / np.where(finished, light.square, 1.0), later)

    def until_done(self, limit: NoiseLimit, share: float, *, reopen: bool = False) -> None:
        """Add rounds until one adds few paths, at most `MOST_ROUNDS`.

        Parameters
        ----------
        limit : noise that the cameras allow.
        share : wanted noise as a share of the limit.
        reopen : also add paths in tiles that were finished under another limit.
        """
        self.affordable = 1.0
        for k in range(MOST_ROUNDS):
            if self.add_needed(limit, share, k + 1, reopen=reopen and k == 0) < LITTLE:
                break
        for buffer in self.buffers:
            buffer.light.give_all_weight()

    def move_rare_light(self, limit: NoiseLimit, share: float) -> None:
        """Move the light of rare bright paths to the tiles around them (`rare_light`, `fireflies`).
        No paths may be added after this.

        Parameters
        ----------
        limit : noise of the cameras.
        share : wanted noise as a share of the limit.
        """
        weights = [limit.weights.get(group, 0.0) for group in self.paths.lamps.groups]
        # Before the light is moved: moved light lies in one buffer alone, and would be taken for
        # noise in many tiles.
        self.spread = spread_of_buffers(*self.buffers, self._variance_of_batches())
        noise = CameraNoise(weights, limit.xyz[1].reshape(self.instance.shape), share)
        self.moved = MovedLight(self.buffers, self.instance, noise)
        move_rare_light(self.moved, self.near)
        self.checked = move_fireflies(self.moved, self._follow_further)

    def _follow_further(
        self, tally: Tally, tiles: np.ndarray, positions: np.ndarray, count: int
    ) -> None:
        """Follow further paths through some tiles. Their light is added to neither half buffer.

        Parameters
        ----------
        tally : gets the light of the paths.
        tiles : numbers of the tiles of `tally`, sorted.
        positions : positions in `tally` of the tiles through which paths go.
        count : number of paths through each tile.
        """
        for start in range(0, len(positions), LARGEST_LIST):
            some = tiles[positions[start : start + LARGEST_LIST]]
            every = np.full(len(some), self.paths.all_groups())
            for done in range(0, count, LONGEST):
                now = np.full(len(some), min(LONGEST, count - done))
                work = listed_work(some, now, every, sky=self.sky)
                found = self.paths.launch(self._next_seed(), work)
                tally.add(replace(work, tiles=np.searchsorted(tiles, work.tiles)), found)

    def _next_seed(self) -> int:
        """Return the seed of the next launch."""
        words = np.random.SeedSequence(self.seed, spawn_key=(self.first, self.launches))
        self.launches += 1
        return int(words.generate_state(1)[0])

    def radiance(self) -> np.ndarray:
        """Return radiance (group, band, tile), float64: the mean of the means of both buffers."""
        out = np.zeros(self.buffers[0].light.radiance.shape)
        for tally in self.buffers:
            out += tally.light.mean_radiance() / 2
        return out

    def xyz_noise(self) -> np.ndarray:
        """Return standard errors (group, 3, tile) of X, Y and Z, cd/m2.

        They follow from the batches of each tile. One factor for each group makes them agree, in
        the mean, with the difference between the two buffers. Light that was moved to a tile counts
        as noise.
        """
        of_batches = self._variance_of_batches()
        if self.moved is None or self.spread is None:
            return np.sqrt(spread_of_buffers(*self.buffers, of_batches) * of_batches)
        return np.sqrt(self.spread * of_batches + self.moved.variance)

    def _variance_of_batches(self) -> np.ndarray:
        """Return the variance (group, 3, tile) of the light, computed from batches, (cd/m2)^2."""
        return path_variance(self.buffers, self.near) * sum(share_of(t) for t in self.buffers)

    def half_difference(self) -> np.ndarray:
        """Return half of the luminance difference (group, tile) between the buffers, cd/m2."""
        first, second = (tally.mean()[:, 1] for tally in self.buffers)
        return (first - second) / 2

    def mean_paths(self) -> np.ndarray:
        """Return the mean number (group,) of paths per tile."""
        return np.round(sum(t.paths for t in self.buffers).mean(1)).astype(int)


def share_of(tally: Tally) -> np.ndarray:
    """Return the factor (group, 1, tile) from the variance of single paths to the contribution of a
    buffer to the variance of the light.

    The weight of a buffer is 1/2, so its variance is divided by 4.
    """
    return (0.25 * tally.light.variance_factor()).astype(np.float32)[:, None]


def render_by_need(
    rounds: Rounds, noise_limit: Callable[[np.ndarray], NoiseLimit], share: float
) -> float:
    """Follow paths until the noise of the light is `share` of the cameras' noise.

    Parameters
    ----------
    rounds : the half buffers, which this function fills.
    noise_limit : function(radiance (group, band, tile) so far) -> `NoiseLimit`.
    share : wanted noise as a share of the cameras' noise.

    Returns
    -------
    The run time in seconds, without that of `noise_limit`.
    """
    start = time.perf_counter()
    rounds.pilot()
    began = time.perf_counter()
    limit = noise_limit(rounds.radiance())
    start += time.perf_counter() - began
    rounds.until_done(limit, share)
    if not limit.steady:
        began = time.perf_counter()
        last = noise_limit(rounds.radiance())
        start += time.perf_counter() - began
        change = exposure_change(limit.exposures, last.exposures)
        if change > EXPOSURE_CHANGED:
            why = "the automatic exposure changed; the required samples were computed again"
            ledger.left_out(
                "samples planned for the first exposure", why, change, "relative", key="exposure"
            )
            rounds.until_done(last, share, reopen=True)
        limit = last
    rounds.move_rare_light(limit, share)
    return time.perf_counter() - start


def estimate(rounds: Rounds, known: list[Known], seconds: float, judged: Any) -> Estimate:
    """Return the light of both buffers, in the form of `passes.estimate`.

    Parameters
    ----------
    rounds : the half buffers.
    known : (group,) light of earlier renderings.
    seconds : run time of the paths.
    judged : (rows, columns) slices: tiles from which the noise of a group is computed.
    """
    shape = rounds.instance.shape
    groups = len(known)
    xyz_noise = rounds.xyz_noise().reshape(groups, 3, *shape)
    halves = rounds.half_difference().reshape(groups, *shape)
    level = (sum(t.mean()[:, 1] for t in rounds.buffers) / 2).reshape(groups, *shape)
    noise = np.full(groups, np.nan)
    paths = rounds.mean_paths()
    for g in range(groups):
        own, apart, spread = (
            values[g][judged].ravel() for values in (level, halves, xyz_noise[:, 1])
        )
        used = own > 0.01 * own.mean()
        if used.any():
            noise[g] = group_noise(own[used], apart[used][None], spread[used])
    return Estimate(
        rounds.radiance().reshape(groups, -1, *shape),
        noise,
        xyz_noise,
        halves,
        paths,
        np.full(groups, seconds),
        np.full(groups, rounds.first),
        known,
        with_known(noise, paths, known),
    )


def exposure_change(first: np.ndarray, last: np.ndarray) -> float:
    """Return the largest relative change of the exposures that cameras chose, from `first` to
    `last`.
    """
    if first.shape != last.shape or not first.size:
        return 0.0
    tiny = np.finfo(float).tiny
    return float(np.abs(last / np.maximum(first, tiny) - 1)[first > 0].max(initial=0.0))
