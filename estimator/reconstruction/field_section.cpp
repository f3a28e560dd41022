#include "estimator/reconstruction/field_section.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <array>
#include <cmath>
#include <utility>

#include "estimator/solution/drawn_sections.hpp"

namespace diastole {
namespace {

using Eigen::Vector3d;

constexpr size_t neighbours = 40;  // whose residuals make a place's

/// Measured numbers with their undeformed places, for looking up what lies near.
class ResidualMap {
 public:
  ResidualMap(const HermiteMesh& mesh, const FrameField& field) {
    for (const FieldRow& row : field.rows) {
      places_.push_back(mesh.value(mesh.reference(), row.point));
      squares_.push_back(std::min(row.residual * row.residual, 100.0));
    }
  }

  /// Root mean square of the nearest rows' residuals / sigma; a wild one counts as ten.
  [[nodiscard]] double rms_near(const Vector3d& place_mm) const {
    std::vector<std::pair<double, double>> near;
    near.reserve(places_.size());
    for (size_t i = 0; i < places_.size(); ++i)
      near.emplace_back((places_[i] - place_mm).squaredNorm(), squares_[i]);
    const size_t count = std::min(neighbours, near.size());
    if (count == 0) return 0.0;
    std::nth_element(near.begin(), near.begin() + static_cast<std::ptrdiff_t>(count - 1), near.end());
    double sum = 0.0;
    for (size_t i = 0; i < count; ++i)
      sum += near[i].second;
    return std::sqrt(sum / static_cast<double>(count));
  }

 private:
  std::vector<Vector3d> places_;
  std::vector<double> squares_;
};

double middle_height_mm(const HermiteMesh& mesh) {
  double low = mesh.reference()[dof_of(0, 0, 2)], high = low;
  for (size_t node = 0; node < mesh.node_count(); ++node) {
    low = std::min(low, mesh.reference()[dof_of(node, 0, 2)]);
    high = std::max(high, mesh.reference()[dof_of(node, 0, 2)]);
  }
  return 0.5 * (low + high);
}

}  // namespace

std::vector<SolutionSection> field_sections(const HermiteMesh& mesh, const FrameField& field,
                                            const Coverage& coverage) {
  const ResidualMap residuals(mesh, field);
  const auto fields_at = [&](const std::vector<MaterialPoint>& centres) {
    std::vector<NamedField> fields{
        {"displacement_mm", {}}, {"se_mm", {}}, {"unseen", {}}, {"residual_rms", {}}, {"volume_ratio", {}}};
    for (const MaterialPoint& centre : centres) {
      const ElementCoverage& element = coverage.elements[centre.element];
      const std::array<double, 5> values{mesh.value(field.displacement_mm, centre).norm(),
                                         between_probes(element.probe_se_mm, centre.xi),
                                         between_probes(element.probe_unseen, centre.xi),
                                         residuals.rms_near(mesh.value(mesh.reference(), centre)),
                                         mesh.reference_gradient(field.position_mm, centre).determinant()};
      for (size_t i = 0; i < values.size(); ++i)
        fields[i].values.push_back(values[i]);
    }
    return fields;
  };
  const double height_mm = middle_height_mm(mesh);
  return drawn_sections(mesh, field.position_mm, {0.0, 0.0, height_mm},
                        fmt::format("z = {:.4g} mm", height_mm), fields_at);
}

}  // namespace diastole
