#pragma once
// The same cubic in Bezier form, exactly: what drawing programs know how to draw.
//
// One direction: a cubic with end values v0, v1 and end slopes d0, d1 (per xi) has the control values
// v0, v0 + d0/3, v1 - d1/3, v1 over the Bernstein functions (3 choose i) xi^i (1 - xi)^(3 - i). The tensor
// product does this along xi1, xi2, xi3 in turn. Control point i1 + 4 i2 + 16 i3, i = 0..3.
//
// `bezier_through` is the cubic through samples at 4x4x4 places, as control values: how stress and strain, which are no
// polynomials, are drawn.

#include <Eigen/Dense>
#include <array>
#include <cstddef>
#include <functional>
#include <vector>

#include "estimator/mesh/hermite_mesh.hpp"

namespace diastole {

inline constexpr size_t bezier_points = 64;

/// Row = component, column = control point.
using BezierField = Eigen::Matrix<double, 3, static_cast<int>(bezier_points)>;

BezierField bezier_of(const ElementField& hermite);

/// `sample` returns the numbers of a place of the element, equally many everywhere, and is asked at the line places `at` in each
/// direction; row of the result = control point, column = number. Precondition: the places differ.
Eigen::MatrixXd bezier_through(const std::array<double, 4>& at,
                               const std::function<Eigen::VectorXd(const Xi&)>& sample);

/// Where VTK keeps control point (i1, i2, i3) of a VTK_BEZIER_HEXAHEDRON of degree 3: corners, then edges, then
/// faces, then the inside (vtkHigherOrderHexahedron::PointIndexFromIJK):
///
///      7----18---19----6     edges: along xi1 8-9 (front bottom), 12-13 (back bottom), 16-17, 20-21 (top);
///     /|              /|     along xi2 14-15 left, 10-11 right (bottom), 22-23, 18-19 (top); along xi3 24-25 at
///    4----16---17----5 |     corner 0, 26-27 at 1, 28-29 at 2, 30-31 at 3
///    | 3----12---13--|-2     faces (4 each): xi1 = 0, xi1 = 1, xi2 = 0, xi2 = 1, xi3 = 0, xi3 = 1: 32-55
///    |/              |/      inside: 56-63
///    0-----8----9----1
size_t vtk_place_of(size_t i1, size_t i2, size_t i3);

/// Adds an element's control values, row = control point, to an array in that order.
void append_in_vtk_order(const Eigen::MatrixXd& control, std::vector<double>& values);

/// The same of several arrays (GridArray of estimator/io/vtkhdf_file.hpp) whose components are the columns, one array after the other.
template <class Array>
void append_in_vtk_order(const Eigen::MatrixXd& control, std::vector<Array>& arrays) {
  Eigen::Index column = 0;
  for (Array& array : arrays) {
    const auto width = static_cast<Eigen::Index>(array.components);
    append_in_vtk_order(control.middleCols(column, width), array.values);
    column += width;
  }
}

}  // namespace diastole
