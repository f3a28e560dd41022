#include "estimator/reconstruction/reconstruction_record.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <array>
#include <cmath>
#include <utility>

#include "estimator/fe/gauss_points.hpp"
#include "estimator/mesh/bezier.hpp"
#include "estimator/solution/body_section.hpp"

namespace diastole {
namespace {

std::array<double, 3> array_of(const Eigen::Vector3d& v) { return {v[0], v[1], v[2]}; }

double largest_displacement_mm(const HermiteMesh& mesh, const FrameField& field) {
  double largest = 0.0;
  for (size_t e = 0; e < mesh.element_count(); ++e) {
    for (size_t corner = 0; corner < corners; ++corner) {
      const Xi xi{static_cast<double>(corner & 1), static_cast<double>((corner >> 1) & 1),
                  static_cast<double>(corner >> 2)};
      largest = std::max(largest, mesh.value(field.displacement_mm, {e, xi}).norm());
    }
  }
  return largest;
}

ReconstructedFrame frame_record(const StudyReconstruction& all, size_t i) {
  const FrameField& field = all.fields[i];
  double squares_mm2 = 0.0;
  for (const FieldRow& row : field.rows)
    squares_mm2 += row.rejected ? 0.0 : std::pow(row.residual * row.sigma_mm, 2);
  const double freedom = std::max(1.0, field.residual_freedom);
  const VolumeCheck& volume = all.volumes[i];
  return {.frame = field.number,
          .time_s = field.load.time_s,
          .pressure_kPa = field.load.pressure_kPa,
          .rows = field.rows.size(),
          .wild = field.rows.size() - field.used(),
          .not_found = field.tags_not_found.size() + field.points_not_found.size(),
          .lambda = field.smoothing.lambda,
          .lambda_at_edge = field.smoothing.at_edge,
          .degrees_of_freedom = field.degrees_of_freedom,
          .chi2_per_dof = field.chi2() / freedom,
          .residual_spread = field.scale,
          .rms_mm = std::sqrt(squares_mm2 / static_cast<double>(std::max<size_t>(1, field.used()))),
          .motion = all.amplitudes[i].value,
          .motion_se = all.amplitudes[i].se,
          .largest_displacement_mm = largest_displacement_mm(all.body->mesh, field),
          .mean_se_mm = all.samples[i].mean_se_mm,
          .sigma_factor = all.samples[i].sigma_factor,
          .volume_ratio = volume.mean_ratio,
          .volume_ratio_se = volume.se,
          .volume_error_rms = volume.rms,
          .volume_error_p95 = volume.p95,
          .volume_error_largest = volume.largest,
          .settled = field.converged};
}

void record_families(ReconstructionRecord& record, const StudyReconstruction& all) {
  const size_t count = all.groups.families.size();
  for (size_t f = 0; f < count; ++f) {
    const FamilyFit& together = all.families[f];
    ReconstructedFamily family{array_of(all.groups.families[f].normal),
                               together.rows,
                               together.chi2 / std::max(1.0, together.freedom),
                               {}};
    for (size_t i = 0; i < all.fields.size(); ++i) {
      const FamilyFit& fit = all.families[count * (i + 1) + f];
      family.by_frame.push_back(fit.chi2 / std::max(1.0, fit.freedom));
    }
    record.families.push_back(family);
  }
  for (const SliceOffset& offset : all.slices) {
    const TagSlice& slice = all.groups.slices[offset.slice];
    record.slices.push_back({slice_words(all.groups, slice), slice.tags.size(), offset.offset_mm,
                             offset.se_mm, offset.displaced});
  }
}

void record_coverage(ReconstructionRecord& record, const StudyReconstruction& all) {
  for (size_t e = 0; e < all.coverage.elements.size(); ++e) {
    const ElementCoverage& element = all.coverage.elements[e];
    const ElementVolume& volume = all.volumes.back().elements[e];
    record.elements.push_back({e, element.rows, array_of(element.weakest), element.weakest_rows,
                               element.se_mm, element.unseen, volume.mean_ratio, volume.se});
  }
  record.modes_seen = all.coverage.modes_seen;
  for (const AffineMode& mode : all.coverage.affine_modes)
    record.simple_motions.push_back({mode.words, mode.se_mm});
}

void record_residuals(ReconstructionRecord& record, const StudyReconstruction& all) {
  constexpr int bins = 40;
  constexpr double reach = 6.0, width = 2 * reach / bins;
  for (int i = 0; i <= bins; ++i)
    record.residual_edges.push_back(-reach + i * width);
  record.residual_counts.assign(bins, 0.0);
  for (const FrameField& field : all.fields) {
    for (const FieldRow& row : field.rows) {
      const double held = std::clamp(row.residual, -reach, reach - width / 2);
      record.residual_counts[static_cast<size_t>((held + reach) / width)] += 1;
    }
  }
}

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
  [[nodiscard]] double rms_near(const Eigen::Vector3d& place_mm) const {
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
  std::vector<Eigen::Vector3d> places_;
  std::vector<double> squares_;
};

/// Of the last frame, across the axis and along it.
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
  return drawn_sections(mesh, field.position_mm, fields_at);
}

}  // namespace

ReconstructionRecord reconstruction_record(const Study& study, const Measurement& measurement,
                                           const ReconstructionOptions& options,
                                           const StudyReconstruction& all) {
  ReconstructionRecord record;
  record.study = study.file.string();
  record.data = measurement.points.empty() ? "tags" : measurement.tags.empty() ? "points" : "tags and points";
  record.mesh = mesh_of(study.specimen);
  record.smoothing = {options.smoothing.first, options.smoothing.second, options.smoothing.length_mm};
  record.findings = all.findings;
  record.seconds = all.seconds;
  if (all.fields.empty()) return record;
  record.unknowns = static_cast<size_t>(all.forms->space.unknowns());
  record.points_a_frame = all.samples.front().points.size();
  for (size_t i = 0; i < all.fields.size(); ++i) {
    record.frames.push_back(frame_record(all, i));
    CrossValidationCurve& curve = record.curves.emplace_back();
    curve.frame = all.fields[i].number;
    for (const CrossValidationPoint& point : all.fields[i].smoothing.curve) {
      curve.lambda.push_back(point.lambda);
      curve.score.push_back(point.score);
      curve.degrees_of_freedom.push_back(point.degrees_of_freedom);
    }
  }
  record_families(record, all);
  record_coverage(record, all);
  record_residuals(record, all);
  record.sections = field_sections(all.body->mesh, most_loaded(all.fields), all.coverage);
  return record;
}

BezierGrid reconstruction_grid(const StudyReconstruction& all) {
  const HermiteMesh& mesh = all.body->mesh;
  const std::array<double, 4> places = line_rule_4().place;
  BezierGrid grid;
  grid.cell_data = {{"element", 1, {}}, {"rows", 1, {}}, {"se_mm", 1, {}}, {"unseen", 1, {}}};
  for (size_t e = 0; e < mesh.element_count(); ++e) {
    append_in_vtk_order(bezier_of(mesh.gather(e, mesh.reference())).transpose(), grid.points_mm);
    const ElementCoverage& coverage = all.coverage.elements[e];
    grid.cell_data[0].values.push_back(static_cast<double>(e));
    grid.cell_data[1].values.push_back(static_cast<double>(coverage.rows));
    grid.cell_data[2].values.push_back(coverage.se_mm);
    grid.cell_data[3].values.push_back(coverage.unseen);
  }
  for (const FrameField& field : all.fields) {
    GridArray displacement{"displacement_mm", 3, {}}, volume{"volume_ratio", 1, {}};
    for (size_t e = 0; e < mesh.element_count(); ++e) {
      append_in_vtk_order(bezier_of(mesh.gather(e, field.displacement_mm)).transpose(), displacement.values);
      const auto ratio = [&](const Xi& xi) -> Eigen::VectorXd {
        return Eigen::VectorXd::Constant(1,
                                         mesh.reference_gradient(field.position_mm, {e, xi}).determinant());
      };
      append_in_vtk_order(bezier_through(places, ratio), volume.values);
    }
    grid.steps.push_back({field.load.time_s,
                          {std::move(displacement), std::move(volume)},
                          {{"pressure_kPa", 1, {field.load.pressure_kPa}}}});
  }
  return grid;
}

}  // namespace diastole
