#include "estimator/fit/joint_problem.hpp"

#include <fmt/format.h>

namespace diastole {

JointProblem::JointProblem(MotionModel& model, const std::vector<EstimatedParameter>& values,
                           const Measurement& measurement, LocatorOptions locator,
                           std::optional<double> offset_sigma_kPa)
    : model_(model),
      values_(static_cast<Eigen::Index>(values.size())),
      reference_(std::make_unique<PointLocator>(model.mesh(), model.mesh().reference(), locator)),
      imaged_(model.imaged_load()),
      planes_(measurement) {
  std::vector<inference::Parameter> unknowns;
  std::vector<double> start;
  const auto add_unknown = [&](inference::Parameter parameter, double at) {
    start.push_back(parameter.coordinate(at));
    unknowns.push_back(std::move(parameter));
    return static_cast<Eigen::Index>(start.size() - 1);
  };
  for (const EstimatedParameter& value : values)
    add_unknown(value, value.start);
  for (const int frame : loaded_frames(measurement)) {
    const Frame& load = measurement.frames[static_cast<size_t>(frame)];
    std::optional<Eigen::Index> pressure_unknown;
    if (load.sigma_kPa > 0)
      pressure_unknown = add_unknown({fmt::format("pressure_kPa[{}]", frame), "kPa"}, load.pressure_kPa);
    frames_.push_back({frame, load, MotionResiduals(measurement, {frame}, locator), pressure_unknown, {}});
  }
  if (imaged_ && imaged_->sigma_kPa > 0)
    imaged_unknown_ = add_unknown({"imaged_at_kPa", "kPa"}, imaged_->pressure_kPa);
  if (!measurement.frames.empty() && !imaged_) {
    const Frame& rest = measurement.frames.front();
    if (rest.pressure_kPa != 0 && rest.sigma_kPa > 0) rest_reading_ = rest;
  }
  if (offset_sigma_kPa) {
    offset_sigma_kPa_ = *offset_sigma_kPa;
    offset_unknown_ = add_unknown({"pressure_offset_kPa", "kPa"}, 0.0);
  }
  for (Eigen::Index i = 0; i < planes_.unknowns(); ++i)
    add_unknown({TagPlanes::name(i), "mm"}, 0.0);
  space_ = inference::ParameterSpace(std::move(unknowns));
  start_ = Eigen::Map<const Eigen::VectorXd>(start.data(), static_cast<Eigen::Index>(start.size()));
}

void JointProblem::set_work(std::optional<MeasuredWork> work) {
  work_ = work;
  residuals_at_.reset();
}

size_t JointProblem::work_slot() const {
  size_t slot = 0;
  while (frames_.at(slot).number != work_->frame)
    ++slot;
  return slot;
}

void JointProblem::set_smoothness(std::vector<SmoothBlock> blocks) {
  smooth_ = std::move(blocks);
  residuals_at_.reset();
}

void JointProblem::set_robust(std::optional<RobustLoss> loss) {
  robust_ = loss;
  residuals_at_.reset();
}

Eigen::VectorXd JointProblem::motion_residuals() const {
  Eigen::Index rows = 0;
  for (const LoadedFrame& frame : frames_)
    rows += frame.residuals.size();
  Eigen::VectorXd result(rows);
  rows = 0;
  for (const LoadedFrame& frame : frames_) {
    result.segment(rows, frame.residuals.size()) = frame.residuals.residuals();
    rows += frame.residuals.size();
  }
  if (correction_.size() > 0) result += correction_;
  return result;
}

void JointProblem::set_correction(Eigen::VectorXd correction) {
  correction_ = std::move(correction);
  residuals_at_.reset();
}

std::vector<int> JointProblem::patches() const {
  std::vector<int> result;
  if (planes_.unknowns() == 0) return result;
  for (const LoadedFrame& frame : frames_) {
    for (const ResidualRow& row : frame.residuals.rows())
      result.push_back(frame.residuals.of_tag(row) ? planes_.patch(row.source) : -1);
  }
  return result;
}

Eigen::Index JointProblem::smooth_rows() const {
  Eigen::Index rows = 0;
  for (const SmoothBlock& block : smooth_)
    rows += block.differences.rows();
  return rows;
}

Eigen::Index JointProblem::data_rows() const {
  Eigen::Index rows = unknowns() - values() + (fits_rest() ? 1 : 0) + (work_ ? 1 : 0);
  for (const LoadedFrame& frame : frames_)
    rows += frame.residuals.size();
  return rows;
}

double JointProblem::offset_at(const Eigen::VectorXd& q) const {
  return offset_unknown_ ? q[*offset_unknown_] : 0.0;
}

double JointProblem::pressure_at(const LoadedFrame& frame, const Eigen::VectorXd& q) const {
  if (frame.pressure_unknown) return q[*frame.pressure_unknown];
  return frame.load.pressure_kPa - offset_at(q);
}

std::vector<double> JointProblem::pressures_at(const Eigen::VectorXd& q) const {
  std::vector<double> pressures_kPa;
  for (const LoadedFrame& frame : frames_)
    pressures_kPa.push_back(pressure_at(frame, q));
  return pressures_kPa;
}

double JointProblem::imaged_pressure_at(const Eigen::VectorXd& q) const {
  if (imaged_unknown_) return q[*imaged_unknown_];
  return imaged_->pressure_kPa - offset_at(q);
}

bool JointProblem::solve_frames(const Eigen::VectorXd& q) {
  if (solved_at_ && *solved_at_ == q) return true;
  solved_at_.reset();
  std::vector<double> values = space_.values(q);
  values.resize(static_cast<size_t>(values_));
  if (imaged_) model_.set_imaged_pressure(imaged_pressure_at(q));
  std::vector<MotionOutcome> outcomes = model_.solve_all(values, pressures_at(q));
  forward_solves_ += static_cast<int>(outcomes.size());
  for (size_t slot = 0; slot < outcomes.size(); ++slot) {
    LoadedFrame& frame = frames_[slot];
    if (!outcomes[slot].position_mm) {
      failure_ = fmt::format("frame {} has no equilibrium: {}", frame.number, outcomes[slot].reason);
      return false;
    }
    frame.position_mm = *std::move(outcomes[slot].position_mm);
  }
  solved_at_ = q;
  return true;
}

void JointProblem::shift_planes(const Eigen::VectorXd& q) {
  if (planes_.unknowns() == 0) return;
  const Eigen::VectorXd by_mm = planes_.shifts_mm(q.tail(planes_.unknowns()));
  for (LoadedFrame& frame : frames_)
    frame.residuals.shift_planes(by_mm);
}

std::optional<size_t> JointProblem::find_points(const Eigen::VectorXd& q) {
  residuals_at_.reset();
  correction_.resize(0);
  if (!solve_frames(q)) return std::nullopt;
  shift_planes(q);
  size_t gained = 0;
  for (LoadedFrame& frame : frames_)
    gained += frame.residuals.find(model_.mesh(), *reference_, {&frame.position_mm, 1});
  return gained;
}

size_t JointProblem::give_up_lost() {
  size_t count = 0;
  for (LoadedFrame& frame : frames_)
    count += frame.residuals.give_up_lost();
  return count;
}

std::optional<Eigen::VectorXd> JointProblem::residuals(const Eigen::VectorXd& q) {
  if (residuals_at_ && *residuals_at_ == q) return residuals_;
  residuals_at_.reset();
  if (!solve_frames(q)) return {};
  shift_planes(q);
  for (LoadedFrame& frame : frames_) {
    if (!frame.residuals.follow(model_.mesh(), *reference_, {&frame.position_mm, 1})) {
      failure_ = fmt::format("frame {}: many tag points cannot be followed on the body at these values",
                             frame.number);
      return {};
    }
  }
  const Eigen::VectorXd motion = motion_residuals();
  Eigen::Index row = motion.size();
  residuals_.resize(rows());
  for (Eigen::Index i = 0; i < row; ++i)
    residuals_[i] = robust_ ? robust_->residual(motion[i]) : motion[i];
  for (const LoadedFrame& frame : frames_) {
    if (!frame.pressure_unknown) continue;
    residuals_[row++] =
        (q[*frame.pressure_unknown] + offset_at(q) - frame.load.pressure_kPa) / frame.load.sigma_kPa;
  }
  if (imaged_unknown_)
    residuals_[row++] = (q[*imaged_unknown_] + offset_at(q) - imaged_->pressure_kPa) / imaged_->sigma_kPa;
  if (offset_unknown_) residuals_[row++] = q[*offset_unknown_] / offset_sigma_kPa_;
  if (fits_rest())
    residuals_[row++] = (q[*offset_unknown_] - rest_reading_->pressure_kPa) / rest_reading_->sigma_kPa;
  for (const double coefficient_mm : q.tail(planes_.unknowns()))
    residuals_[row++] = coefficient_mm / TagPlanes::loose_mm;
  if (work_)
    residuals_[row++] =
        (stored_energy_mJ() + offset_at(q) * work_->volume_change_mL - work_->work_mJ) / work_->sigma_mJ;
  for (const SmoothBlock& block : smooth_) {
    const Eigen::Index size = block.differences.rows();
    residuals_.segment(row, size) =
        block.differences * q.segment(block.first, block.differences.cols()) / block.step;
    row += size;
  }
  residuals_at_ = q;
  return residuals_;
}

Eigen::MatrixXd JointProblem::jacobian(const Eigen::VectorXd& q) {
  Eigen::MatrixXd result = plain_jacobian(q);
  if (!robust_) return result;
  const Eigen::VectorXd residuals = motion_residuals();
  for (Eigen::Index i = 0; i < residuals.size(); ++i)
    result.row(i) *= robust_->slope(residuals[i]);
  return result;
}

Eigen::MatrixXd JointProblem::plain_jacobian(const Eigen::VectorXd& q) {
  Eigen::MatrixXd result = Eigen::MatrixXd::Zero(rows(), unknowns());
  const Eigen::Index first_plane = unknowns() - planes_.unknowns();
  model_.prepare_derivatives();
  Eigen::Index row = 0;
  for (size_t slot = 0; slot < frames_.size(); ++slot) {
    const LoadedFrame& frame = frames_[slot];
    const MotionDerivatives by = model_.derivatives(slot);
    std::vector<const NodeField*> fields;
    for (const NodeField& field : by.by_value)
      fields.push_back(&field);
    fields.push_back(&by.by_pressure);
    if (imaged_) fields.push_back(&by.by_imaged_pressure);
    const Eigen::MatrixXd block = frame.residuals.columns(0, model_.mesh(), fields);
    const Eigen::VectorXd by_pressure = block.col(values());
    for (Eigen::Index i = 0; i < values(); ++i) {
      result.col(i).segment(row, block.rows()) = block.col(i) * space_[i].slope(q[i]);
    }
    if (frame.pressure_unknown) {
      result.col(*frame.pressure_unknown).segment(row, block.rows()) = by_pressure;
    } else if (offset_unknown_) {
      result.col(*offset_unknown_).segment(row, block.rows()) = -by_pressure;
    }
    if (imaged_unknown_) {
      result.col(*imaged_unknown_).segment(row, block.rows()) = block.rightCols<1>();
    } else if (imaged_ && offset_unknown_) {
      result.col(*offset_unknown_).segment(row, block.rows()) -= block.rightCols<1>();
    }
    for (Eigen::Index i = 0; planes_.unknowns() > 0 && i < block.rows(); ++i) {
      const ResidualRow& tag = frame.residuals.rows()[static_cast<size_t>(i)];
      if (!frame.residuals.of_tag(tag)) continue;
      result.row(row + i).segment<TagPlanes::of_a_set>(first_plane + planes_.first_unknown(tag.source)) =
          frame.residuals.by_plane(tag) * planes_.derivatives(tag.source);
    }
    row += block.rows();
  }
  for (const LoadedFrame& frame : frames_) {
    if (!frame.pressure_unknown) continue;
    if (offset_unknown_) result(row, *offset_unknown_) = 1 / frame.load.sigma_kPa;
    result(row++, *frame.pressure_unknown) = 1 / frame.load.sigma_kPa;
  }
  if (imaged_unknown_) {
    if (offset_unknown_) result(row, *offset_unknown_) = 1 / imaged_->sigma_kPa;
    result(row++, *imaged_unknown_) = 1 / imaged_->sigma_kPa;
  }
  if (offset_unknown_) result(row++, *offset_unknown_) = 1 / offset_sigma_kPa_;
  if (fits_rest()) result(row++, *offset_unknown_) = 1 / rest_reading_->sigma_kPa;
  for (Eigen::Index i = first_plane; i < unknowns(); ++i)
    result(row++, i) = 1 / TagPlanes::loose_mm;
  if (work_) result.row(row++) = work_derivatives(q);
  for (const SmoothBlock& block : smooth_) {
    const Eigen::Index size = block.differences.rows();
    result.block(row, block.first, size, block.differences.cols()) = block.differences / block.step;
    row += size;
  }
  return result;
}

Eigen::RowVectorXd JointProblem::work_derivatives(const Eigen::VectorXd& q) {
  Eigen::RowVectorXd row = Eigen::RowVectorXd::Zero(unknowns());
  const size_t slot = work_slot();
  const EnergyDerivatives stored = model_.energy_derivatives(slot);
  for (Eigen::Index i = 0; i < values(); ++i)
    row[i] = stored.by_value[static_cast<size_t>(i)] * space_[i].slope(q[i]);
  if (offset_unknown_) row[*offset_unknown_] = work_->volume_change_mL;
  if (const auto pressure = frames_[slot].pressure_unknown) {
    row[*pressure] = stored.by_pressure;
  } else if (offset_unknown_) {
    row[*offset_unknown_] -= stored.by_pressure;
  }
  if (imaged_unknown_) {
    row[*imaged_unknown_] = stored.by_imaged_pressure;
  } else if (imaged_ && offset_unknown_) {
    row[*offset_unknown_] -= stored.by_imaged_pressure;
  }
  return row / work_->sigma_mJ;
}

std::vector<JointProblem::ConsideredColumn> JointProblem::considered_columns() {
  std::vector<ConsideredColumn> result;
  Eigen::Index row = 0;
  for (size_t slot = 0; slot < frames_.size(); ++slot) {
    const LoadedFrame& frame = frames_[slot];
    const std::vector<ConsideredMotion> motions = model_.considered(slot);
    for (size_t i = 0; i < motions.size(); ++i) {
      if (slot == 0) result.push_back({motions[i].source, Eigen::VectorXd::Zero(rows())});
      const NodeField* const motion[] = {&motions[i].by_motion};
      const NodeField* const reference[] = {&motions[i].by_reference};
      result[i].column.segment(row, frame.residuals.size()) =
          frame.residuals.columns(0, model_.mesh(), motion, reference).col(0);
      if (work_ && frame.number == work_->frame)
        result[i].column[work_row()] = motions[i].stored_energy_mJ / work_->sigma_mJ;
    }
    row += frame.residuals.size();
  }
  return result;
}

Eigen::VectorXd JointProblem::offset_column() {
  Eigen::VectorXd column = Eigen::VectorXd::Zero(rows());
  Eigen::Index row = 0, prior = motion_residuals().size();
  for (size_t slot = 0; slot < frames_.size(); ++slot) {
    const LoadedFrame& frame = frames_[slot];
    const Eigen::Index size = frame.residuals.size();
    const bool by_imaged = imaged_ && !imaged_unknown_;
    if (frame.pressure_unknown) column[prior++] = 1 / frame.load.sigma_kPa;
    if (!frame.pressure_unknown || by_imaged) {
      const MotionDerivatives by = model_.derivatives(slot);
      std::vector<const NodeField*> fields;
      if (!frame.pressure_unknown) fields.push_back(&by.by_pressure);
      if (by_imaged) fields.push_back(&by.by_imaged_pressure);
      column.segment(row, size) = -frame.residuals.columns(0, model_.mesh(), fields).rowwise().sum();
    }
    row += size;
  }
  if (imaged_unknown_) column[prior] = 1 / imaged_->sigma_kPa;
  if (work_) {
    const EnergyDerivatives stored = model_.energy_derivatives(work_slot());
    double change_mJ = work_->volume_change_mL;
    if (!frames_[work_slot()].pressure_unknown) change_mJ -= stored.by_pressure;
    if (imaged_ && !imaged_unknown_) change_mJ -= stored.by_imaged_pressure;
    column[work_row()] = change_mJ / work_->sigma_mJ;
  }
  return column;
}

}  // namespace diastole
