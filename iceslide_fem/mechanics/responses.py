"""Exact contact changes in a solve with old factors, by recycled responses.

Let M be the factorised earlier tangent, and D the difference of the present contact to that in M.
The loads w of D act on contact nodes only:

    (M + D) x = b,    x = M^-1 (b - w),    w = D x:    (1 + D M^-1) w = D M^-1 b.

Solutions M^-1 w are kept as long as the factors. w is first approximated by the kept loads, with
the least residual. A new solve treats the residual as the next load, and so on (GMRES with a
recycled space: Parks et al., SIAM J. Sci. Comput. 28 (2006) 1651). Factors that solve for several
loads in little more time than for one get the residual in parts. Points touch and lift along lines
across the sliding direction, and the response to a single line is more reusable than that to all at
once.
"""

from __future__ import annotations

from collections.abc import Callable

import numpy as np
from numpy.typing import NDArray
from scipy.sparse import csr_matrix

from iceslide_fem.mechanics.contact_nodes import ContactNodes
from iceslide_fem.runtime.arrays import Array

# Largest number of solves for one change, and of kept responses before a new factorisation.
MOST_SOLVES, MOST_KEPT = 20, 200
# Images of kept loads are dropped if they are linear combinations of others to this tolerance.
DEPENDENT = 1e-6
# The residual of a solve is the next load. If it is more than this fraction of the one before, the
# latest image is the next load instead.
ENOUGH = 0.8
# Cost of solving for the parts of a load at once, in single solves.
PARTS_COST = 1.5

# Function from contact loads (k, n) to changes of this rank's dofs with ghosts (k, dofs).
# Collective.
Answered = Callable[[Array], Array]


class Responses:
    """Responses of the factors to loads on contact `nodes`, kept until they are cleared.

    stale: whether new factors would reduce the cost. They do if the last change took more solves
    than the average since the factorisation, with the cost of the factorisation.
    """

    def __init__(self, nodes: ContactNodes, cost: float, many: bool = False) -> None:
        """cost: of new factors, in solves; many: whether they solve for many loads at once."""
        self._nodes, self._cost, self._many = nodes, cost, many
        # Loads (k, n), N, changes of this rank's dofs (k, dofs), m, and changes at the facets (k,
        # f, a d), m. The arrays have more room than the `_recycled` rows.
        self._loads: Array = np.zeros((0, nodes.n_loads))
        self._answers: Array = np.zeros((0, 0))
        self._moved: Array = np.zeros((0, 0, 0))
        self.clear()
        self._differing: NDArray[np.intp] = np.zeros(0, dtype=np.intp)  # facets
        self._difference: Array = np.zeros(0)
        self._between: csr_matrix | None = None
        self._acting = np.array([nodes.n_loads - 1])  # indices of loads
        self._sum = nodes.summing(self._differing, self._acting)  # from facet forces to loads
        self._resultant = nodes.resultant(self._acting)

    def clear(self) -> None:
        """Drop all responses, after a new factorisation."""
        self._recycled = 0
        self._spent, self._changes, self.stale = self._cost, 0, False

    def differ(self, difference: Array, walls: csr_matrix | None = None) -> None:
        """Set the difference of the contact tangent to that in the factors. Collective.

        difference: of the contact in the factors to the present one, (f, a d, a d), N/m; walls:
        difference of the present stiffness of self-contact to that in the factors.
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
        """Correction to subtract from the factors' `answer`, with a residual of at most `limit`
        (N).

        answered: solves with the factors. The norm of the residual includes its resultant.
        Collective.
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
        """Keep a load and its response."""
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
        """Weighted images (1 + D M^-1) w of kept loads w from the `first` on, (a + d, k), N.
        Collective.
        """
        kept = slice(first, self._recycled)
        if first == self._recycled:
            return self._weighed(np.zeros((self._acting.size, 0)))
        images = self._differing_loads(self._answers[kept], self._moved[kept])
        images += self._loads[kept][:, self._acting].T
        return self._weighed(images)

    def _weighed(self, loads: Array) -> Array:
        """Loads (a, k) with their resultants appended, so the residual is minimised in both."""
        return np.concatenate([loads, self._resultant @ loads])

    def _differing_loads(self, answers: Array, moved: Array) -> Array:
        """Loads D x (a, k), N, of changes x (k, dofs), at the facets (k, f, a d). Collective."""
        forces = self._difference @ moved[:, self._differing].transpose(1, 2, 0)
        own = self._sum @ forces.reshape(-1, len(moved))
        if self._between is not None:
            own += self._between @ answers[:, self._nodes.own].T
        return self._nodes.loads(own, self._acting)


def _with_room(kept: Array, one: Array, count: int) -> Array:
    """The first `count` rows of `kept` (n, ...), in an array of twice the size for more rows."""
    more: Array = np.empty((max(2 * count, 32), *one.shape))
    if count:
        more[:count] = kept[:count]
    return more


def _less(columns: Array, images: Array, parts: Array) -> tuple[Array, Array]:
    """`columns` (n, ...) minus their projection on `images` (n, k), and its coefficients (k, ...).

    parts (k, r) orthonormalise the images. The projection is repeated once against rounding.
    """
    coefficients = np.zeros((images.shape[1], *columns.shape[1:]))
    for _ in range(2):
        found = parts @ (parts.T @ (images.T @ columns))
        columns, coefficients = columns - images @ found, coefficients + found
    return columns, coefficients


def _orthonormal(columns: Array) -> Array:
    """Coefficients (k, r) that make the `columns` (n, k) orthonormal."""
    squares, vectors = np.linalg.eigh(columns.T @ columns)
    good = squares > DEPENDENT**2 * squares.max(initial=0.0)
    return np.asarray(vectors[:, good] / np.sqrt(squares[good]))
