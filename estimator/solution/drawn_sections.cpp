#include "estimator/solution/drawn_sections.hpp"

namespace diastole {
namespace {

constexpr double cells_across = 40;  // the body, in a section

FlatPoints flat(const HermiteMesh& mesh, const NodeField& position_mm, const SectionPlane& plane,
                const std::vector<MaterialPoint>& points) {
  FlatPoints result;
  for (const MaterialPoint& point : points) {
    const Eigen::Vector3d place_mm = mesh.value(position_mm, point);
    result.push_back(plane.horizontal.dot(place_mm));
    result.push_back(plane.vertical.dot(place_mm));
  }
  return result;
}

std::vector<MaterialPoint> ends_of(const std::vector<MaterialLine>& lines) {
  std::vector<MaterialPoint> points;
  for (const MaterialLine& line : lines)
    points.insert(points.end(), line.begin(), line.end());
  return points;
}

}  // namespace

std::vector<SolutionSection> drawn_sections(
    const HermiteMesh& mesh, const NodeField& position_mm, const Eigen::Vector3d& centre_mm,
    const std::string& height_words,
    const std::function<std::vector<NamedField>(const std::vector<MaterialPoint>&)>& fields_at) {
  using Eigen::Vector3d;
  const auto drawn = [&](std::string title, const Vector3d& up, const char* vertical) {
    const SectionPlane plane{centre_mm, Vector3d::UnitX(), up};
    const BodySection cut = cut_body(mesh, plane, mesh.extent_mm() / cells_across);
    const auto before = [&](const auto& points) { return flat(mesh, mesh.reference(), plane, points); };
    const auto after = [&](const auto& points) { return flat(mesh, position_mm, plane, points); };
    SolutionSection section;
    section.title = std::move(title);
    section.horizontal = "x (mm)";
    section.vertical = vertical;
    std::vector<MaterialPoint> centres;
    for (const SectionCell& cell : cut.cells) {
      std::vector<MaterialPoint> around;
      for (const Xi& corner : cell.corners)
        around.push_back({cell.element, corner});
      section.cells_before.push_back(before(around));
      section.cells_after.push_back(after(around));
      centres.push_back(cell.centre());
    }
    section.outline_before = before(ends_of(cut.outline));
    section.outline_after = after(ends_of(cut.outline));
    section.elements_before = before(ends_of(cut.elements));
    section.elements_after = after(ends_of(cut.elements));
    section.fields = fields_at(centres);
    return section;
  };
  return {drawn("Short axis, material of " + height_words, Vector3d::UnitY(), "y (mm)"),
          drawn("Long axis, material of y = 0", Vector3d::UnitZ(), "z (mm)")};
}

}  // namespace diastole
