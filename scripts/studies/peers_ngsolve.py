"""The cube of `peers` in NGSolve, run by the Python that has it; imports nothing of this project.

Full Newton on the displacement, or on displacement and pressure with the inner unknowns condensed
in each cell. The lower faces meet the ice by a penalty's energy, friction is mu times its pressure.
Takes a NumPy archive with the mesh and options in JSON; prints as JSON the displacement of the
plate (m, null if it was not found), the unknowns, and processor seconds of the solution and of all.
"""

from __future__ import annotations

import json
import math
import sys
from time import process_time
from typing import Any

import numpy as np

TOLERANCE, MOST, EASY = 1e-5, 30, 8  # of the force; Newton iterations at one load
FIRST_STRAIN, SMALLEST = 0.06, 1e-3  # pressure over E of the first load; smallest step of the load
DAMPINGS = [0.5**n for n in range(6)]


def loaded(path: str) -> Any:
    """NGSolve's mesh of the archive's points, cells and facets."""
    from netgen.csg import Pnt
    from netgen.meshing import Element2D, Element3D, FaceDescriptor, MeshPoint
    from netgen.meshing import Mesh as NetgenMesh
    from ngsolve import Mesh

    data, mesh = np.load(path), NetgenMesh(dim=3)
    numbers = [mesh.Add(MeshPoint(Pnt(*map(float, point)))) for point in data["points"]]
    mesh.SetMaterial(1, "rubber")
    for cell in data["cells"].tolist():
        mesh.Add(Element3D(1, [numbers[corner] for corner in cell]))
    for number, name in enumerate(("contact", "plate", "symmetry", "free"), 1):
        face = mesh.Add(FaceDescriptor(surfnr=number, domin=1, domout=0, bc=number))
        mesh.SetBCName(number - 1, name)
        for facet in data[name].tolist():
            mesh.Add(Element2D(face, [numbers[corner] for corner in facet]))
    return Mesh(mesh)


class Cube:
    """Forms of the cube on a mesh; the solution `state` under a load."""

    def __init__(self, mesh: Any, options: dict[str, Any]) -> None:
        from ngsolve import (
            L2,
            BilinearForm,
            Det,
            Grad,
            GridFunction,
            Id,
            IfPos,
            InnerProduct,
            NumberSpace,
            Parameter,
            Trace,
            Variation,
            VectorH1,
            ds,
            dx,
            z,
        )

        order, penalty = options["order"], options["penalty"]
        bulk = 2.0 / options["D1"]
        moved = VectorH1(mesh, order=order, dirichletx="plate", dirichlety="plate|symmetry",
                         dirichletz="plate")  # fmt: skip
        # the whole cube goes down with the plate, by a number, and deforms beside that
        parts = [moved, NumberSpace(mesh)] + (
            [L2(mesh, order=order - 1)] if options["mixed"] else []
        )
        space = parts[0]
        for part in parts[1:]:
            space = space * part
        self.space, self.state, self.load = space, GridFunction(space), Parameter(0.0)
        self.unknowns = moved.ndof
        (u, down, *pressure), (v, lower, *_) = space.TnT()
        F = Id(3) + Grad(u)
        J, C = Det(F), F.trans * F
        I1, square = Trace(C), InnerProduct(C, C)
        I2 = 0.5 * (I1 * I1 - square)
        energy = options["C10"] * (J ** (-2 / 3) * I1 - 3)
        energy += options["C01"] * (J ** (-4 / 3) * I2 - 3)
        if pressure:
            p = pressure[0]
            energy += p * (J - 1) - p * p / (2 * bulk)
        else:
            energy += 0.5 * bulk * (J - 1) ** 2
        depth = down - z - u[2]
        touching = IfPos(depth, depth, 0.0)
        more = {"bonus_intorder": 4}
        self.form = BilinearForm(space, condense=True, symmetric=not options["mu"])
        self.form += Variation(energy * dx)
        self.form += Variation(0.5 * penalty * touching**2 * ds("contact", **more))
        area = options["area"]  # of the plate, where its force is shared out evenly
        self.form += Variation(-self.load * options["force"] / area * down * ds("plate"))
        if options["mu"]:
            shear = options["mu"] * penalty * touching
            self.form += shear * v[0] * ds("contact", **more)
        self.sinking = options["force"] / area / penalty
        self.tolerance = TOLERANCE * options["force"]
        self.residual, self.change = self.state.vec.CreateVector(), self.state.vec.CreateVector()

    @property
    def down(self) -> float:
        """How far down the plate is, m."""
        return float(self.state.components[1].vec[0])

    def touch(self, load: float) -> None:
        """Sink in as that fraction of the load does: without contact nothing holds the plate."""
        self.state.components[1].vec[0] = load * self.sinking

    def imbalance(self) -> float:
        """Norm of the residual, which is left in `residual`, on free unknowns."""
        self.form.Apply(self.state.vec, self.residual)
        free = np.array(self.space.FreeDofs(False))
        values = self.residual.FV().NumPy()
        values[~free] = 0.0
        return float(np.linalg.norm(values))

    def direction(self) -> None:
        """Newton's change at the present state, with the inner unknowns of cells condensed."""
        form, change, residual = self.form, self.change, self.residual
        form.AssembleLinearization(self.state.vec)
        inverse = form.mat.Inverse(self.space.FreeDofs(True), inverse="umfpack")
        residual.data += form.harmonic_extension_trans * residual
        change.data = inverse * residual
        change.data += form.harmonic_extension * change
        change.data += form.inner_solve * residual

    def balance(self, load: float) -> int | None:
        """Newton iterations to equilibrium under that fraction of the load; None if not found."""
        self.load.Set(load)
        start = self.state.vec.CreateVector()
        size = self.imbalance()
        for iteration in range(MOST):
            if size <= self.tolerance:
                return iteration
            if not math.isfinite(size):
                return None
            self.direction()
            start.data = self.state.vec
            for damping in DAMPINGS:
                self.state.vec.data = start - damping * self.change
                trial = self.imbalance()
                if trial < 2.0 * size:  # touching points make it rise at times
                    break
            size = trial
        return None


def follow(cube: Cube, first: float) -> bool:
    """Bring the cube under its whole load from a `first` fraction of it; whether it succeeds."""
    done, step = 0.0, first
    cube.touch(first)
    before, last = cube.state.vec.CreateVector(), None
    while done < 1.0:
        load = min(1.0, done + step)
        before.data = cube.state.vec
        if last is not None:
            cube.state.vec.data += (load - done) / (done - last[0]) * (before - last[1])
        taken = cube.balance(load)
        if taken is None:
            cube.state.vec.data = before
            step *= 0.5
            if step < SMALLEST:
                return False
            continue
        kept = before.CreateVector()
        kept.data = before
        last = (done, kept) if done > 0.0 else None
        done = load
        if taken <= EASY:
            step *= 1.5
    return True


def main() -> None:
    """Solve for what the archive and the options (words 1 and 2) say."""
    import ngsolve

    options = json.loads(sys.argv[2])
    ngsolve.SetNumThreads(1)
    cube = Cube(loaded(sys.argv[1]), options)
    started = process_time()
    solved = follow(cube, min(1.0, FIRST_STRAIN / options["strain"]))
    seconds = process_time() - started
    print(json.dumps([cube.down if solved else None, cube.unknowns, seconds, process_time()]))


if __name__ == "__main__":
    main()
