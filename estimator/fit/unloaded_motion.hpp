#pragma once
// The motion of a body whose shape was imaged under load: positions and tags are counted from that shape, and for each set of
// values the shape without load is found anew (unloaded_shape.hpp), so that the body is in equilibrium in its image.
//
// With X(values, P0) the undeformed shape and x(values, P; X) the equilibrium, derivatives are total ones,
//
//   dx/dv = dx/dv|X + dx/dX dX/dv        dx/dP0 = dx/dX dX/dP0        K dx = - (dr/dv + dr/dX dX/dv)
//
// exactly, K being the tangent at the frame. What is stored counts from the image, frame 0.

#include "estimator/fe/unloaded_shape.hpp"
#include "estimator/fit/elastic_motion.hpp"

namespace diastole {

class UnloadedMotion : public ElasticMotion {
 public:
  /// The mesh of `imaged` is the body as it was imaged, at `load`.
  UnloadedMotion(ElasticModel imaged, std::vector<ParameterGroup> groups, ImagedLoad load);

  [[nodiscard]] const HermiteMesh& mesh() const override { return imaged_.mesh(); }
  [[nodiscard]] std::optional<ImagedLoad> imaged_load() const override { return load_; }
  /// Another measurement of that load.
  void set_imaged_load(ImagedLoad measured) { load_ = measured; }
  void set_imaged_pressure(double pressure_kPa) override { pressure_kPa_ = pressure_kPa; }

  /// The unloaded body of these values, inflated from rest to the pressure of the image.
  struct Again {
    double cavity_imaged_mL;  ///< NaN where the cavity is open
    double cavity_unloaded_mL;
    UnloadReturn back;
  };
  /// None where there is no such body.
  [[nodiscard]] std::optional<Again> inflated_again(std::span<const double> values,
                                                    double imaged_pressure_kPa);

 protected:
  std::optional<std::string> set_values(std::span<const double> values) override;
  MotionDerivatives derivatives_at(const ElasticState& state) override;
  [[nodiscard]] bool frames_are_independent() const override { return false; }
  [[nodiscard]] double stored_at(const ElasticState& state) const override;
  /// By differences along the shape's own derivatives.
  EnergyDerivatives energy_derivatives_at(const ElasticState& state, std::span<const double> values,
                                          const MotionDerivatives& by) override;
  [[nodiscard]] ElasticState first_state() const override { return shape_->imaged; }

 private:
  ElasticModel imaged_;
  ImagedLoad load_;
  double pressure_kPa_;
  InverseDesign inverse_;
  std::vector<double> values_;  // of shape_
  std::optional<UnloadedShape> shape_;
  std::optional<InverseDesign::Derivatives> shape_derivatives_;
};

}  // namespace diastole
