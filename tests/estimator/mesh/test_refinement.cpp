// Halved elements are the same body, with the same faces, fibres and collapsed edges.

#include <gtest/gtest.h>

#include <random>
#include <stdexcept>

#include "estimator/mesh/annulus.hpp"
#include "estimator/mesh/block.hpp"
#include "estimator/mesh/ellipsoid.hpp"
#include "estimator/mesh/refinement.hpp"

namespace diastole {
namespace {

std::vector<HermiteMesh> bodies() {
  std::vector<HermiteMesh> meshes;
  meshes.push_back(make_annulus({}));
  EllipsoidShape heart;
  heart.elements = {4, 3, 2};
  meshes.push_back(make_ellipsoid(heart));
  meshes.push_back(make_block({.size_mm = {10, 1, 2}, .elements = {3, 1, 2}, .left_grading = 0.5}));
  return meshes;
}

/// The place in the coarse mesh of a place in a child.
MaterialPoint parent_of(const MaterialPoint& child, size_t direction) {
  MaterialPoint parent{child.element / 2, child.xi};
  parent.xi[direction] = 0.5 * (child.xi[direction] + static_cast<double>(child.element % 2));
  return parent;
}

/// A field that keeps to the mesh's ties.
NodeField any_field(const HermiteMesh& mesh, unsigned seed) {
  std::mt19937 random(seed);
  std::uniform_real_distribution<double> unit(-1.0, 1.0);
  NodeField field(mesh.reference().size());
  for (double& value : field)
    value = unit(random);
  for (const size_t dof : mesh.ties().zero)
    field[dof] = 0.0;
  for (const auto& [dof, host] : mesh.ties().same)
    field[dof] = field[host];
  return field;
}

TEST(Refinement, KeepsGeometryAndFieldsExactly) {
  std::mt19937 random(7);
  std::uniform_real_distribution<double> unit(0.0, 1.0);
  for (const HermiteMesh& coarse : bodies()) {
    for (size_t direction = 0; direction < 3; ++direction) {
      const Refinement finer(coarse, direction);
      ASSERT_EQ(finer.mesh().element_count(), 2 * coarse.element_count());
      const NodeField field = any_field(coarse, 3);
      const NodeField same = finer.prolonged(field);
      for (int trial = 0; trial < 200; ++trial) {
        const MaterialPoint child{random() % finer.mesh().element_count(),
                                  {unit(random), unit(random), unit(random)}};
        const MaterialPoint parent = parent_of(child, direction);
        EXPECT_LT(
            (finer.mesh().value(finer.mesh().reference(), child) - coarse.value(coarse.reference(), parent))
                .norm(),
            1e-12 * coarse.extent_mm());
        EXPECT_LT((finer.mesh().value(same, child) - coarse.value(field, parent)).norm(), 1e-12);
      }
      for (const size_t dof : finer.mesh().ties().zero)
        EXPECT_NEAR(same[dof], 0.0, 1e-14);
      for (const auto& [dof, host] : finer.mesh().ties().same)
        EXPECT_NEAR(same[dof], same[host], 1e-14);
    }
  }
}

double area_mm2(const HermiteMesh& mesh, const std::vector<ElementFace>& faces) {
  constexpr size_t samples = 12;
  double total = 0.0;
  for (const ElementFace& face : faces) {
    for (size_t q = 0; q < samples * samples; ++q) {
      Xi xi{};
      xi[face.direction] = static_cast<double>(face.side);
      const size_t first = (face.direction + 1) % 3;
      const size_t second = (face.direction + 2) % 3;
      xi[first] = (static_cast<double>(q % samples) + 0.5) / samples;
      xi[second] = (static_cast<double>(q / samples) + 0.5) / samples;
      const Eigen::Matrix3d tangents = mesh.xi_gradient(mesh.reference(), {face.element, xi});
      total += tangents.col(static_cast<Eigen::Index>(first))
                   .cross(tangents.col(static_cast<Eigen::Index>(second)))
                   .norm() /
               (samples * samples);
    }
  }
  return total;
}

TEST(Refinement, KeepsTheFacesNames) {
  for (const HermiteMesh& coarse : bodies()) {
    for (size_t direction = 0; direction < 3; ++direction) {
      const Refinement finer(coarse, direction);
      for (const auto list : {&MeshFaces::inner, &MeshFaces::outer, &MeshFaces::bottom, &MeshFaces::top,
                              &MeshFaces::left, &MeshFaces::right}) {
        const double before = area_mm2(coarse, coarse.faces().*list);
        EXPECT_NEAR(area_mm2(finer.mesh(), finer.mesh().faces().*list), before, 1e-2 * before);
      }
    }
  }
}

TEST(Refinement, KeepsTheFibres) {
  EllipsoidShape shape;
  shape.elements = {4, 2, 1};
  const HermiteMesh coarse = make_ellipsoid(shape);
  const FibreField fibres = ellipsoid_fibres(shape, 70.0, -50.0);
  for (size_t direction = 0; direction < 3; ++direction) {
    const Refinement finer(coarse, direction);
    const FibreField same = fibres.prolonged(finer);
    for (const MaterialPoint& child :
         {MaterialPoint{0, {0.3, 0.6, 0.1}}, MaterialPoint{11, {0.9, 0.2, 0.8}}}) {
      EXPECT_LT((same.material_axes(finer.mesh(), child) -
                 fibres.material_axes(coarse, parent_of(child, direction)))
                    .norm(),
                1e-12);
    }
  }
}

TEST(Refinement, CarriesTheCollapsedApexOn) {
  EllipsoidShape shape;
  shape.elements = {4, 2, 1};
  const HermiteMesh coarse = make_ellipsoid(shape);
  // As many ties as the mesh that is made with so many elements from the start.
  const Refinement around(coarse, 0);
  shape.elements = {8, 2, 1};
  EXPECT_EQ(around.mesh().ties().same.size(), make_ellipsoid(shape).ties().same.size());
  EXPECT_EQ(around.mesh().ties().zero.size(), make_ellipsoid(shape).ties().zero.size());
  const Refinement through(coarse, 2);
  shape.elements = {4, 2, 2};
  EXPECT_EQ(through.mesh().ties().same.size(), make_ellipsoid(shape).ties().same.size());
  EXPECT_EQ(through.mesh().ties().zero.size(), make_ellipsoid(shape).ties().zero.size());
  const Refinement up(coarse, 1);
  EXPECT_EQ(up.mesh().ties().same.size(), coarse.ties().same.size());
  EXPECT_EQ(up.mesh().ties().zero.size(), coarse.ties().zero.size());
}

/// Two blocks along x of lengths 1 and 2 that share physical slopes at their common face by scale factors.
HermiteMesh two_blocks(double second_scale_top) {
  const HermiteMesh block = make_block({.size_mm = {2, 1, 1}, .elements = {2, 1, 1}});
  std::vector<HermiteMesh::Corners> elements{block.element(0), block.element(1)};
  std::vector<HermiteMesh::Scales> scales(2);
  for (size_t a = 0; a < hermite_functions; ++a) {
    const bool slope = (hermite_derivative(a) & 1) != 0;
    const bool top = (hermite_corner(a) & 2) != 0;
    scales[0][a] = 1.0;
    scales[1][a] = slope ? (top ? second_scale_top : 2.0) : 1.0;
  }
  NodeField reference = block.reference();
  for (size_t node = 0; node < block.node_count(); ++node) {
    if (reference[dof_of(node, 0, 0)] > 1.5) reference[dof_of(node, 0, 0)] = 3.0;
  }
  return HermiteMesh(std::move(reference), std::move(elements), block.faces(), std::move(scales));
}

TEST(Refinement, KeepsScaleFactorsInProportion) {
  const HermiteMesh coarse = two_blocks(2.0);
  const Refinement finer(coarse, 1);
  const NodeField field = any_field(coarse, 4);
  const NodeField same = finer.prolonged(field);
  for (size_t element = 0; element < 4; ++element) {
    const MaterialPoint child{element, {0.3, 0.6, 0.7}};
    EXPECT_LT((finer.mesh().value(same, child) - coarse.value(field, parent_of(child, 1))).norm(), 1e-12);
    EXPECT_LT((finer.mesh().value(finer.mesh().reference(), child) -
               coarse.value(coarse.reference(), parent_of(child, 1)))
                  .norm(),
              1e-12);
  }
}

TEST(Refinement, RefusesAnEdgeThatIsNotSmooth) {
  EXPECT_THROW(Refinement(two_blocks(3.0), 1), std::invalid_argument);
  EXPECT_NO_THROW(Refinement(two_blocks(3.0), 0));
}

}  // namespace
}  // namespace diastole
