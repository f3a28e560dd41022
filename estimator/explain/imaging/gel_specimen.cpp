#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <optional>

#include "estimator/explain/imaging/imaged_specimen.hpp"
#include "protocol/contract/input_error.hpp"

namespace diastole::explain {
namespace {

constexpr std::array<size_t, 3> round_mesh{4, 6, 2};  // for what is the same all around the axis
constexpr std::array<size_t, 3> full_mesh{8, 6, 2};

class GelSpecimen final : public ImagedSpecimen {
 public:
  GelSpecimen(FieldCase field, std::string study_file)
      : study_file_(std::move(study_file)), field_(std::move(field)) {}

  void fit_base() override {
    fit_both_meshes();
    if (!loses_points(*round_) && !loses_points(*full_)) return;
    leave_out_lost_points();
    fit_both_meshes();
  }

  void widen_sigmas(double factor) override { field_.widen_sigmas(factor); }

  [[nodiscard]] const FieldCase& field() const override { return field_; }
  [[nodiscard]] const MotionResiduals& rows() const override { return round_->rows(); }
  [[nodiscard]] const HermiteMesh& mesh() const override { return round_->solver().mesh(); }
  [[nodiscard]] const FieldFit& base() const override { return base_; }
  [[nodiscard]] const FieldFit& base_of_structure() const override { return full_base_; }
  [[nodiscard]] FieldModes modes() override {
    FieldSolver& solver = full_->solver();
    return field_modes(full_->rows(), solver.elastic(), solver.state(full_->highest_node()),
                       full_base_.pressures_kPa);
  }

  [[nodiscard]] std::vector<FieldHypothesis> singles() override {
    std::vector<FieldHypothesis> tried = fit_round_effects(*round_, base_);
    lattice_ = inclusion_lattice(*full_, full_base_);
    const double to_beat = std::ranges::max(tried, {}, &FieldHypothesis::score).score;
    std::ranges::move(
        try_inclusion(*round_, base_, search_inclusion(lattice_, wall_volume_mm3(field_.base), full_base_),
                      to_beat),
        std::back_inserter(tried));
    return tried;
  }
  [[nodiscard]] std::vector<FieldHypothesis> pairs(const std::vector<FieldHypothesis>& singles) override {
    return fit_pairs(*round_, base_, singles, lattice_);
  }

  [[nodiscard]] std::vector<ParameterShift> shifts(const FieldFit& after) const override {
    return {{"C1_kPa", base_.C1_kPa(), base_.C1_kPa() * std::sqrt(base_.covariance(0, 0)), after.C1_kPa(),
             after.C1_kPa() * std::sqrt(after.covariance(0, 0))}};
  }
  /// Not known of fits around an inclusion.
  [[nodiscard]] double volume_change_mL(const FieldHypothesis& hypothesis) override {
    return hypothesis.has_inclusion() ? std::nan("") : round_->volume_change_mL(hypothesis.fit);
  }

 private:
  void fit_both_meshes() {
    round_.emplace(field_, round_mesh);
    base_ = round_->fit({}, round_->start());
    full_.emplace(field_, full_mesh);
    full_base_ = full_->fit({}, {base_.C1_kPa(), base_.pressures_kPa});
    if (!std::isfinite(base_.chi_square) || !std::isfinite(full_base_.chi_square))
      throw InputError(
          {study_file_, "law.parameters.C1_kPa",
           fmt::format("the base model has no equilibrium at {:g} kPa", field_.C1_start_kPa.value),
           "Start from a stiffer gel, or check the frames' pressures."});
  }

  [[nodiscard]] static bool loses_points(const FieldProblem& problem) {
    const FoundPoints& found = problem.rows().found();
    return found.tags_left_out + found.points_left_out > 0;
  }

  /// Keeps the points that both meshes can follow, so that their residuals correspond.
  void leave_out_lost_points() {
    Measurement& measurement = field_.measurement;
    std::vector<int> seen(measurement.tags.size() + measurement.points.size(), 0);
    for (const FieldProblem* problem : {&*round_, &*full_})
      for (const ResidualRow& row : problem->rows().rows())
        if (row.component == 0) ++seen[row.source];
    const size_t tags = measurement.tags.size();
    size_t index = 0;
    std::erase_if(measurement.tags, [&](const TagPoint& tag) { return seen[index++] < 2 && tag.frame > 0; });
    index = tags;
    std::erase_if(measurement.points,
                  [&](const ObservedPoint& point) { return seen[index++] < 2 && point.frame > 0; });
  }

  std::string study_file_;
  FieldCase field_;
  mutable std::optional<FieldProblem> round_;
  std::optional<FieldProblem> full_;
  FieldFit base_;
  FieldFit full_base_;
  InclusionLattice lattice_;
};

}  // namespace

std::unique_ptr<ImagedSpecimen> gel_specimen(FieldCase field, std::string study_file) {
  return std::make_unique<GelSpecimen>(std::move(field), std::move(study_file));
}

}  // namespace diastole::explain
