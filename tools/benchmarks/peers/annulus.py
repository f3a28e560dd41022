"""The gel annulus of docs/verification.md as a mesh of 20- or 27-node bricks, for the peers.

Nodes lie on the exact circles; meshes are graded towards plates and cavity by the same two maps as
estimator/mesh/annulus.hpp, so that no code wins by a better mesh.
"""

import math

INNER_MM, OUTER_MM, HEIGHT_MM = 22.5, 50.0, 85.0
PLATE_GRADING, WALL_GRADING = 0.75, 0.5
PRESSURE_KPA, C1_KPA = 6.0, 6.5
RADII_MM = (22.5, 30.0, 36.25, 43.0, 50.0)


def height_mm(s):
    return HEIGHT_MM / 2 * ((1 - PLATE_GRADING) * s + PLATE_GRADING * math.sin(math.pi * s / 2))


def radius_mm(t):
    linear = INNER_MM + (OUTER_MM - INNER_MM) * t
    return (1 - WALL_GRADING) * linear + WALL_GRADING * INNER_MM * (OUTER_MM / INNER_MM) ** t


class QuadraticGrid:
    """Half-step grid points (i, j, k), i around (2 n1, closed), j up (2 n2 + 1), k outwards (2 n3 + 1)."""

    def __init__(self, around, up, through):
        self.elements = (around, up, through)

    def point_mm(self, i, j, k):
        n1, n2, n3 = self.elements
        angle = math.pi * i / n1
        radius = radius_mm(k / (2 * n3))
        return (radius * math.cos(angle), radius * math.sin(angle), height_mm(j / n2 - 1))

    def number(self, i, j, k):
        n1, n2, _ = self.elements
        return i % (2 * n1) + 2 * n1 * (j + (2 * n2 + 1) * k)

    def points_mm(self):
        n1, n2, n3 = self.elements
        return [
            self.point_mm(i, j, k)
            for k in range(2 * n3 + 1)
            for j in range(2 * n2 + 1)
            for i in range(2 * n1)
        ]

    def cells(self):
        """Grid origin (i, j, k) of each element; it covers two half steps along each direction."""
        n1, n2, n3 = self.elements
        return [(2 * a, 2 * b, 2 * c) for c in range(n3) for b in range(n2) for a in range(n1)]

    def equator(self):
        """Grid points along the x axis at mid-height, from the inner to the outer face."""
        return [(0, self.elements[1], k) for k in range(2 * self.elements[2] + 1)]


def profile_mm(radial_mm, through):
    """Displacement at RADII_MM from its values at the equator's nodes: a parabola within each element."""
    radii = [radius_mm(k / (2 * through)) for k in range(2 * through + 1)]
    profile = []
    for r in RADII_MM:
        e = max(c for c in range(through) if c == 0 or radii[2 * c] <= r)
        r0, r1, r2 = radii[2 * e : 2 * e + 3]
        u0, u1, u2 = radial_mm[2 * e : 2 * e + 3]
        profile.append(
            u0 * (r - r1) * (r - r2) / ((r0 - r1) * (r0 - r2))
            + u1 * (r - r0) * (r - r2) / ((r1 - r0) * (r1 - r2))
            + u2 * (r - r0) * (r - r1) / ((r2 - r0) * (r2 - r1))
        )
    return profile
