"""Makes the example of a user's own mesh: a tread block with rounded edges and a sipe.

    python meshes/make_siped_block.py [FOLDER]

writes siped_block.msh (a slice) and siped_block_half.msh (half a block, y >= 0). What
iceslide_fem needs of such a mesh: metres, the lowest points at 0, one type of first-order
cells, and the names rubber, contact, plate and (for half a block) symmetry.
"""

import sys
from pathlib import Path

import gmsh

LENGTH, HEIGHT, HALF_WIDTH = 6e-3, 4e-3, 3e-3
RADIUS = 0.4e-3  # of the rounded leading and trailing edges
SIPE_WIDTH, SIPE_DEPTH = 0.4e-3, 2.8e-3
CONTACT_HEIGHT = 1.6e-3  # the sides may touch the ice up to here
FINE, COARSE = 0.24e-3, 0.9e-3  # cell sizes at the bottom and at the top


def outline(place):
    """Face of the slice, whose points are at `place(x, height)`; its contact and plate lines.

    The walls of the sipe belong to the contact, since they fold onto the ice when the two halves
    bend. (They would press on each other if they were named `walls`.)
    """
    half, slot = LENGTH / 2, SIPE_WIDTH / 2
    corners = {  # counterclockwise from the trailing end, with the wanted cell sizes
        "trailing top": (-half, HEIGHT, COARSE),
        "trailing side": (-half, CONTACT_HEIGHT, 2 * FINE),
        "trailing round": (-half, RADIUS, FINE),
        "trailing bottom": (-half + RADIUS, 0, FINE),
        "sipe trailing": (-slot, 0, FINE),
        "sipe trailing top": (-slot, SIPE_DEPTH - slot, FINE),
        "sipe top": (0, SIPE_DEPTH, FINE),
        "sipe leading top": (slot, SIPE_DEPTH - slot, FINE),
        "sipe leading": (slot, 0, FINE),
        "leading bottom": (half - RADIUS, 0, FINE),
        "leading round": (half, RADIUS, FINE),
        "leading side": (half, CONTACT_HEIGHT, 2 * FINE),
        "leading top": (half, HEIGHT, COARSE),
    }
    centres = {  # of the arcs that begin at these corners
        "trailing round": (-half + RADIUS, RADIUS),
        "sipe trailing top": (0, SIPE_DEPTH - slot),
        "sipe top": (0, SIPE_DEPTH - slot),
        "leading bottom": (half - RADIUS, RADIUS),
    }
    geometry = gmsh.model.geo
    points = {
        name: geometry.addPoint(*place(x, height), size)
        for name, (x, height, size) in corners.items()
    }
    names, lines = list(corners), {}
    for begin, end in zip(names, names[1:] + names[:1], strict=True):
        if begin in centres:
            centre = geometry.addPoint(*place(*centres[begin]))
            lines[begin] = geometry.addCircleArc(points[begin], centre, points[end])
        else:
            lines[begin] = geometry.addLine(points[begin], points[end])
    face = geometry.addPlaneSurface([geometry.addCurveLoop(list(lines.values()))])
    plate = [lines.pop("leading top")]
    for free in ("trailing top", "leading side", "sipe trailing top", "sipe top"):
        del lines[free]
    return face, list(lines.values()), plate


def make(path, layers):
    """Mesh the slice, or with `layers` > 0 half a block of that many cells, and write it."""
    gmsh.model.add(path.stem)
    geometry = gmsh.model.geo
    face, contact, plate = outline(lambda x, height: (x, 0, height) if layers else (x, height, 0))
    if layers:
        made = geometry.extrude([(2, face)], 0, HALF_WIDTH, 0, [layers], recombine=True)
    geometry.synchronize()
    for name, lines in (("contact", contact), ("plate", plate)):
        if layers:  # the side that a line of the face has swept
            sides = [tag for dim, tag in made[2:] if dim == 2]
            lines = [
                side
                for side in sides
                for line in lines
                if (1, line) in gmsh.model.getBoundary([(2, side)], oriented=False)
            ]
        gmsh.model.addPhysicalGroup(2 if layers else 1, lines, name=name)
    if layers:
        gmsh.model.addPhysicalGroup(2, [face], name="symmetry")
        gmsh.model.addPhysicalGroup(3, [made[1][1]], name="rubber")
    else:
        gmsh.model.addPhysicalGroup(2, [face], name="rubber")
    gmsh.option.setNumber("Mesh.Algorithm", 8)  # triangles that pair to good quadrilaterals
    gmsh.option.setNumber("Mesh.RecombinationAlgorithm", 2)  # leaves quadrilaterals only
    gmsh.model.mesh.setRecombine(2, face)
    gmsh.model.mesh.generate(3 if layers else 2)
    gmsh.write(str(path))


def main():
    """Write both meshes."""
    folder = Path(sys.argv[1]) if len(sys.argv) > 1 else Path(__file__).parent
    gmsh.initialize()
    gmsh.option.setNumber("General.Terminal", 0)
    make(folder / "siped_block.msh", layers=0)
    make(folder / "siped_block_half.msh", layers=5)
    gmsh.finalize()


if __name__ == "__main__":
    main()
