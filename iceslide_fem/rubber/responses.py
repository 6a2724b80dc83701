"""What kept factors answer to loads on the contact, and what a changed contact makes of it.

With factors M of an earlier tangent and the difference D of the present contact to theirs, whose
loads w act on the nodes of the contact alone,

    (M + D) x = b,    x = M^-1 (b - w),    w = D x:    (1 + D M^-1) w = D M^-1 b.

M^-1 of a load is kept as long as the factors are. w is sought among the loads that have been met
already, so that (1 + D M^-1) w is as near as can be; then a solve is made for what is left, and so
on (GMRES with a recycled space: Parks et al., SIAM J. Sci. Comput. 28 (2006) 1651). Factors that
answer several loads in little more time than one are given what is left in parts: points touch and
lift along lines across the sliding direction, and what a line does alone serves for more than what
all do at once.
"""

from __future__ import annotations

from collections.abc import Callable

import numpy as np
from numpy.typing import NDArray
from scipy.sparse import csr_matrix

from iceslide_fem.rubber.contact_nodes import ContactNodes
from iceslide_fem.runtime.arrays import Array

# So many solves for one change at most; and so many answers are kept before factors are made anew.
MOST_SOLVES, MOST_KEPT = 20, 200
# Images of kept loads that are, to this fraction of the largest, combinations of others are none.
DEPENDENT = 1e-6
# What a solve leaves is the next load, unless it has left more than this fraction of what was
# there.
ENOUGH = 0.8
# What it costs to answer the parts of a load at once, in solves for one.
PARTS_COST = 1.5

# The changes of this rank's dofs, ghosts included, (k, dofs), that answer loads (k, n) on the
# contact. Collective.
Answered = Callable[[Array], Array]


class Responses:
    """Answers of factors to loads on the `nodes` of the contact: kept until they are cleared.

    stale: whether the last change took more solves than those since the factors did on the average,
    the factors' own cost included: then new ones are worth their while.
    """

    def __init__(self, nodes: ContactNodes, cost: float, many: bool = False) -> None:
        """`cost` of new factors, in solves with them; whether they answer `many` loads at once."""
        self._nodes, self._cost, self._many = nodes, cost, many
        # Loads (k, n), N, the changes of this rank's dofs that answer them (k, dofs), m, and those
        # at the facets (k, f, a d), m: there is room for more than the `_recycled`.
        self._loads: Array = np.zeros((0, nodes.n_loads))
        self._answers: Array = np.zeros((0, 0))
        self._moved: Array = np.zeros((0, 0, 0))
        self.clear()
        self._differing: NDArray[np.intp] = np.zeros(0, dtype=np.intp)  # facets
        self._difference: Array = np.zeros(0)
        self._between: csr_matrix | None = None
        self._acting = np.array([nodes.n_loads - 1])  # places of loads
        self._sum = nodes.summing(self._differing, self._acting)  # of the forces on them
        self._resultant = nodes.resultant(self._acting)

    def clear(self) -> None:
        """There are new factors."""
        self._recycled = 0
        self._spent, self._changes, self.stale = self._cost, 0, False

    def differ(self, difference: Array, walls: csr_matrix | None = None) -> None:
        """The contact of the factors less the present one, as a tangent (f, a d, a d), N/m, and the
        stiffness of the `walls` now less that of the factors. Collective.
        """
        between = None if walls is None else self._nodes.between_walls(walls)
        self._differing = np.flatnonzero(difference.any(axis=(1, 2)))
        self._difference = difference[self._differing]
        kept = self._loads[: self._recycled]
        self._acting = self._nodes.acting(self._differing, between, kept)
        self._between = None if between is None else between[self._acting[:-1]]
        self._sum = self._nodes.summing(self._differing, self._acting)
        self._resultant = self._nodes.resultant(self._acting)

    def correction(self, answer: Array, limit: float, answered: Answered) -> Array:
        """What to subtract of the factors' `answer` to some load, leaving at most `limit` (N).

        `answered` solves with the factors. What is left counts with its resultant. Collective.
        """
        moved = self._nodes.at_facets(answer)
        left = self._weighed(self._differing_loads(answer[None], moved[None]))[:, 0]
        images = self._images(0)
        parts = _orthonormal(images)
        left, coefficients = _less(left, images, parts)
        longest, solves = np.inf, 1.0
        for _ in range(MOST_SOLVES):
            length = self._nodes.norm(left)
            if not length > limit:
                break
            again = length >= ENOUGH * longest
            loads = (images @ parts[:, -1:]).T if again else left[None] / length
            loads = self._nodes.everywhere(loads[:, : self._acting.size], self._acting)
            if self._many and not again:
                loads = self._nodes.parts(loads[0])
            longest, first = length, self._recycled
            solves += 1.0 if len(loads) == 1 else PARTS_COST
            for load, found in zip(loads, answered(loads), strict=True):
                self._keep(load, found)
            more = self._images(first)
            if not np.isfinite(more).all():
                self._recycled = first
                break
            rest, shared = _less(more, images, parts)
            of_rest = _orthonormal(rest)
            if not of_rest.shape[1]:
                break
            images = np.column_stack([images, more])
            of_new = np.concatenate([-shared @ of_rest, of_rest])
            parts = np.column_stack([np.pad(parts, ((0, len(loads)), (0, 0))), of_new])
            left, more_shares = _less(left, images, parts)
            coefficients = np.pad(coefficients, (0, len(loads))) + more_shares
        self._spent, self._changes = self._spent + solves, self._changes + 1
        self.stale = solves * self._changes > self._spent or self._recycled > MOST_KEPT
        return (
            np.asarray(coefficients @ self._answers[: coefficients.size])
            if coefficients.size
            else 0.0 * answer
        )

    def _keep(self, load: Array, answer: Array) -> None:
        """Keep a load and the change that answers it."""
        moved = self._nodes.at_facets(answer)
        if self._recycled == len(self._loads) or self._answers.shape[1:] != answer.shape:
            self._loads, self._answers, self._moved = (
                _with_room(kept, one, self._recycled)
                for kept, one in (
                    (self._loads, load),
                    (self._answers, answer),
                    (self._moved, moved),
                )
            )
        self._loads[self._recycled], self._answers[self._recycled] = load, answer
        self._moved[self._recycled] = moved
        self._recycled += 1

    def _images(self, first: int) -> Array:
        """(1 + D M^-1) w of the kept loads w from the `first` on, weighed, (a + d, k), N.

        Collective.
        """
        kept = slice(first, self._recycled)
        if first == self._recycled:
            return self._weighed(np.zeros((self._acting.size, 0)))
        images = self._differing_loads(self._answers[kept], self._moved[kept])
        images += self._loads[kept][:, self._acting].T
        return self._weighed(images)

    def _weighed(self, loads: Array) -> Array:
        """Loads (a, k) with their resultants behind them: what is left is made small in both."""
        return np.concatenate([loads, self._resultant @ loads])

    def _differing_loads(self, answers: Array, moved: Array) -> Array:
        """Loads D x (a, k), N, of changes x (k, dofs), at the facets (k, f, a d). Collective."""
        forces = self._difference @ moved[:, self._differing].transpose(1, 2, 0)
        own = self._sum @ forces.reshape(-1, len(moved))
        if self._between is not None:
            own += self._between @ answers[:, self._nodes.own].T
        return self._nodes.loads(own, self._acting)


def _with_room(kept: Array, one: Array, count: int) -> Array:
    """The first `count` of what is `kept`, (n, ...), and as much room again for more like `one`."""
    more: Array = np.empty((max(2 * count, 32), *one.shape))
    if count:
        more[:count] = kept[:count]
    return more


def _less(columns: Array, images: Array, parts: Array) -> tuple[Array, Array]:
    """`columns` (n, ...) less what of them `images` (n, k) can be, whose `parts` (k, r) make them
    orthonormal, and the coefficients (k, ...) of the images in that. Done once more against
    rounding.
    """
    coefficients = np.zeros((images.shape[1], *columns.shape[1:]))
    for _ in range(2):
        found = parts @ (parts.T @ (images.T @ columns))
        columns, coefficients = columns - images @ found, coefficients + found
    return columns, coefficients


def _orthonormal(columns: Array) -> Array:
    """Parts (k, r) of the `columns` (n, k) with which their combinations are orthonormal."""
    squares, vectors = np.linalg.eigh(columns.T @ columns)
    good = squares > DEPENDENT**2 * squares.max(initial=0.0)
    return np.asarray(vectors[:, good] / np.sqrt(squares[good]))
