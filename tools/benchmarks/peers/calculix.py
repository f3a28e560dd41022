"""The 6 kPa annulus for CalculiX 2.20 (Debian: calculix-ccx): its input deck, and its answer.

    calculix.py write AROUND UP THROUGH annulus.inp
    calculix.py read AROUND UP THROUGH annulus.dat annulus.log RESULT.json

CalculiX has no incompressible solid: W = C1 (I1_bar - 3) + (J - 1)^2 / D1 with a bulk modulus of 1000 C1 (ten
times that changes the inner wall by less than 0.1 %), in 20-node bricks with reduced integration, its best
element for it. Pressure on element faces follows them when NLGEOM is on.
"""

import json
import sys

import annulus

BULK_KPA = 1000 * annulus.C1_KPA
# Half-step offsets of C3D20's nodes: four corners below, four above, edges below, edges above, upright edges.
NODES = [(0, 0, 0), (2, 0, 0), (2, 2, 0), (0, 2, 0), (0, 0, 2), (2, 0, 2), (2, 2, 2), (0, 2, 2),
         (1, 0, 0), (2, 1, 0), (1, 2, 0), (0, 1, 0), (1, 0, 2), (2, 1, 2), (1, 2, 2), (0, 1, 2),
         (0, 0, 1), (2, 0, 1), (2, 2, 1), (0, 2, 1)]  # fmt: skip


def deck(grid):
    points = grid.points_mm()
    bricks = [[grid.number(*(c + d for c, d in zip(cell, node))) for node in NODES] for cell in grid.cells()]
    used = sorted({node for brick in bricks for node in brick})
    lines = ["*NODE"]
    lines += ["%d,%.12g,%.12g,%.12g" % (node + 1, *points[node]) for node in used]
    lines += ["*ELEMENT,TYPE=C3D20R,ELSET=GEL"]
    for number, brick in enumerate(bricks, 1):
        row = [str(number)] + [str(node + 1) for node in brick]
        lines += [",".join(row[:16]) + ",", ",".join(row[16:])]
    lines += ["*ELSET,ELSET=INNER"]
    lines += ["%d," % number for number, cell in enumerate(grid.cells(), 1) if cell[2] == 0]
    lines += ["*NSET,NSET=PLATES"]
    lines += ["%d," % (n + 1) for n in used if abs(abs(points[n][2]) - annulus.HEIGHT_MM / 2) < 1e-9]
    lines += ["*NSET,NSET=EQUATOR"]
    lines += ["%d," % (grid.number(*index) + 1) for index in grid.equator()]
    lines += ["*MATERIAL,NAME=GEL", "*HYPERELASTIC,NEO HOOKE", "%g,%g" % (annulus.C1_KPA, 2 / BULK_KPA),
              "*SOLID SECTION,ELSET=GEL,MATERIAL=GEL", "*BOUNDARY", "PLATES,1,3",
              "*STEP,NLGEOM,INC=200", "*STATIC", "0.5,1.", "*DLOAD", "INNER,P1,%g" % annulus.PRESSURE_KPA,
              "*NODE PRINT,NSET=EQUATOR", "U", "*END STEP"]  # fmt: skip
    return "\n".join(lines) + "\n", 3 * len(used)


def read(grid, dat, log):
    blocks = dat.split("displacements")
    last = blocks[-1].splitlines()
    time = float(last[0].split()[-1])
    radial = {int(row[0]): float(row[1]) for row in (line.split() for line in last[1:]) if row}
    values = [radial[grid.number(*index) + 1] for index in grid.equator()]
    return {
        "converged": time == 1.0,
        "unknowns": deck(grid)[1],
        "newton": "%d in %d increments" % (log.count(" iteration "), len(blocks) - 1),
        "radial_mm": annulus.profile_mm(values, grid.elements[2]),
    }


def text_of(path):
    with open(path, encoding="utf-8") as file:
        return file.read()


def main():
    grid = annulus.QuadraticGrid(*(int(text) for text in sys.argv[2:5]))
    if sys.argv[1] == "write":
        output, target = deck(grid)[0], sys.argv[5]
    else:
        output, target = json.dumps(read(grid, text_of(sys.argv[5]), text_of(sys.argv[6]))), sys.argv[7]
    with open(target, "w", encoding="utf-8") as file:
        file.write(output)


main()
