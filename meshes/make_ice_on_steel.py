"""Makes the example of a user's own mesh of the ice: 1 mm of ice on 10 mm of steel.

    python meshes/make_ice_on_steel.py [FOLDER]

writes ice_on_steel.msh (a slice) and ice_on_steel_half.msh (half a block, y >= 0), for rubber that
is 1 mm long and wide. What iceslide_fem needs of such a mesh: metres, the surface at 0 and all else
below it, quadrilaterals or hexahedra, which gmsh makes where curves and surfaces are transfinite,
and the names ice, those of the layers (here steel), surface, base (where a temperature is held) and
(for half a block) symmetry.
"""

import math
import sys
from pathlib import Path

import gmsh

CONTACT, MARGIN = 0.5e-3, 0.5e-3  # half the length of the rubber, and ice before and behind it
ICE, STEEL = 1e-3, 10e-3  # thickness
FIRST, RATIO = 2e-6, 1.4  # first layer of cells, and how much thicker each is than the one above
CELLS = {"slice": (24, 6), "half": (8, 2)}  # along x below the contact, and beyond on each side
BESIDE = 1.5  # ratio of cells beyond the contact, which grow away from it
ACROSS = (4, 2)  # cells along y, below half of the contact and beyond


def counted(length, first):
    """Number of cells that fill `length` from about `first` on, each RATIO times the one before."""
    return math.ceil(math.log1p(length / first * (RATIO - 1)) / math.log(RATIO))


def shares(count, ratio):
    """Where `count` cells that grow by `ratio` end, relative to their whole length."""
    return [(ratio ** (n + 1) - 1) / (ratio**count - 1) for n in range(count)]


def section(place, below, beyond):
    """Surfaces of the section in x and z, whose points are at `place(x, z)`: of ice and of steel.

    below, beyond: cells along x below the contact and beyond it. Also the lines of the surface and
    of the base.
    """
    geometry = gmsh.model.geo
    in_ice = counted(ICE, FIRST)
    in_steel = counted(STEEL, FIRST * RATIO**in_ice)
    x = (-CONTACT - MARGIN, -CONTACT, CONTACT, CONTACT + MARGIN)
    columns = ((beyond, 1 / BESIDE), (below, 1.0), (beyond, BESIDE))  # cells, their ratio
    rows = (in_ice, in_steel)
    points = [
        [geometry.addPoint(*place(at, -depth)) for at in x] for depth in (0, ICE, ICE + STEEL)
    ]
    along = [
        [geometry.addLine(one, other) for one, other in zip(row, row[1:], strict=False)]
        for row in points
    ]
    down = [
        [geometry.addLine(one, other) for one, other in zip(*pair, strict=True)]
        for pair in zip(points, points[1:], strict=False)
    ]
    for row in along:
        for line, (count, ratio) in zip(row, columns, strict=True):
            geometry.mesh.setTransfiniteCurve(line, count + 1, "Progression", ratio)
    for row, count in zip(down, rows, strict=True):
        for line in row:
            geometry.mesh.setTransfiniteCurve(line, count + 1, "Progression", RATIO)
    surfaces = []
    for level in range(2):
        for column in range(3):
            loop = geometry.addCurveLoop(
                [
                    down[level][column],
                    along[level + 1][column],
                    -down[level][column + 1],
                    -along[level][column],
                ]
            )
            surfaces.append(geometry.addPlaneSurface([loop]))
            geometry.mesh.setTransfiniteSurface(surfaces[-1])
            geometry.mesh.setRecombine(2, surfaces[-1])
    return surfaces[:3], surfaces[3:], along[0], along[2]


def swept(faces, lines):
    """Volumes that `faces` sweep along y, over half of the contact and the margin, and the sides
    that `lines` sweep.
    """
    inner, outer = ACROSS
    ends = [CONTACT * (n + 1) / inner for n in range(inner)]
    ends += [CONTACT + MARGIN * share for share in shares(outer, BESIDE)]
    way = ends[-1]
    made = gmsh.model.geo.extrude(
        [(2, face) for face in faces], 0, way, 0, [1] * len(ends), [y / way for y in ends], True
    )
    gmsh.model.geo.synchronize()
    sides = [
        tag
        for dim, tag in made
        if dim == 2
        and any((1, line) in gmsh.model.getBoundary([(2, tag)], oriented=False) for line in lines)
    ]
    return [tag for dim, tag in made if dim == 3], sides


def make(path, kind):
    """Mesh the "slice" or the "half" of a block, and write it."""
    gmsh.model.add(path.stem)
    half = kind == "half"
    ice, steel, surface, base = section(lambda x, z: (x, 0, z) if half else (x, z, 0), *CELLS[kind])
    gmsh.model.geo.synchronize()
    cells = {"ice": ice, "steel": steel}
    facets = {"surface": surface, "base": base}
    if half:
        cells["ice"], facets["surface"] = swept(ice, surface)
        cells["steel"], facets["base"] = swept(steel, base)
        facets["symmetry"] = [*ice, *steel]
    dim = 3 if half else 2
    for name, tags in cells.items():
        gmsh.model.addPhysicalGroup(dim, tags, name=name)
    for name, tags in facets.items():
        gmsh.model.addPhysicalGroup(dim - 1, tags, name=name)
    gmsh.model.mesh.generate(dim)
    gmsh.write(str(path))


def main():
    """Write both meshes."""
    folder = Path(sys.argv[1]) if len(sys.argv) > 1 else Path(__file__).parent
    gmsh.initialize()
    gmsh.option.setNumber("General.Terminal", 0)
    make(folder / "ice_on_steel.msh", "slice")
    make(folder / "ice_on_steel_half.msh", "half")
    gmsh.finalize()


if __name__ == "__main__":
    main()
