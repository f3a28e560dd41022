"""The 6 kPa annulus with FEniCSx 0.5 (Debian: python3-dolfinx): quadratic bricks, element-wise linear pressure.

    fenicsx.py AROUND UP THROUGH RESULT.json

Incompressible W = C1 (I1 - 3), follower pressure, whole load in one step, Newton's method with MUMPS.
"""

import json
import sys
import time

import numpy as np
import petsc4py

petsc4py.init(["fenicsx"])
import basix
import dolfinx
import ufl
from dolfinx import fem, mesh, nls
from mpi4py import MPI
from petsc4py import PETSc

import annulus

QUADRATURE_DEGREE = 4  # 3 x 3 x 3 Gauss points


def make_mesh(grid):
    # The local node order of a quadratic brick is that of its reference points.
    reference = basix.create_element(
        basix.ElementFamily.P, basix.CellType.hexahedron, 2, basix.LagrangeVariant.gll_warped
    ).points
    halves = np.rint(2 * reference).astype(int)
    cells = [[grid.number(*(np.array(cell) + half)) for half in halves] for cell in grid.cells()]
    geometry = ufl.Mesh(ufl.VectorElement("Lagrange", ufl.Cell("hexahedron", geometric_dimension=3), 2))
    return mesh.create_mesh(MPI.COMM_SELF, np.array(cells), np.array(grid.points_mm()), geometry)


def faces_at(domain, marker, value):
    facets = mesh.locate_entities_boundary(domain, 2, marker)
    return np.sort(facets), np.full(len(facets), value, dtype=np.int32)


def main():
    elements = [int(text) for text in sys.argv[1:4]]
    grid = annulus.QuadraticGrid(*elements)
    domain = make_mesh(grid)
    cell = domain.ufl_cell()
    space = fem.FunctionSpace(
        domain,
        ufl.MixedElement(ufl.VectorElement("Q", cell, 2), ufl.FiniteElement("DPC", cell, 1)),
    )
    state = fem.Function(space)
    u, p = ufl.split(state)
    test = ufl.TestFunction(space)
    v, q = ufl.split(test)

    # Linear facet geometry: all four corners of an inner facet are on the inner circle.
    inner = lambda x: np.abs(np.hypot(x[0], x[1]) - annulus.INNER_MM) < 1e-6
    facets, values = faces_at(domain, inner, 1)
    ds = ufl.Measure("ds", domain=domain, subdomain_data=mesh.meshtags(domain, 2, facets, values),
                     metadata={"quadrature_degree": QUADRATURE_DEGREE})
    dx = ufl.dx(domain, metadata={"quadrature_degree": QUADRATURE_DEGREE})

    f = ufl.Identity(3) + ufl.grad(u)
    j = ufl.det(f)
    cofactor = j * ufl.inv(f).T
    piola = 2 * annulus.C1_KPA * f - p * cofactor
    load = annulus.PRESSURE_KPA * ufl.dot(cofactor * ufl.FacetNormal(domain), v) * ds(1)
    residual = ufl.inner(piola, ufl.grad(v)) * dx + load - (j - 1) * q * dx

    plates = mesh.locate_entities_boundary(
        domain, 2, lambda x: np.abs(np.abs(x[2]) - annulus.HEIGHT_MM / 2) < 1e-6
    )
    displacement_space, _ = space.sub(0).collapse()
    held = fem.locate_dofs_topological((space.sub(0), displacement_space), 2, plates)
    fixed = fem.dirichletbc(fem.Function(displacement_space), held, space.sub(0))

    state.sub(1).interpolate(lambda x: np.full(x.shape[1], 2 * annulus.C1_KPA))  # balance at rest
    problem = fem.petsc.NonlinearProblem(residual, state, [fixed])
    solver = nls.petsc.NewtonSolver(MPI.COMM_SELF, problem)
    solver.rtol = solver.atol = 1e-9
    solver.convergence_criterion = "incremental"
    solver.max_it = 30
    krylov = solver.krylov_solver
    krylov.setType(PETSc.KSP.Type.PREONLY)
    krylov.getPC().setType(PETSc.PC.Type.LU)
    krylov.getPC().setFactorSolverType("mumps")

    begun, processor_begun = time.perf_counter(), time.process_time()
    steps, converged = solver.solve(state)
    solve_s, solve_processor_s = time.perf_counter() - begun, time.process_time() - processor_begun

    moved = state.sub(0).collapse()
    places = displacement_space.tabulate_dof_coordinates()
    radial_mm = []
    for index in grid.equator():
        node = int(np.argmin(np.linalg.norm(places - np.array(grid.point_mm(*index)), axis=1)))
        radial_mm.append(float(moved.x.array[3 * node]))
    result = {
        "converged": bool(converged),
        "unknowns": space.dofmap.index_map.size_global * space.dofmap.index_map_bs,
        "newton": str(steps),
        "solve_s": solve_s,
        "solve_processor_s": solve_processor_s,
        "radial_mm": annulus.profile_mm(radial_mm, elements[2]),
    }
    with open(sys.argv[4], "w", encoding="utf-8") as file:
        json.dump(result, file)


main()
