#pragma once
// The fit of any specimen's base model, and of any choice of effects beside it, to imaged motion: the problem of estimator/fit with the
// effects' values as further unknowns of the motion (changed_motion.hpp). All fits share the points that lie on the base model's body, the
// loss that the base's residuals ask for, and the correction by a finer mesh (finer_mesh.hpp).
//
// A shape and fibres that were measured are known to a tolerance: what one standard deviation of their errors does at the base
// (considered_errors.hpp) is a column of every fit, with an unknown N(0, 1). An effect is what is beyond them.

#include <memory>
#include <optional>
#include <vector>

#include "estimator/explain/imaging/field_fit.hpp"
#include "estimator/explain/verdict/explanation.hpp"
#include "estimator/fit/changed_motion.hpp"
#include "estimator/fit/estimated_parameters.hpp"
#include "estimator/model/changed_specimen.hpp"

namespace diastole::explain {

class SpecimenProblem {
 public:
  /// `report` is called often, with a text where there is something to say; what it throws ends a fit. Throws InputError as `fit` does
  /// for the study, and if no frame is inflated.
  SpecimenProblem(const Study& study, std::function<void(const std::string&)> report);

  /// The base model; all else wants it first. It begins stiffer where the start values carry no load, and reports that. Throws InputError
  /// where nothing within the bounds does.
  void fit_base();
  /// A choice, from the law's values and pressures of another fit. chi2 is infinite where it has no solution.
  [[nodiscard]] FieldFit fit(const FieldChoice& choice, const FieldFit& from);
  /// The fit with the correction that a finer mesh makes of its own body; as it is where there is none.
  [[nodiscard]] FieldFit settled(const FieldFit& fit);

  [[nodiscard]] const FieldFit& base() const { return base_; }
  [[nodiscard]] const MotionResiduals& rows() const { return *rows_; }
  [[nodiscard]] const ChangeableSpecimen& specimen() const { return specimen_; }
  [[nodiscard]] const HermiteMesh& mesh() const { return specimen_.mesh(); }
  [[nodiscard]] const FieldCase& field() const { return field_; }
  [[nodiscard]] FieldCase& field() { return field_; }
  /// Of chi2: what the mesh may gain by itself, corrected as it is.
  [[nodiscard]] double mesh_error() const { return mesh_error_; }

  /// The frame of the highest pressure, and the base's equilibrium there.
  [[nodiscard]] size_t highest_slot() const;
  [[nodiscard]] ChangedMotion::Equilibrium highest() { return base_motion_->equilibrium(highest_slot()); }
  /// Derivatives of the rows at the base by changes.
  [[nodiscard]] Eigen::MatrixXd columns_of(const std::vector<ChangedMotion::Perturbation>& changes);
  /// Half the distance for differences by an effect's parameter.
  [[nodiscard]] static double step_of(const EffectParameter& parameter) {
    return 1e-3 * std::abs(parameter.typical);
  }

  [[nodiscard]] std::vector<ParameterShift> shifts(const FieldFit& after) const;
  /// What the cavity takes at the highest pressure; NaN for an open one.
  [[nodiscard]] double volume_change_mL(const FieldFit& fit) const;

 private:
  [[noreturn]] void refuse_base(const std::string& reason) const;
  [[nodiscard]] double law_error(const FieldFit& fit, size_t value) const;
  [[nodiscard]] BodyChanges changes_of(const FieldChoice& choice, const ChangeableSpecimen& specimen) const;
  [[nodiscard]] ChangedMotion motion_of(const FieldChoice& choice) const;
  /// The unknowns of a choice's problem at which its points are found, the effects at their neutral values.
  [[nodiscard]] Eigen::VectorXd where_points_are(const JointProblem& problem,
                                                 const FieldChoice& choice) const;
  /// Numbers of a fit at the search's end.
  void take(const inference::SearchResult& found, JointProblem& problem, FieldFit& fit) const;
  /// What a finer mesh changes at a fit; nothing where it has no equilibrium.
  [[nodiscard]] std::optional<Eigen::VectorXd> correction_at(const FieldFit& fit);
  void correct_mesh();
  void find_tolerances();

  std::function<void(const std::string&)> report_;
  Study study_;
  ChangeableSpecimen specimen_;
  EstimatedParameters estimated_;
  FieldCase field_;
  std::optional<RobustLoss> loss_;
  FieldFit base_;
  FieldFit points_at_;  ///< law and pressures at which `rows_` were found
  std::optional<MotionResiduals> rows_;
  std::unique_ptr<ChangedMotion> base_motion_;
  std::optional<ChangeableSpecimen> finer_;
  Eigen::VectorXd correction_;  // of the rows, by the finer mesh; empty: not known
  double mesh_error_ = 0.0;
  Eigen::MatrixXd tolerances_;  // over the rows, a column each; empty: shape and fibres are as the study says
};

}  // namespace diastole::explain
