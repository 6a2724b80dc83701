"""Write STEP files of small tread blocks, in mm: `python meshes/make_step.py FOLDER [NAME ...]`.

All are 20 x 10 x 8 mm. `plain`; `slick` with lower edges rounded by 0.5 mm; `sipes4` with four
straight sipes of 0.4 x 6 mm; `profile` with two of them and round edges; `zigzag` with two sipes
that wave; `tapered` by 3 degrees and chamfered; `compound` of two solids, with a groove.
"""

import sys
from math import radians, tan
from pathlib import Path

import gmsh

L, W, H = 20.0, 10.0, 8.0
SIPE, DEEP, ROUND = 0.4, 6.0, 0.5


def block(height=H, z=0.0):
    """A block from the height z."""
    return gmsh.model.occ.addBox(-L / 2, -W / 2, z, L, W, height)


def sipe(x):
    """The solid of a straight sipe at x."""
    return 3, gmsh.model.occ.addBox(x - SIPE / 2, -W / 2 - 1, -1, SIPE, W + 2, DEEP + 1)


def wave(x, amplitude=0.5, length=4.0):
    """The solid of a sipe that waves around x."""
    occ, steps = gmsh.model.occ, int((W + 2) / (length / 2)) + 1
    way = [(x - amplitude * (-1) ** i, -W / 2 - 1 + i * length / 2) for i in range(steps)]
    around = [(a - SIPE / 2, y) for a, y in way] + [(a + SIPE / 2, y) for a, y in reversed(way)]
    points = [occ.addPoint(a, y, -1) for a, y in around]
    lines = [occ.addLine(*pair) for pair in zip(points, points[1:] + points[:1], strict=True)]
    face = occ.addPlaneSurface([occ.addCurveLoop(lines)])
    return next(one for one in occ.extrude([(2, face)], 0, 0, DEEP + 1) if one[0] == 3)


def cut(solids):
    """A block without some solids."""
    return gmsh.model.occ.cut([(3, block())], solids)[0][0][1]


def lower_edges(solid, across=False):
    """Numbers of the edges of a solid at the ice; across: only those along y."""
    gmsh.model.occ.synchronize()
    faces = gmsh.model.getBoundary([(3, solid)], oriented=False)
    found = set()
    for _, edge in gmsh.model.getBoundary(faces, combined=False, oriented=False):
        x0, y0, z0, x1, y1, z1 = gmsh.model.getBoundingBox(1, edge)
        if max(abs(z0), abs(z1)) < 1e-5 and (not across or y1 - y0 > W - 1e-3):
            found.add(edge)
    return sorted(found)


def rounded(solid, across=False):
    """A solid with round edges at the ice."""
    gmsh.model.occ.fillet([solid], lower_edges(solid, across), [ROUND])


def tapered():
    """A block whose sides lean by 3 degrees, with chamfers at the ice."""
    occ, more = gmsh.model.occ, tan(radians(3.0)) * H
    wires = []
    for z, length, width in ((0, L, W), (H, L + 2 * more, W + 2 * more)):
        signs = ((-1, -1), (1, -1), (1, 1), (-1, 1))
        corners = [occ.addPoint(a * length / 2, b * width / 2, z) for a, b in signs]
        pairs = zip(corners, corners[1:] + corners[:1], strict=True)
        wires.append(occ.addWire([occ.addLine(*pair) for pair in pairs]))
    (solid,) = (one[1] for one in occ.addThruSections(wires, makeRuled=True) if one[0] == 3)
    edges = lower_edges(solid)
    faces = gmsh.model.getBoundary([(3, solid)], oriented=False)
    flat = [face for _, face in faces if abs(gmsh.model.getBoundingBox(2, face)[5]) < 1e-5]
    occ.chamfer([solid], edges, flat * len(edges), [0.4])


def compound():
    """A block with a groove along x, below a base of another solid."""
    groove = gmsh.model.occ.addBox(-L / 2 - 1, -1, -1, L + 2, 2, 5)
    gmsh.model.occ.cut([(3, block(6.0))], [(3, groove)])
    block(2.0, 6.0)


TREADS = {
    "plain": block,
    "slick": lambda: rounded(block()),
    "sipes4": lambda: cut([sipe(x) for x in (-6, -2, 2, 6)]),
    "profile": lambda: rounded(cut([sipe(x) for x in (-4, 4)]), across=True),
    "zigzag": lambda: cut([wave(-4), wave(4)]),
    "tapered": tapered,
    "compound": compound,
}


def write(name, folder, suffix=".step"):
    """Write a tread; returns its volume, mm3."""
    gmsh.model.add(name)
    TREADS[name]()
    gmsh.model.occ.synchronize()
    gmsh.write(str(Path(folder) / f"{name}{suffix}"))
    volume = sum(gmsh.model.occ.getMass(*solid) for solid in gmsh.model.getEntities(3))
    gmsh.model.remove()
    return volume


if __name__ == "__main__":
    if not sys.argv[1:] or sys.argv[1].startswith("-") or set(sys.argv[2:]) - set(TREADS):
        sys.exit(__doc__)
    Path(sys.argv[1]).mkdir(parents=True, exist_ok=True)
    gmsh.initialize(readConfigFiles=False, interruptible=False)
    gmsh.option.setNumber("General.Terminal", 0)
    for name in sys.argv[2:] or TREADS:
        print(name, f"{write(name, sys.argv[1]):.3f} mm3")
    gmsh.finalize()
