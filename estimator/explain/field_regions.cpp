#include "estimator/explain/field_regions.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <numbers>

#include "estimator/explain/chi_square.hpp"
#include "estimator/explain/linear_evidence.hpp"

namespace diastole::explain {
namespace {

using Eigen::Index;

constexpr size_t turns = 8;
constexpr size_t levels = 4;
constexpr size_t depths = 2;
constexpr size_t cells = turns * levels * depths;
constexpr double significant = 1e-3;

size_t part(double share, size_t count) {
  return static_cast<size_t>(
      std::clamp(share * static_cast<double>(count), 0.0, static_cast<double>(count) - 1.0));
}

size_t cell_of(const FieldModel& body, const Eigen::Vector3d& X_mm) {
  const double turn = std::atan2(X_mm[1], X_mm[0]) / (2.0 * std::numbers::pi);
  const double wall_mm = body.outer_radius_mm - body.inner_radius_mm;
  return part(turn < 0.0 ? turn + 1.0 : turn, turns) +
         turns * (part(X_mm[2] / body.height_mm + 0.5, levels) +
                  levels * part((std::hypot(X_mm[0], X_mm[1]) - body.inner_radius_mm) / wall_mm, depths));
}

std::string words(const FieldModel& body, size_t cell) {
  const double theta_deg = (static_cast<double>(cell % turns) + 0.5) * 360.0 / turns;
  const double z_mm = body.height_mm * ((static_cast<double>(cell / turns % levels) + 0.5) / levels - 0.5);
  return fmt::format("around {:.0f} deg, z {:.0f} mm, {} half of the wall", theta_deg, z_mm,
                     cell / turns / levels == 0 ? "inner" : "outer");
}

}  // namespace

std::vector<Misfit> misfit_regions(const FieldCase& field, const FieldRows& rows, const FieldFit& fit,
                                   size_t most) {
  Eigen::MatrixXd columns = Eigen::MatrixXd::Zero(rows.size(), 3 * cells);
  const double highest_kPa = std::ranges::max(fit.pressures_kPa);
  for (Index i = 0; i < rows.size(); ++i) {
    const FieldRow& row = rows.rows()[static_cast<size_t>(i)];
    const auto first = static_cast<Index>(3 * cell_of(field.base, row.X_mm));
    columns.block<1, 3>(i, first) = fit.pressures_kPa[row.slot] / highest_kPa * row.by_motion.transpose();
  }
  const LinearEvidence evidence(fit, columns);
  std::vector<Misfit> found;
  for (size_t cell = 0; cell < cells; ++cell) {
    const auto first = static_cast<Index>(3 * cell);
    const LinearEvidence::Gain gain = evidence.gain({first, first + 1, first + 2});
    const double p = std::min(1.0, static_cast<double>(cells) *
                                       chi_square_tail(gain.chi_square, static_cast<double>(gain.degrees)));
    if (p > significant) continue;
    Misfit misfit;
    misfit.port = "field";
    misfit.channel = "tags";
    misfit.region = words(field.base, cell);
    misfit.excess_chi2 = gain.chi_square - static_cast<double>(gain.degrees);
    misfit.p_value = p;
    found.push_back(std::move(misfit));
  }
  std::ranges::stable_sort(found, {}, &Misfit::p_value);
  if (found.size() > most) found.resize(most);
  return found;
}

}  // namespace diastole::explain
