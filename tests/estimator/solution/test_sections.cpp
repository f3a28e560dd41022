// Plane sections and wall profiles of a body, and the record of a solution.

#include <gmock/gmock.h>

#include <cmath>

#include "estimator/io/solution_file.hpp"
#include "estimator/mesh/block.hpp"
#include "estimator/mesh/ellipsoid.hpp"
#include "estimator/solution/body_section.hpp"
#include "estimator/solution/solution_record.hpp"
#include "tests/estimator/fe/gel.hpp"
#include "tests/estimator/io/scratch_file.hpp"

namespace diastole {
namespace {

using Eigen::Vector3d;

double area_mm2(const HermiteMesh& mesh, const SectionPlane& plane, const BodySection& section) {
  double total = 0.0;
  for (const SectionCell& cell : section.cells) {
    double twice = 0.0;
    for (size_t i = 0; i < cell.corners.size(); ++i) {
      const Vector3d a = mesh.value(mesh.reference(), {cell.element, cell.corners[i]});
      const Vector3d b =
          mesh.value(mesh.reference(), {cell.element, cell.corners[(i + 1) % cell.corners.size()]});
      twice +=
          a.dot(plane.horizontal) * b.dot(plane.vertical) - b.dot(plane.horizontal) * a.dot(plane.vertical);
    }
    EXPECT_GE(twice, 0.0);
    total += 0.5 * twice;
  }
  return total;
}

double length_mm(const HermiteMesh& mesh, const std::vector<MaterialLine>& lines) {
  double total = 0.0;
  for (const MaterialLine& line : lines)
    total += (mesh.value(mesh.reference(), line[1]) - mesh.value(mesh.reference(), line[0])).norm();
  return total;
}

TEST(BodySection, OfTheGelHasItsAreaAndOutline) {
  const HermiteMesh mesh = make_annulus({});
  const SectionPlane across{Vector3d::Zero(), Vector3d::UnitX(), Vector3d::UnitY()};
  const BodySection ring = cut_body(mesh, mesh.reference(), across, 2.0);
  const double ring_mm2 = M_PI * (50.0 * 50.0 - 22.5 * 22.5);
  EXPECT_NEAR(area_mm2(mesh, across, ring), ring_mm2, 1e-3 * ring_mm2);
  EXPECT_NEAR(length_mm(mesh, ring.outline), 2.0 * M_PI * 72.5, 0.2);
  EXPECT_NEAR(length_mm(mesh, ring.elements), 2.0 * 8 * 27.5, 0.1) << "eight borders, seen from both sides";

  const SectionPlane along{Vector3d::Zero(), Vector3d::UnitX(), Vector3d::UnitZ()};
  const BodySection walls = cut_body(mesh, mesh.reference(), along, 2.0);
  EXPECT_NEAR(area_mm2(mesh, along, walls), 2.0 * 27.5 * 85.0, 0.1) << "the plane is a face of elements";
  EXPECT_NEAR(length_mm(mesh, walls.outline), 4.0 * (27.5 + 85.0), 0.1);
}

TEST(BodySection, OfAVentricleIsWholeAtTheApex) {
  const EllipsoidShape shape;
  const HermiteMesh mesh = make_ellipsoid(shape);
  const SectionPlane along{Vector3d::Zero(), Vector3d::UnitX(), Vector3d::UnitZ()};
  const BodySection section = cut_body(mesh, mesh.reference(), along, 1.0);
  // Half ellipses of semi-axes (a, c) cut at z: a (z sqrt(c^2 - z^2) / c + c asin(z / c) + c pi / 2).
  const auto below = [](double a, double c, double z) {
    return a * (z * std::sqrt(c * c - z * z) / c + c * std::asin(z / c) + 0.5 * M_PI * c);
  };
  const double exact_mm2 = below(30.0, 60.0, 15.0) - below(21.0, 51.0, 15.0);
  EXPECT_NEAR(area_mm2(mesh, along, section), exact_mm2, 5e-3 * exact_mm2);
  for (const MaterialLine& line : section.outline) {
    const Vector3d place = mesh.value(mesh.reference(), line[0]);
    EXPECT_TRUE(place.head<2>().norm() > 1.0 || place[2] < -50.0) << "no outline inside the apex's wall";
  }
}

TEST(WallProfile, RunsFromFaceToFace) {
  const HermiteMesh gel = make_annulus({});
  const WallProfile wall = cross_wall(gel, {0, 0, 3.0}, {2.0, 1.0, 0}, 21);
  ASSERT_EQ(wall.points.size(), 21U);
  EXPECT_EQ(wall.depth_mm.front(), 0.0);
  EXPECT_NEAR(wall.depth_mm.back(), 27.5, 1e-3);
  EXPECT_NEAR(wall.points.front().xi[2], 0.0, 1e-5);
  EXPECT_NEAR(wall.points.back().xi[2], 1.0, 1e-5);
  EXPECT_TRUE(cross_wall(gel, {0, 0, 0}, Vector3d::UnitZ(), 5).points.empty()) << "along the open cavity";
}

SolutionRecord inflated_gel() {
  ElasticModel model = gel(6.5, {4, 2, 1});
  SolutionRecord record = solution_record(model, model.solve(2.0).state);
  record.study = "gel.study.toml";
  record.parameters = {{"C1_kPa", 6.5}};
  record.mesh = {4, 2, 1};
  return record;
}

TEST(SolutionRecord, HoldsSectionsAndAProfileWithAllFields) {
  const SolutionRecord record = inflated_gel();
  EXPECT_EQ(record.pressure_kPa, 2.0);
  EXPECT_GT(record.cavity_volume_change_mL, 10.0);
  ASSERT_EQ(record.sections.size(), 2U);
  for (const SolutionSection& section : record.sections) {
    EXPECT_GT(section.cells_before.size(), 200U);
    ASSERT_EQ(section.fields.size(), 14U);
    for (const NamedField& field : section.fields)
      EXPECT_EQ(field.values.size(), section.cells_before.size()) << field.name;
  }
  ASSERT_EQ(record.profiles.size(), 1U);
  EXPECT_NEAR(record.profiles[0].depth_mm.back(), 27.5, 1e-2);
}

TEST(SolutionRecord, ComesBackAsItWasWritten) {
  const SolutionRecord record = inflated_gel();
  const std::string text = to_json(record);
  EXPECT_TRUE(is_solution(text));
  const SolutionRecord read = solution_record_from_json(text, "gel.json");
  EXPECT_EQ(to_json(read), text);
  EXPECT_EQ(read.parameters, record.parameters);
  EXPECT_EQ(read.sections[0].title, record.sections[0].title);
}

TEST(SolutionRecord, RefusesWhatIsNoSolution) {
  using test::message_of;
  const auto refusal = [](const std::string& text) {
    return message_of([&] { solution_record_from_json(text, "gel.json"); });
  };
  EXPECT_FALSE(is_solution("{\"format\": \"diastole-fit\"}"));
  EXPECT_THAT(refusal("{"), testing::HasSubstr("gel.json"));
  EXPECT_THAT(refusal("{\"format\": \"diastole-fit\"}"), testing::HasSubstr("diastole-solution"));
  EXPECT_THAT(refusal("{\"format\": \"diastole-solution\", \"format_version\": 9}"),
              testing::HasSubstr("newer than this program"));
  for (const char* number : {"-1", "-1.0", "1.5", "1e300", "null"}) {
    const std::string head = R"({"format": "diastole-solution", "format_version": )";
    EXPECT_THAT(refusal(head + number + "}"), testing::HasSubstr("no whole number")) << number;
  }
  std::string negative = to_json(inflated_gel());
  negative.insert(negative.find("\"unknowns\":") + 11, "-");
  EXPECT_THAT(refusal(negative), testing::HasSubstr("no whole number"));
  std::string short_field = to_json(inflated_gel());
  const size_t start = short_field.find("\"strain_cc\":[") + 13;
  short_field.erase(start, short_field.find(',', start) + 1 - start);
  EXPECT_THAT(refusal(short_field), testing::HasSubstr("strain_cc has another length"));
}

}  // namespace
}  // namespace diastole
