#include "estimator/rig/hose_line.hpp"

#include <cmath>
#include <numbers>
#include <unsupported/Eigen/MatrixFunctions>

namespace diastole::rig {
namespace {

using Eigen::Index;
using std::numbers::pi;

/// Gauss-Legendre quadrature on [0, 1]: exact for polynomials up to degree 2 n - 1.
struct GaussLegendre {
  std::vector<double> place;
  std::vector<double> weight;  ///< their sum is one

  explicit GaussLegendre(size_t points) {
    const double n = static_cast<double>(points);
    for (size_t k = 0; k < points; ++k) {
      double x = std::cos(pi * (static_cast<double>(k) + 0.75) / (n + 0.5));
      double slope = 0.0;
      for (int newton = 0; newton < 8; ++newton) {
        double value = 1.0;
        double before = 0.0;
        for (size_t j = 1; j <= points; ++j) {
          const double degree = static_cast<double>(j);
          const double next = ((2.0 * degree - 1.0) * x * value - (degree - 1.0) * before) / degree;
          before = value;
          value = next;
        }
        slope = n * (x * value - before) / (x * x - 1.0);
        x -= value / slope;
      }
      place.push_back(0.5 * (1.0 + x));
      weight.push_back(1.0 / ((1.0 - x * x) * slope * slope));
    }
  }
};

double wave_number(Index n) { return pi * (static_cast<double>(n) - 0.5); }
/// sin w_n, which is what the n-th sine is at the cavity.
double sine_at_end(Index n) { return n % 2 == 1 ? 1.0 : -1.0; }
double cosine_mean(Index n) { return sine_at_end(n) / wave_number(n); }

}  // namespace

HoseLine::HoseLine(const Hose& hose, const LineOptions& options)
    : yields_(options.pump_stiffness || options.pump_resistance),
      first_(yields_ ? 1 : 0),
      count_(first_ + 1 + static_cast<Index>(options.components)),
      modes_(static_cast<Index>(options.components)),
      inertance_(hose.inertance()),
      compliance_(hose.compliance_mL_per_kPa()),
      creep_(hose.creep_fraction),
      creep_time_(hose.creep_time_s),
      wall_loss_(hose.wall_loss_s),
      to_speed_(1.0 / hose.area_mm2()),
      pump_stiffness_(options.pump_stiffness.value_or(0.0)),
      pump_resistance_(options.pump_resistance.value_or(0.0)),
      friction_(hose),
      layer_(hose, options.step_s) {
  make_equations();
  make_step(options.step_s);
  make_drag(hose.length_m);
  state_.setZero(SmallMatrix::padded(2 * count_ + modes_ + 1));
  drifted_ = state_;
  bare_.setZero(SmallMatrix::padded(count_));
  force_ = bare_;
}

void HoseLine::make_equations() {
  mass_.setZero(count_, count_);
  stiffness_.setZero(count_, count_);
  damping_.setZero(count_, count_);
  creep_coupling_.setZero(count_, modes_ + 1);
  piston_mass_.setZero(count_);
  cavity_shape_.setZero(count_);
  const auto couple = [&](Index i, Index j, double value) { mass_(i, j) = mass_(j, i) = inertance_ * value; };
  const auto with_entering = [&](Index i, double value) {
    if (yields_) couple(0, i, value);
    piston_mass_[i] = inertance_ * value;
  };
  if (yields_) {
    with_entering(0, 1.0);
    stiffness_(0, 0) = pump_stiffness_;
    damping_(0, 0) = pump_resistance_;
    cavity_shape_[0] = -1.0;
  }
  with_entering(first_, -0.5);
  couple(first_, first_, 1.0 / 3.0);
  stiffness_(first_, first_) = 1.0 / compliance_;
  creep_coupling_(first_, 0) = -creep_;
  cavity_shape_[first_] = 1.0;
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
    cavity_shape_[first_ + n] = -sine_at_end(n);
  }
  damping_.bottomRightCorner(modes_ + 1, modes_ + 1) +=
      wall_loss_ * stiffness_.bottomRightCorner(modes_ + 1, modes_ + 1);
  inverse_mass_ = mass_.inverse();
}

void HoseLine::make_step(double step_s) {
  const Index creeping = modes_ + 1;
  const Index size = 2 * count_ + creeping;
  Eigen::MatrixXd linear = Eigen::MatrixXd::Zero(size, size);  // z' = linear z + (0, M^-1 f, 0)
  linear.block(0, count_, count_, count_).setIdentity();
  linear.block(count_, 0, count_, count_) = -inverse_mass_ * stiffness_;
  linear.block(count_, count_, count_, count_) = -inverse_mass_ * damping_;
  linear.block(count_, 2 * count_, count_, creeping) = -inverse_mass_ * creep_coupling_;
  for (Index n = 0; n < creeping; ++n) {
    const double to_pressure = n == 0 ? 1.0 : -wave_number(n);
    linear(2 * count_ + n, first_ + n) = to_pressure / (compliance_ * creep_time_);
    linear(2 * count_ + n, 2 * count_ + n) = -(1.0 + creep_) / creep_time_;
  }
  pull_ = linear.middleRows(count_, count_);
  pump_by_state_ = pull_.transpose() * piston_mass_;
  pump_by_force_ = inverse_mass_.transpose() * piston_mass_;

  // exp of [A B 0; 0 0 1; 0 0 0] h holds exp(A h), h phi_1 B and h phi_2 B side by side.
  Eigen::MatrixXd grown = Eigen::MatrixXd::Zero(size + 2 * count_, size + 2 * count_);
  grown.topLeftCorner(size, size) = linear * step_s;
  grown.block(count_, size, count_, count_) = inverse_mass_ * step_s;
  grown.block(size, size + count_, count_, count_).setIdentity();
  const Eigen::MatrixXd exponential = grown.exp();
  const Eigen::MatrixXd from_end = exponential.block(0, size + count_, size, count_);
  flow_ = SmallMatrix(exponential.topLeftCorner(size, size));
  from_end_ = SmallMatrix(from_end);
  from_start_ = SmallMatrix(exponential.block(0, size, size, count_) - from_end);
  by_pump_load_.setZero(SmallMatrix::padded(size));
  if (yields_) by_pump_load_.head(size) = from_end.col(0);
}

void HoseLine::make_drag(double length_m) {
  const GaussLegendre rule(static_cast<size_t>(modes_) + 3);
  const Index points = static_cast<Index>(rule.place.size());
  const Index rows = SmallMatrix::padded(points);
  Eigen::MatrixXd speed = Eigen::MatrixXd::Zero(points, count_);
  Eigen::MatrixXd both = Eigen::MatrixXd::Zero(2 * rows, count_);
  Eigen::MatrixXd weight = Eigen::MatrixXd::Zero(count_, points);
  point_part_.setZero(points);
  point_weight_.setZero(points);
  for (Index g = 0; g < points; ++g) {
    const double x = rule.place[static_cast<size_t>(g)];
    point_part_[g] = rule.weight[static_cast<size_t>(g)];
    point_weight_[g] = point_part_[g] * length_m;
    if (yields_) speed(g, 0) = to_speed_;
    speed(g, first_) = -x * to_speed_;
    both(rows + g, first_) = -to_speed_ / length_m;
    for (Index n = 1; n <= modes_; ++n) {
      const double wave = wave_number(n);
      speed(g, first_ + n) = std::sin(wave * x) * to_speed_;
      both(rows + g, first_ + n) = wave * std::cos(wave * x) / length_m * to_speed_;
    }
    weight.col(g) = -point_weight_[g] / to_speed_ * speed.row(g).transpose();
  }
  both.topRows(points) = speed;
  speeds_ = SmallMatrix(both);
  rate_by_state_ = SmallMatrix(speed * pull_);
  rate_by_force_ = SmallMatrix(speed * inverse_mass_);
  rate_by_drag_ = SmallMatrix(speed * inverse_mass_ * weight);
  force_by_drag_ = SmallMatrix(weight);
  speed_.setZero(2 * rows);
  bare_rate_.setZero(rows);
  rate_.setZero(rows);
  gradient_.setZero(rows);
  drag_.resize(static_cast<size_t>(points));
}

void HoseLine::remember(bool is_settled) {
  double speed = 0.0, forgetting = 0.0;
  for (Index g = 0; g < point_weight_.size(); ++g) {
    speed += point_part_[g] * speed_[g];
    forgetting += point_part_[g] * drag_.forgetting[static_cast<size_t>(g)];
  }
  if (is_settled) layer_.pass(speed, forgetting);
  const double gradient = is_settled ? layer_.drag() : layer_.drag_after(speed, forgetting);
  for (double& still : drag_.still_kPa_per_m)
    still += gradient;
  for (double& by_rate : drag_.by_rate)
    by_rate += layer_.inertia();
}

void HoseLine::forces(const EndLoads& loads, int passes, bool is_settled) {
  for (Index i = 0; i < count_; ++i)
    bare_[i] = cavity_shape_[i] * loads.cavity_kPa - piston_mass_[i] * loads.piston_acceleration;
  if (yields_) bare_[0] += loads.pump_kPa;
  speeds_.times_from(state_, count_, speed_);
  const Index points = point_weight_.size();
  for (Index g = 0; g < points; ++g)
    speed_[g] += piston_flow_ * to_speed_;
  friction_.set_drag(speed_.data(), speed_.data() + speed_.size() / 2, drag_);
  if (layer_.exists()) remember(is_settled);
  rate_by_state_.times(state_, bare_rate_);
  rate_by_force_.add_times(bare_rate_, bare_, bare_rate_);
  const double carried = loads.piston_acceleration * to_speed_;
  for (int pass = 0; pass < passes; ++pass) {
    for (Index g = 0; g < points; ++g) {
      const auto place = static_cast<size_t>(g);
      gradient_[g] = drag_.still_kPa_per_m[place] + drag_.by_rate[place] * rate_[g];
    }
    if (pass == 0) bare_rate_.array() += carried;
    rate_by_drag_.add_times(bare_rate_, gradient_, rate_);
  }
  force_by_drag_.add_times(bare_, gradient_, force_);
  settled_acceleration_ = loads.piston_acceleration;
}

void HoseLine::settle(const EndLoads& loads) {
  forces(loads, 1, true);
  if (yields_) {
    pump_kPa_ = loads.pump_kPa - pump_stiffness_ * state_[0] - pump_resistance_ * state_[count_];
    return;
  }
  pump_kPa_ = loads.cavity_kPa + inertance_ * loads.piston_acceleration;
  for (Index g = 0; g < point_weight_.size(); ++g)
    pump_kPa_ += point_weight_[g] * gradient_[g];
  for (Index i = 0; i < pump_by_state_.size(); ++i)
    pump_kPa_ += pump_by_state_[i] * state_[i];
  for (Index i = 0; i < count_; ++i)
    pump_kPa_ += pump_by_force_[i] * force_[i];
}

void HoseLine::begin_step(const EndLoads& now, double piston_flow_at_end) {
  const double other = settled_acceleration_ - now.piston_acceleration;
  for (Index i = 0; i < count_; ++i)
    force_[i] += piston_mass_[i] * other;
  flow_.times(state_, drifted_);
  from_start_.add_times(drifted_, force_, drifted_);
  from_end_.add_times(drifted_, force_, state_);
  piston_flow_ = piston_flow_at_end;
}

void HoseLine::end_step(const EndLoads& then) {
  forces(then, 2, false);
  from_end_.add_times(drifted_, force_, state_);
}

double HoseLine::energy_mJ() const {
  const auto velocity = state_.segment(count_, count_);
  const Eigen::VectorXd creep = state_.segment(2 * count_, modes_ + 1);
  const double kinetic = 0.5 * velocity.dot(mass_ * velocity) + piston_flow_ * piston_mass_.dot(velocity) +
                         0.5 * inertance_ * piston_flow_ * piston_flow_;
  const Eigen::VectorXd pressure = pressures();
  return kinetic +
         0.5 * compliance_ * (mean_product(pressure, pressure) + creep_ * mean_product(creep, creep));
}

Eigen::VectorXd HoseLine::pressures() const {
  Eigen::VectorXd pressure = -creep_ * state_.segment(2 * count_, modes_ + 1);
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
  const Eigen::VectorXd lag = pressures() - state_.segment(2 * count_, modes_ + 1);
  double drag = 0.0;
  for (Index g = 0; g < point_weight_.size(); ++g)
    drag += point_weight_[g] * gradient_[g] * speed_[g] / to_speed_;
  const auto stretching = state_.segment(count_ + first_, modes_ + 1);
  const auto elastic = stiffness_.bottomRightCorner(modes_ + 1, modes_ + 1);
  return drag + compliance_ * creep_ / creep_time_ * mean_product(lag, lag) +
         wall_loss_ * stretching.dot(elastic * stretching);
}

}  // namespace diastole::rig
