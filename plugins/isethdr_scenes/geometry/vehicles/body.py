"""A vehicle body: one sheet, with glass, lamps, gaps and wheel houses cut out of it."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import replace
from typing import TYPE_CHECKING, Any

import numpy as np

from ..mesh.cutting import cut, halves, hem, outside_of
from ..mesh.piece import join
from ..mesh.primitives import lathe
from .shell import loft

if TYPE_CHECKING:
    from isethdr_core.data.scene_description import Lamp

    from ..mesh.piece import Piece
    from .shell import Shell


class Body:
    """The shell as one painted sheet. `take` cuts a region out of the paint."""

    def __init__(self, shell: Shell, axles: Sequence[float] = (), tyre: float = 0.33) -> None:
        """Start with the whole skin as paint.

        Parameters
        ----------
        shell : `Shell`: measures of the skin.
        axles : distances of the axles from the front end, m.
        tyre : radius of the tyres, m.
        """
        self.shell = shell
        self.axles = axles
        self.tyre = tyre
        self.upper, self.belt = shell.profiles()
        self.paint = loft(shell, axles, tyre)
        self.parts = []

    def at(
        self, part: Piece | None = None
    ) -> tuple[np.ndarray, np.ndarray, np.ndarray, np.ndarray]:
        """Return u, |y|, z and y, m, of the vertices of a part, by default of the paint."""
        v = (part or self.paint).vertices
        return self.shell.length / 2 - v[:, 0], np.abs(v[:, 1]), v[:, 2], v[:, 1]

    def tops_at(self, u: np.ndarray, y: float) -> list[float]:
        """Return the heights of the outer skin at points (u, y), m.

        The height is that of the highest vertex within 6 cm, or 15 cm of a coarse skin. Without
        such a vertex it is the height of the roof line.

        Parameters
        ----------
        u : (n,) distances from the front end, m.
        y : distance of all points to the left, m.
        """
        v = np.concatenate(
            [self.paint.vertices] + [p.vertices for p in self.parts if len(p.vertices)]
        )
        reach = 0.15 if self.shell.coarse else 0.06
        v = v[np.abs(v[:, 1] - y) < reach]
        out = []
        for k in u:
            d = np.hypot(v[:, 0] - self.shell.length / 2 + k, v[:, 1] - y)
            near = v[d < reach, 2]
            out.append(near.max() if len(near) else float(self.upper(k)))
        return out

    def take(
        self,
        name: str,
        material: str,
        value: np.ndarray,
        sunk: float = 0.0,
        rim: str | None = None,
        lamp: Lamp | None = None,
    ) -> Piece:
        """Cut a region out of the paint, and return it.

        Parameters
        ----------
        name : name of the piece.
        material : name of the material.
        value : (vertices,) of the paint; negative within the region.
        sunk : distance by which the region moves inwards, m; a surface closes the step.
        rim : name of the material of that surface; None: `material`.
        lamp : `Lamp` of the region; None: it does not shine.
        """
        if not sunk:
            inside, self.paint = halves(self.paint, value)
        else:
            inside, self.paint, seam = cut(self.paint, value)
            inside = inside.offset(-sunk)
            self.parts.append(hem(seam, -sunk, name + ".rim", rim or material))
        inside = inside.named(name, material, lamp)
        if len(inside.faces):
            self.parts.append(inside)
        return inside

    def open(self, value: np.ndarray) -> None:
        """Remove the region with value < 0 from the paint."""
        self.paint = outside_of(self.paint, value)

    def carve(
        self, part: Piece, name: str, material: str, value: np.ndarray, lamp: Lamp | None = None
    ) -> tuple[Piece, Piece]:
        """Cut a region out of an earlier part. Return the region and the rest, which replace the
        part.

        Parameters
        ----------
        part : earlier part of the body that is cut.
        name : name of the region.
        material : name of the material of the region.
        value : (vertices,) of `part`; negative within the region.
        lamp : `Lamp` of the region; None: it does not shine.
        """
        self.parts = [p for p in self.parts if p is not part]
        inside, outside = halves(part, value)
        inside = inside.named(name, material, lamp)
        self.parts += [p for p in (inside, outside) if len(p.faces)]
        return inside, outside

    def refine(self, part: Piece, values: Callable[..., list[np.ndarray]]) -> Piece:
        """Divide the faces of an earlier part along lines, and return the part.

        `carve` can then cut out a band between the lines that is narrower than the faces were.

        Parameters
        ----------
        part : earlier part of the body.
        values : function of a part. It returns a list of arrays (vertices,), one for each line; an
            array is 0 along its line.
        """
        finer = part
        for k in range(len(values(part))):
            finer = join(halves(finer, values(finer)[k]), part.name)
        self.parts = [finer if p is part else p for p in self.parts]
        return finer

    def line(
        self,
        distance: Callable[..., Any],
        where: Callable[..., Any],
        half: float = 0.005,
        material: str = "gap",
    ) -> None:
        """Cut a thin dark gap along a line in the paint.

        Parameters
        ----------
        distance : function of a part; returns the distances (vertices,) from the line, m.
        where : function of a part; returns values (vertices,), negative where the gap is cut.
        half : half the width of the gap, m.
        material : name of the material of the gap.
        """
        near, remaining = halves(self.paint, distance(self.paint) - half)
        below, band = halves(near, distance(near) + half)
        hit, miss = halves(band, where(band))
        self.parts.append(hit.named("gap", material))
        self.paint = join([remaining, below, miss], "body")

    def arches(self, gap: float = 0.045, depth: float = 0.30) -> None:
        """Open the wheel houses and line them, `gap` wider than the tyres and `depth` deep, m."""
        for a in self.axles:
            r = self.tyre + gap
            u, ay, z, _ = self.at()
            _, self.paint, seam = cut(
                self.paint,
                np.maximum(
                    np.hypot(u - a, z - self.tyre - 0.01) - r, 0.5 * self.shell.width - 0.36 - ay
                ),
            )
            side = np.sign(seam[:, :, 0, 1].mean(1))
            for sgn in (1, -1):
                self.parts.append(
                    hem(seam[side == sgn], np.array([0, -sgn * 0.035, 0]), "arch", "plastic_black")
                )
            x = self.shell.length / 2 - a
            for sgn in (1, -1):
                ys = sgn * (self.shell.width / 2 - np.array([0.02, depth, depth]))
                prof = [(r + 0.002, ys[0]), (r + 0.002, ys[1]), (0.01, ys[2])]
                well = lathe(prof, "wheel_house", "gap", 28, turn=(-np.pi * 0.62, np.pi * 0.62))
                self.parts.append(replace(well, vertices=well.vertices + [x, 0, self.tyre + 0.01]))

    def lining(self, z_min: float, material: str = "interior") -> Piece:
        """Return the inner skin of the cabin above the height `z_min`, m: the rest of the paint,
        moved inwards by 3 cm and facing inwards.
        """
        keep = outside_of(self.paint, self.paint.vertices[:, 2] - z_min)
        inner = keep.offset(-0.03)
        return replace(
            inner,
            name="lining",
            material=material,
            faces=inner.faces[:, ::-1],
            normals=-inner.normals,
        )
