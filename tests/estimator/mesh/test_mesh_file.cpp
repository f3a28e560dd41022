// Mesh files come back to the last bit, and what is wrong in one is told with its place.

#include <gmock/gmock.h>

#include "estimator/mesh/annulus.hpp"
#include "estimator/mesh/block.hpp"
#include "estimator/mesh/ellipsoid.hpp"
#include "estimator/mesh/mesh_file.hpp"
#include "estimator/mesh/refinement.hpp"
#include "tests/estimator/io/scratch_file.hpp"

namespace diastole {
namespace {

using testing::HasSubstr;

MeshBody heart() {
  EllipsoidShape shape;
  shape.elements = {4, 2, 1};
  return {make_ellipsoid(shape), ellipsoid_fibres(shape, 61.7, -58.3)};
}

MeshBody scaled_block() {
  const HermiteMesh block = make_block({.size_mm = {1, 2, 3}, .elements = {2, 1, 1}});
  std::vector<HermiteMesh::Scales> scales(2);
  for (size_t a = 0; a < hermite_functions; ++a) {
    scales[0][a] = 1.0;
    scales[1][a] = (hermite_derivative(a) & 1) != 0 ? 0.7 : 1.0;
  }
  return {HermiteMesh(block.reference(), {block.element(0), block.element(1)}, block.faces(), scales), {}};
}

TEST(MeshFile, ComesBackToTheLastBit) {
  std::vector<MeshBody> bodies{{make_annulus({}), {}}, heart(), scaled_block()};
  bodies.push_back(
      {Refinement(heart().mesh, 0).mesh(), heart().fibres->prolonged(Refinement(heart().mesh, 0))});
  bodies.push_back(
      {make_annulus({}), FibreField(std::vector<double>(80, 30.0), std::vector<double>(80, -12.5))});
  for (const MeshBody& body : bodies) {
    const std::string text = mesh_file_text(body);
    const MeshBody same = mesh_from_text(text, "heart.mesh.toml");
    EXPECT_EQ(same.mesh.reference(), body.mesh.reference());
    EXPECT_EQ(same.fibres.has_value(), body.fibres.has_value());
    if (body.fibres) {
      EXPECT_EQ(same.fibres->nodal_fibre_deg(), body.fibres->nodal_fibre_deg());
      EXPECT_EQ(same.fibres->nodal_sheet_deg(), body.fibres->nodal_sheet_deg());
    }
    for (size_t a = 0; a < hermite_functions; ++a)
      EXPECT_EQ(same.mesh.scale(1, a), body.mesh.scale(1, a));
    EXPECT_EQ(same.mesh.ties().same.size(), body.mesh.ties().same.size());
    EXPECT_EQ(same.mesh.ties().zero.size(), body.mesh.ties().zero.size());
    EXPECT_EQ(same.mesh.faces().inner.size(), body.mesh.faces().inner.size());
    EXPECT_EQ(mesh_file_text(same), text);
  }
}

TEST(MeshFile, TakesARingOfTwoElements) {
  AnnulusShape shape;
  shape.elements = {2, 1, 1};
  const MeshBody ring{make_annulus(shape), {}};
  EXPECT_EQ(mesh_from_text(mesh_file_text(ring), "ring.mesh.toml").mesh.faces().inner.size(), 2U);
}

/// The heart's file with the first `from` replaced.
std::string refusal(const std::string& from, const std::string& to) {
  std::string text = mesh_file_text(heart());
  const size_t place = text.find(from);
  EXPECT_NE(place, std::string::npos) << from;
  text.replace(place, from.size(), to);
  return test::message_of([&] { mesh_from_text(text, "heart.mesh.toml"); });
}

TEST(MeshFile, RefusesWhatIsWrongWithItsPlace) {
  EXPECT_THAT(refusal("x_mm = [", "x_mm = [1.0, "),
              testing::AllOf(HasSubstr("heart.mesh.toml"), HasSubstr("x_mm")));
  EXPECT_THAT(refusal("fibre_deg = 61.7", "fibre_deg = 400.0"), HasSubstr("fibre_deg"));
  EXPECT_THAT(refusal("fibre_deg = 61.7\n", ""), HasSubstr("first node"));
  EXPECT_THAT(refusal("zero = [\"d1\"", "zero = [\"d4\""), HasSubstr("\"d4\" is no nodal derivative"));
  EXPECT_THAT(refusal("shares = [\"value 1\"", "shares = [\"value 99\""), HasSubstr("names no other node"));
  EXPECT_THAT(refusal("shares = [\"value 1\"", "shares = [\"value 5\""), HasSubstr("the other node's is"));
  EXPECT_THAT(refusal("zero = [\"d1\"", "zero = [\"d2\""), HasSubstr("zero"));
  EXPECT_THAT(refusal("nodes = [1, 2,", "nodes = [1, 1,"), HasSubstr("names node 1 twice"));
  EXPECT_THAT(refusal("nodes = [1, 2,", "nodes = [2, 1,"), HasSubstr("inside out"));
  EXPECT_THAT(refusal("nodes = [1, 2,", "nodes = [1, 999,"), HasSubstr("999"));
  EXPECT_THAT(refusal("\"inner xi3=0\"", "\"inside xi3=0\""), HasSubstr("is no face"));
  EXPECT_THAT(refusal("\"inner xi3=0\"", "\"inner xi4=0\""), HasSubstr("is no face"));
  EXPECT_THAT(refusal("\"inner xi3=0\"", "\"inner xi3=0\", \"inner xi3=0\""),
              testing::AllOf(HasSubstr("heart.mesh.toml"), HasSubstr("one side of the element")));
  EXPECT_THAT(refusal("\"outer xi3=1\"", "\"outer xi3=0\""),
              HasSubstr("\"inner xi3=0\" and \"outer xi3=0\" are one side"));
  EXPECT_THAT(refusal("\"inner xi3=0\"", "\"inner xi3=0\", \"left xi1=0\""),
              testing::AllOf(HasSubstr("heart.mesh.toml"), HasSubstr("faces"),
                             HasSubstr("\"left xi1=0\" lies inside the body: element 4 has it too")));
  EXPECT_THAT(refusal("[[element]]",
                      "[[node]]\nx_mm = [0,0,0,0,0,0,0,0]\ny_mm = [0,0,0,0,0,0,0,0]\n"
                      "z_mm = [0,0,0,0,0,0,0,0]\nfibre_deg = 1.0\n[[element]]"),
              HasSubstr("no element"));
  EXPECT_THAT(refusal("fibre_deg = 61.7", "fibre = 61.7"), HasSubstr("fibre"));
  EXPECT_THAT(refusal("diastole-mesh", "diastole-mess"), HasSubstr("diastole-mesh"));
}

}  // namespace
}  // namespace diastole
