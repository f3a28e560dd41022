// exnode and exelem files: written here from a known mesh as cmgui writes them, read back as that mesh.

#include <fmt/format.h>
#include <gmock/gmock.h>

#include <iterator>

#include "estimator/mesh/annulus.hpp"
#include "estimator/mesh/exfile_import.hpp"
#include "tests/estimator/io/scratch_file.hpp"

namespace diastole {
namespace {

using testing::HasSubstr;

HermiteMesh ring() {
  AnnulusShape shape;
  shape.elements = {4, 2, 1};
  return make_annulus(shape);
}

/// Arc-length scale factor of a nodal derivative: the product of the tangents' lengths.
double arc_scale(const HermiteMesh& mesh, size_t node, size_t derivative) {
  double scale = 1.0;
  for (size_t k = 0; k < 3; ++k) {
    if (((derivative >> k) & 1) == 0) continue;
    scale *= Eigen::Map<const Eigen::Vector3d>(&mesh.reference()[dof_of(node, size_t{1} << k, 0)]).norm();
  }
  return scale;
}

struct ExText {
  std::string nodes, elements;
};

/// Derivatives per arc length with scale factors. `versions` of each node, of which the element that starts at it
/// takes the last.
ExText ex_files(const HermiteMesh& mesh, size_t versions) {
  constexpr const char* names = "(d/ds1,d/ds2,d2/ds1ds2,d/ds3,d2/ds1ds3,d2/ds2ds3,d3/ds1ds2ds3)";
  ExText text;
  auto nodes = std::back_inserter(text.nodes);
  fmt::format_to(
      nodes,
      " Group name: ring\n #Fields=2\n 1) coordinates, coordinate, rectangular cartesian, #Components=3\n");
  for (size_t i = 0; i < 3; ++i)
    fmt::format_to(nodes, "   {}.  Value index= {}, #Derivatives= 7 {}, #Versions= {}\n", "xyz"[i],
                   1 + 8 * versions * i, names, versions);
  fmt::format_to(
      nodes,
      " 2) fibres, anatomical, fibre, #Components=1\n   fibre angle.  Value index= {}, #Derivatives= 0\n",
      1 + 24 * versions);
  for (size_t node = 0; node < mesh.node_count(); ++node) {
    fmt::format_to(nodes, " Node:  {}\n", node + 101);
    for (size_t i = 0; i < 3; ++i) {
      for (size_t version = 0; version < versions; ++version) {
        for (size_t d = 0; d < nodal_derivatives; ++d) {
          const double scale = arc_scale(mesh, node, d);
          fmt::format_to(nodes, "  {:.17e}", scale > 0 ? mesh.reference()[dof_of(node, d, i)] / scale : 0.0);
        }
        fmt::format_to(nodes, "\n");
      }
    }
    fmt::format_to(nodes, "  0.5\n");
  }
  auto elements = std::back_inserter(text.elements);
  fmt::format_to(
      elements,
      " Group name: ring\n Shape.  Dimension=1\n Element: 0 0 1\n Shape.  Dimension=3\n"
      " #Scale factor sets= 1\n   c.Hermite*c.Hermite*c.Hermite, #Scale factors=64\n #Nodes= 8\n #Fields=1\n"
      " 1) coordinates, coordinate, rectangular cartesian, #Components=3\n");
  for (size_t i = 0; i < 3; ++i) {
    fmt::format_to(elements,
                   "   {}.  c.Hermite*c.Hermite*c.Hermite, no modify, standard node based.\n     #Nodes= 8\n",
                   "xyz"[i]);
    for (size_t c = 0; c < corners; ++c) {
      const size_t first = c == 0 ? 8 * (versions - 1) : 0;
      fmt::format_to(elements, "      {}.  #Values=8\n       Value indices: ", c + 1);
      for (size_t d = 0; d < nodal_derivatives; ++d)
        fmt::format_to(elements, " {}", first + d + 1);
      fmt::format_to(elements, "\n       Scale factor indices: ");
      for (size_t d = 0; d < nodal_derivatives; ++d)
        fmt::format_to(elements, " {}", 8 * c + d + 1);
      fmt::format_to(elements, "\n");
    }
  }
  for (size_t e = 0; e < mesh.element_count(); ++e) {
    fmt::format_to(elements, " Element: {} 0 0\n   Faces:\n   0 {} 0\n   Nodes:\n  ", e + 1, 6 * e);
    for (const size_t node : mesh.element(e))
      fmt::format_to(elements, " {}", node + 101);
    fmt::format_to(elements, "\n   Scale factors:\n");
    for (size_t c = 0; c < corners; ++c) {
      for (size_t d = 0; d < nodal_derivatives; ++d)
        fmt::format_to(elements, "  {:.17e}", arc_scale(mesh, mesh.element(e)[c], d));
      fmt::format_to(elements, "\n");
    }
  }
  return text;
}

ImportedMesh imported(const ExText& text, double mm_per_unit = 1.0) {
  return import_exfiles({text.nodes, "ring.exnode"}, {text.elements, "ring.exelem"}, mm_per_unit);
}

TEST(ExfileImport, BringsTheMeshWithItsScaleFactors) {
  const HermiteMesh mesh = ring();
  const ImportedMesh found = imported(ex_files(mesh, 1), 10.0);
  ASSERT_EQ(found.body.mesh.element_count(), mesh.element_count());
  EXPECT_EQ(found.body.mesh.node_count(), mesh.node_count());
  for (size_t e = 0; e < mesh.element_count(); ++e) {
    for (const Xi& xi : {Xi{0.2, 0.7, 0.4}, Xi{1.0, 0.0, 0.5}}) {
      EXPECT_LT((found.body.mesh.value(found.body.mesh.reference(), {e, xi}) -
                 10.0 * mesh.value(mesh.reference(), {e, xi}))
                    .norm(),
                1e-10);
      EXPECT_EQ(found.body.mesh.scale(e, 5), 1.0) << "a factor that all agree on goes into the node";
    }
  }
  ASSERT_TRUE(found.body.fibres);
  EXPECT_NEAR(found.body.fibres->nodal_fibre_deg()[3], 0.5 * 180.0 / M_PI, 1e-12);
  EXPECT_EQ(found.body.mesh.faces().inner.size(), 8U);
  EXPECT_EQ(found.body.mesh.faces().outer.size(), 8U);
  EXPECT_EQ(found.body.mesh.faces().bottom.size(), 4U);
  EXPECT_EQ(found.body.mesh.faces().top.size(), 4U);
  EXPECT_TRUE(found.body.mesh.faces().left.empty());
  EXPECT_THAT(found.remarks, testing::Contains(HasSubstr("8 elements, 24 nodes")));
}

TEST(ExfileImport, MakesVersionsNodesOfTheirOwnAtOnePlace) {
  const HermiteMesh mesh = ring();
  const ImportedMesh found = imported(ex_files(mesh, 2));
  EXPECT_GT(found.body.mesh.node_count(), mesh.node_count());
  EXPECT_EQ(found.body.mesh.faces().inner.size(), 8U) << "versions are at one place";
  for (size_t e = 0; e < mesh.element_count(); ++e) {
    const MaterialPoint point{e, {0.2, 0.7, 0.4}};
    EXPECT_LT(
        (found.body.mesh.value(found.body.mesh.reference(), point) - mesh.value(mesh.reference(), point))
            .norm(),
        1e-10);
  }
  const MeshBody same = mesh_from_text(mesh_file_text(found.body), "ring.mesh.toml");
  EXPECT_EQ(same.mesh.reference(), found.body.mesh.reference());
}

TEST(ExfileImport, KeepsScaleFactorsThatNeighboursDoNotShare) {
  ExText text = ex_files(ring(), 1);
  const size_t start = text.elements.find("Scale factors:\n") + 15;
  const std::string block = text.elements.substr(start, text.elements.find('\n', start) - start);
  const size_t second = block.find_first_not_of(' ', block.find(' ', 3));
  text.elements.at(start + second) = '9';
  const ImportedMesh found = imported(text);
  EXPECT_THAT(found.remarks, testing::Contains(HasSubstr("are kept")));
  EXPECT_NE(found.body.mesh.scale(0, hermite_function(0, 1)), 1.0);
}

std::string refusal(bool in_elements, const std::string& from, const std::string& to) {
  ExText text = ex_files(ring(), 1);
  std::string& changed = in_elements ? text.elements : text.nodes;
  const size_t place = changed.find(from);
  EXPECT_NE(place, std::string::npos) << from;
  changed.replace(place, from.size(), to);
  return test::message_of([&] { imported(text); });
}

TEST(ExfileImport, RefusesWithLineAndReason) {
  EXPECT_THAT(refusal(true, " 101 102", " 101 101"),
              testing::AllOf(HasSubstr("ring.exelem: line"), HasSubstr("collapsed")));
  EXPECT_THAT(refusal(true, " 101 102", " 102 101"), HasSubstr("inside out"));
  EXPECT_THAT(refusal(true, " 101 102", " 101 999"), HasSubstr("node 999"));
  EXPECT_THAT(refusal(true, "x.  c.Hermite*c.Hermite*c.Hermite", "x.  l.Lagrange*l.Lagrange*l.Lagrange"),
              HasSubstr("tri-cubic"));
  EXPECT_THAT(refusal(true, "     #Nodes= 8", "     #Nodes= 6"), HasSubstr("collapsed"));
  EXPECT_THAT(refusal(true, "Value indices:  1 2 3", "Value indices:  1 3 2"),
              HasSubstr("takes a node's d/ds2 for d/ds1"));
  EXPECT_THAT(refusal(true, "#Scale factors=64", "#Scale factors=65"), HasSubstr("scale factors"));
  EXPECT_THAT(refusal(false, "rectangular cartesian", "prolate spheroidal, focus=35"),
              HasSubstr("Cartesian"));
  EXPECT_THAT(refusal(false, "d2/ds1ds3,", "d2/ds1ds4,"), HasSubstr("d2/ds1ds4"));
  EXPECT_THAT(refusal(false, "  0.5\n", "  half\n"),
              testing::AllOf(HasSubstr("ring.exnode: line"), HasSubstr("half")));
  EXPECT_THAT(refusal(false, " Group name: ring", "EX Version: 2"), HasSubstr("version 2"));
}

TEST(ExfileImport, RefusesIndicesThatAreNone) {
  const auto in_nodes = [](const std::string& what) {
    return testing::AllOf(HasSubstr("ring.exnode: line"), HasSubstr(what));
  };
  EXPECT_THAT(refusal(false, "Value index= 1,", "Value index= 0,"),
              in_nodes("has 0 behind \"Value index=\""));
  EXPECT_THAT(refusal(false, "Value index= 1,", "Value index= 18446744073709551615,"),
              in_nodes("Value index="));
  EXPECT_THAT(refusal(false, "#Versions= 1", "#Versions= 0"), in_nodes("has 0 behind \"#Versions=\""));
  EXPECT_THAT(refusal(false, "#Versions= 1", "#Versions= 2305843009213693952"), in_nodes("#Versions="));
  EXPECT_THAT(refusal(false, "  0.5\n", "  nan\n"), in_nodes("nan"));
  EXPECT_THAT(refusal(false, "  0.5\n", "  inf\n"), in_nodes("inf"));

  const auto in_elements = [](const std::string& what) {
    return testing::AllOf(HasSubstr("ring.exelem: line"), HasSubstr(what));
  };
  for (const char* index : {"nan", "inf", "1e30", "-1", "1.5", "99999999999"}) {
    SCOPED_TRACE(index);
    EXPECT_THAT(refusal(true, "Value indices:  1", std::string("Value indices:  ") + index),
                in_elements("is not eight Value indices:"));
    EXPECT_THAT(refusal(true, "Scale factor indices:  1", std::string("Scale factor indices:  ") + index),
                in_elements("is not eight Scale factor indices:"));
    EXPECT_THAT(refusal(true, " 101 102", std::string(" 101 ") + index), in_elements("nodes of the element"));
  }
  EXPECT_THAT(refusal(true, "Value indices:  1", "Value indices:  0"), in_elements("takes number 0"));
  EXPECT_THAT(refusal(true, "      1.  #Values=8", "      nan.  #Values=8"), in_elements("is no corner"));
  EXPECT_THAT(refusal(true, "      1.  #Values=8", "      1e30.  #Values=8"), in_elements("is no corner"));
  EXPECT_THAT(refusal(true, "      1.  #Values=8", "      0.  #Values=8"), in_elements("is no corner"));
  EXPECT_THAT(refusal(true, "      1.  #Values=8", "      2.  #Values=8"), in_elements("different nodes"));
}

TEST(ExfileImport, RefusesScaleFactorsThatAreNotAboveZero) {
  for (const char* factor : {"0.0", "-1.0", "nan", "inf"}) {
    SCOPED_TRACE(factor);
    EXPECT_THAT(refusal(true, "Scale factors:\n  1.00000000000000000e+00",
                        std::string("Scale factors:\n  ") + factor),
                testing::AllOf(HasSubstr("ring.exelem: line"), HasSubstr("scale factor")));
  }
}

}  // namespace
}  // namespace diastole
