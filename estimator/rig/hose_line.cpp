#include "estimator/rig/hose_line.hpp"

#include <cmath>
#include <numbers>
#include <unsupported/Eigen/MatrixFunctions>

#include "estimator/rig/gauss_legendre.hpp"

namespace diastole::rig {
namespace {

using Eigen::Index;
constexpr double pi = std::numbers::pi;

double wave_number(Index n) { return pi * (static_cast<double>(n) - 0.5); }
/// sin w_n, which is what the n-th sine is at the cavity.
double sine_at_end(Index n) { return n % 2 == 1 ? 1.0 : -1.0; }
double cosine_mean(Index n) { return sine_at_end(n) / wave_number(n); }

}  // namespace

HoseLine::HoseLine(const Hose& hose, const LineOptions& options)
    : free_(options.pump_stiffness.has_value()),
      first_(free_ ? 1 : 0),
      count_(first_ + 1 + static_cast<Index>(options.components)),
      modes_(static_cast<Index>(options.components)),
      inertance_(hose.inertance()),
      compliance_(hose.compliance_mL_per_kPa()),
      creep_(hose.creep_fraction),
      creep_time_(hose.creep_time_s),
      to_speed_(1.0 / hose.area_mm2()),
      pump_stiffness_(options.pump_stiffness.value_or(0.0)),
      friction_(hose) {
  make_matrices(hose, options.step_s);
  state_.setZero(2 * count_ + modes_ + 1);
  force_.setZero(count_);
  acceleration_.setZero(count_);
  speed_rate_.setZero(speed_shape_.rows());
  gradient_.setZero(speed_shape_.rows());
  steady_.setZero(speed_shape_.rows());
}

void HoseLine::make_matrices(const Hose& hose, double step_s) {
  mass_.setZero(count_, count_);
  stiffness_.setZero(count_, count_);
  creep_coupling_.setZero(count_, modes_ + 1);
  entering_mass_.setZero(count_);
  const auto couple = [&](Index i, Index j, double value) { mass_(i, j) = mass_(j, i) = inertance_ * value; };
  const auto with_entering = [&](Index i, double value) {
    if (free_) couple(0, i, value);
    entering_mass_[i] = inertance_ * value;
  };
  if (free_) {
    couple(0, 0, 1.0);
    stiffness_(0, 0) = pump_stiffness_;
  }
  with_entering(first_, -0.5);
  couple(first_, first_, 1.0 / 3.0);
  stiffness_(first_, first_) = 1.0 / compliance_;
  creep_coupling_(first_, 0) = -creep_;
  for (Index n = 1; n <= modes_; ++n) {
    const double wave = wave_number(n);
    with_entering(first_ + n, 1.0 / wave);
    couple(first_, first_ + n, -sine_at_end(n) / (wave * wave));
    couple(first_ + n, first_ + n, 0.5);
    stiffness_(first_, first_ + n) = stiffness_(first_ + n, first_) = -sine_at_end(n) / compliance_;
    stiffness_(first_ + n, first_ + n) = wave * wave / (2.0 * compliance_);
    creep_coupling_(first_, n) = -creep_ * cosine_mean(n);
    creep_coupling_(first_ + n, 0) = creep_ * sine_at_end(n);
    creep_coupling_(first_ + n, n) = creep_ * wave / 2.0;
  }
  inverse_mass_ = mass_.inverse();
  cavity_shape_.setZero(count_);
  if (free_) cavity_shape_[0] = -1.0;
  cavity_shape_[first_] = 1.0;
  for (Index n = 1; n <= modes_; ++n)
    cavity_shape_[first_ + n] = -sine_at_end(n);

  const Index creeping = modes_ + 1;
  const Index size = 2 * count_ + creeping;
  Eigen::MatrixXd linear = Eigen::MatrixXd::Zero(size, size);  // z' = linear z + (0, M^-1 f, 0)
  linear.block(0, count_, count_, count_).setIdentity();
  linear.block(count_, 0, count_, count_) = -inverse_mass_ * stiffness_;
  linear.block(count_, 2 * count_, count_, creeping) = -inverse_mass_ * creep_coupling_;
  for (Index n = 0; n < creeping; ++n) {
    const double to_pressure = n == 0 ? 1.0 : -wave_number(n);
    linear(2 * count_ + n, first_ + n) = to_pressure / (compliance_ * creep_time_);
    linear(2 * count_ + n, 2 * count_ + n) = -(1.0 + creep_) / creep_time_;
  }

  pull_ = linear.middleRows(count_, count_);

  // exp of [A B 0; 0 0 1; 0 0 0] h holds exp(A h), h phi_1 B and h phi_2 B side by side.
  Eigen::MatrixXd grown = Eigen::MatrixXd::Zero(size + 2 * count_, size + 2 * count_);
  grown.topLeftCorner(size, size) = linear * step_s;
  grown.block(count_, size, count_, count_) = inverse_mass_ * step_s;
  grown.block(size, size + count_, count_, count_).setIdentity();
  const Eigen::MatrixXd exponential = grown.exp();
  flow_ = exponential.topLeftCorner(size, size);
  from_end_ = exponential.block(0, size + count_, size, count_);
  from_start_ = exponential.block(0, size, size, count_) - from_end_;

  const GaussLegendre rule(static_cast<size_t>(modes_) + 3);
  const Index points = static_cast<Index>(rule.place.size());
  speed_shape_.setZero(points, count_);
  stretch_shape_.setZero(points, count_);
  drag_weight_.setZero(count_, points);
  point_weight_.setZero(points);
  for (Index g = 0; g < points; ++g) {
    const double x = rule.place[static_cast<size_t>(g)];
    const double weight = rule.weight[static_cast<size_t>(g)] * hose.length_m;
    point_weight_[g] = weight;
    if (free_) {
      speed_shape_(g, 0) = 1.0;
      drag_weight_(0, g) = -weight;
    }
    speed_shape_(g, first_) = -x;
    stretch_shape_(g, first_) = -1.0 / hose.length_m;
    drag_weight_(first_, g) = x * weight;
    for (Index n = 1; n <= modes_; ++n) {
      const double wave = wave_number(n);
      speed_shape_(g, first_ + n) = std::sin(wave * x);
      stretch_shape_(g, first_ + n) = wave * std::cos(wave * x) / hose.length_m;
      drag_weight_(first_ + n, g) = -std::sin(wave * x) * weight;
    }
  }
  speed_shape_ *= to_speed_;
  stretch_shape_ *= to_speed_;
}

void HoseLine::rest_at(double pressure_kPa) {
  state_.setZero();
  speed_rate_.setZero();
  entering_flow_ = 0.0;
  state_[first_] = compliance_ * (1.0 + creep_) * pressure_kPa;
  state_[2 * count_] = pressure_kPa;
  pump_kPa_ = pressure_kPa;
}

void HoseLine::add_drag(double entering_acceleration, int passes) {
  const auto velocity = state_.segment(count_, count_);
  speed_.noalias() = speed_shape_ * velocity;
  stretch_.noalias() = stretch_shape_ * velocity;
  if (!free_) speed_.array() += entering_flow_ * to_speed_;
  for (Index g = 0; g < speed_.size(); ++g)
    steady_[g] = friction_.steady_kPa_per_m(speed_[g]);
  pulled_.noalias() = pull_ * state_;
  bare_force_ = force_;
  for (int pass = 0; pass < passes; ++pass) {
    for (Index g = 0; g < speed_.size(); ++g)
      gradient_[g] = steady_[g] + friction_.unsteady_kPa_per_m(speed_[g], speed_rate_[g], stretch_[g]);
    force_.noalias() = bare_force_ + drag_weight_ * gradient_;
    acceleration_.noalias() = pulled_ + inverse_mass_ * force_;
    speed_rate_.noalias() = speed_shape_ * acceleration_;
    if (!free_) speed_rate_.array() += entering_acceleration * to_speed_;
  }
  drag_along_ = point_weight_.dot(gradient_);
}

void HoseLine::forces(const EndLoads& loads, int passes) {
  if (free_) {
    force_.setZero();
    force_[0] = loads.pump_kPa + pump_stiffness_ * state_[0];
  } else {
    force_ = -entering_mass_ * loads.entering_acceleration;
  }
  force_ += cavity_shape_ * loads.cavity_kPa;
  add_drag(loads.entering_acceleration, passes);
  settled_acceleration_ = loads.entering_acceleration;
  pump_kPa_ = free_ ? loads.pump_kPa
                    : loads.cavity_kPa + drag_along_ + inertance_ * loads.entering_acceleration +
                          entering_mass_.dot(acceleration_);
}

void HoseLine::settle(const EndLoads& loads) { forces(loads, 1); }

void HoseLine::begin_step(const EndLoads& now, double entering_flow_at_end) {
  if (!free_) force_ += entering_mass_ * (settled_acceleration_ - now.entering_acceleration);
  drifted_.noalias() = flow_ * state_;
  drifted_.noalias() += from_start_ * force_;
  state_.noalias() = drifted_ + from_end_ * force_;
  entering_flow_ = entering_flow_at_end;
}

void HoseLine::end_step(const EndLoads& then) {
  forces(then, 2);
  state_.noalias() = drifted_ + from_end_ * force_;
}

double HoseLine::energy_mJ() const {
  const auto velocity = state_.segment(count_, count_);
  const Eigen::VectorXd creep = state_.tail(modes_ + 1);
  double kinetic = 0.5 * velocity.dot(mass_ * velocity);
  if (!free_) {
    kinetic +=
        entering_flow_ * entering_mass_.dot(velocity) + 0.5 * inertance_ * entering_flow_ * entering_flow_;
  }
  const Eigen::VectorXd pressure = pressures();
  return kinetic +
         0.5 * compliance_ * (mean_product(pressure, pressure) + creep_ * mean_product(creep, creep));
}

Eigen::VectorXd HoseLine::pressures() const {
  Eigen::VectorXd pressure = -creep_ * state_.tail(modes_ + 1);
  pressure[0] += state_[first_] / compliance_;
  for (Index n = 1; n <= modes_; ++n)
    pressure[n] -= wave_number(n) * state_[first_ + n] / compliance_;
  return pressure;
}

double HoseLine::mean_product(const Eigen::VectorXd& a, const Eigen::VectorXd& b) const {
  double sum = a[0] * b[0];
  for (Index n = 1; n <= modes_; ++n)
    sum += cosine_mean(n) * (a[0] * b[n] + a[n] * b[0]) + 0.5 * a[n] * b[n];
  return sum;
}

double HoseLine::loss_mW() const {
  const Eigen::VectorXd lag = pressures() - state_.tail(modes_ + 1);
  double drag = 0.0;
  for (Index g = 0; g < speed_.size(); ++g)
    drag += point_weight_[g] * gradient_[g] * speed_[g] / to_speed_;
  return drag + compliance_ * creep_ / creep_time_ * mean_product(lag, lag);
}

}  // namespace diastole::rig
