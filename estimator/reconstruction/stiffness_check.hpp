#pragma once
// Whether pressures and motion belong to a material that the study thinks possible: the test for pressures in
// another unit. One forward model at the study's start values is loaded until it moves as far as the specimen did;
// the pressure measured, over the one needed, is how much stiffer the specimen seems than the start.

#include <optional>

#include "estimator/io/finding.hpp"
#include "estimator/reconstruction/frame_field.hpp"

namespace diastole {

struct ApparentStiffness {
  double ratio = 1.0;               ///< apparent stiffness / that of the start values
  std::array<double, 2> allowed{};  ///< what the bounds of the parameters in kPa admit for the ratio
};

/// Of the last loaded field. Empty when the model has no equilibrium anywhere near, or nothing moved.
/// Throws InputError for studies that cannot be modelled (estimator/model/study_model.hpp). Some seconds on large meshes.
std::optional<ApparentStiffness> apparent_stiffness(const Study& study, const FieldForms& forms,
                                                    const FrameField& field);

/// id pressure-unit; empty when the stiffness is possible.
std::optional<Finding> pressure_unit_finding(const Study& study, const ApparentStiffness& apparent);

}  // namespace diastole
