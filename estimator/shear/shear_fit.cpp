#include "estimator/shear/shear_fit.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <limits>
#include <map>
#include <numbers>
#include <set>

#include "estimator/inference/intervals.hpp"
#include "protocol/contract/angle.hpp"

namespace diastole {
namespace {

using inference::student_quantile;

constexpr double kPa_per_MPa = 1000;          // 1 MPa = 1 N/mm2
constexpr double doubt = 0.05;                // of the interval, and of an outlier among all rows
constexpr double strong_doubt = 0.001;        // of remarks that question the test itself
constexpr double rounding = 1e-9;             // relative scatter below which only arithmetic is seen
constexpr size_t rows_that_show_scatter = 5;  // of one load
constexpr double softest_kPa = 0.02, stiffest_kPa = 200;  // gels, tissues and soft rubbers lie between
constexpr double sharpest_deg = 0.002;  // of what a camera sees of a marker: 0.6 um at a radius of 17 mm

/// Rows as pairs of the line y = x / C1, C1 in N/mm2.
struct Pairs {
  std::vector<double> x, y;
};

double shape_per_mm3(const ShearRow& row) {
  const double a = row.annulus.inner_radius_mm;
  return (1 / (a * a) - 1 / (row.radius_mm * row.radius_mm)) / (8 * std::numbers::pi * row.annulus.height_mm);
}

Pairs pairs_of(const std::vector<ShearRow>& rows, ShearForm form) {
  Pairs pairs;
  for (const ShearRow& row : rows) {
    const double scale = form == ShearForm::rotation ? row.moment_Nmm : 1;
    pairs.x.push_back(scale * shape_per_mm3(row));
    pairs.y.push_back(scale * row.rotation_rad / row.moment_Nmm);
  }
  return pairs;
}

bool only_rounding(const OriginLine& line) {
  return line.sum_of_residuals2 <= rounding * rounding * line.sum_yy;
}

void set_estimate(ShearFit& fit, const OriginLine& line, const Pairs& pairs) {
  const double half = student_quantile(line.dof, doubt) * line.se;
  fit.C1_kPa = kPa_per_MPa / line.slope;
  fit.se_kPa = std::abs(fit.C1_kPa) * line.se / std::abs(line.slope);
  fit.determined = line.slope - half > 0;
  fit.ci95_kPa = {kPa_per_MPa / (line.slope + half), fit.determined
                                                         ? kPa_per_MPa / (line.slope - half)
                                                         : std::numeric_limits<double>::infinity()};
  if (line.slope + half <= 0) fit.ci95_kPa[0] = std::numeric_limits<double>::quiet_NaN();
  fit.dof = line.dof;
  fit.r2 = 1 - line.sum_of_residuals2 / line.sum_yy;
  double mean = 0, about_mean = 0;
  for (const double y : pairs.y)
    mean += y / static_cast<double>(pairs.y.size());
  for (const double y : pairs.y)
    about_mean += (y - mean) * (y - mean);
  fit.r2_about_mean = 1 - line.sum_of_residuals2 / about_mean;
}

void set_points(ShearFit& fit, const std::vector<ShearRow>& rows, double slope) {
  double squares = 0;
  for (const ShearRow& row : rows) {
    const double a = row.annulus.inner_radius_mm;
    const double residual_deg =
        (row.rotation_rad - row.moment_Nmm * slope * shape_per_mm3(row)) / rad_per_deg;
    fit.points.push_back({row.rotation_rad / row.moment_Nmm * 1e3, shape_per_mm3(row) * 1e6, residual_deg});
    squares += residual_deg * residual_deg;
    const double shear =
        std::abs(row.moment_Nmm * slope) / (4 * std::numbers::pi * row.annulus.height_mm * a * a);
    fit.largest_shear = std::max(fit.largest_shear, shear);
  }
  fit.rms_deg = std::sqrt(squares / static_cast<double>(rows.size()));
}

std::map<double, std::vector<size_t>> by_moment(const std::vector<ShearRow>& rows) {
  std::map<double, std::vector<size_t>> groups;
  for (size_t i = 0; i < rows.size(); ++i)
    groups[rows[i].moment_Nmm].push_back(i);
  return groups;
}

bool sees_stiffness(const Pairs& pairs) {
  return std::ranges::any_of(pairs.x, [](double x) { return x != 0; });
}

Pairs chosen(const Pairs& pairs, const std::vector<size_t>& rows) {
  Pairs some;
  for (const size_t row : rows) {
    some.x.push_back(pairs.x[row]);
    some.y.push_back(pairs.y[row]);
  }
  return some;
}

void add_load(ShearFit& fit, double moment_Nmm, const std::vector<size_t>& rows, const Pairs& pairs) {
  const Pairs own = chosen(pairs, rows);
  ShearLoad load = {moment_Nmm, rows.size(), std::numeric_limits<double>::quiet_NaN(),
                    std::numeric_limits<double>::quiet_NaN(), 0};
  for (const size_t row : rows)
    load.rms_deg += fit.points[row].residual_deg * fit.points[row].residual_deg;
  load.rms_deg = std::sqrt(load.rms_deg / static_cast<double>(rows.size()));
  if (sees_stiffness(own)) {
    const OriginLine line = line_through_origin(own.x, own.y);
    load.C1_kPa = kPa_per_MPa / line.slope;
    load.se_kPa = std::abs(load.C1_kPa) * line.se / std::abs(line.slope);
  }
  fit.loads.push_back(load);
}

/// Adds the rows of `group` whose residual, over the scatter of the others, chance would show in one of twenty
/// such files only.
void add_outliers(ShearFit& fit, const ShearTest& test, const Pairs& pairs,
                  const std::vector<size_t>& group) {
  const Pairs own = chosen(pairs, group);
  if (!sees_stiffness(own)) return;
  const OriginLine line = line_through_origin(own.x, own.y);
  if (line.dof < 2 || only_rounding(line)) return;
  const double limit = student_quantile(line.dof - 1, doubt / static_cast<double>(test.rows.size()));
  for (size_t i = 0; i < group.size(); ++i) {
    const double residual = own.y[i] - line.slope * own.x[i];
    const double freedom = 1 - own.x[i] * own.x[i] / line.sum_xx;
    const double others = std::max(0.0, line.sum_of_residuals2 * freedom - residual * residual);
    const double deviations = residual * std::sqrt((line.dof - 1) / others);
    if (std::abs(deviations) > limit) {
      fit.outliers.push_back({test.rows[group[i]].line, fit.points[group[i]].residual_deg,
                              std::copysign(deviations, fit.points[group[i]].residual_deg)});
    }
  }
}

/// Adds a remark on a load whose rows disagree with those of the other loads.
void compare_loads(ShearFit& fit, const ShearTest& test, const Pairs& pairs) {
  const auto groups = by_moment(test.rows);
  for (const auto& [moment_Nmm, rows] : groups) {
    std::vector<size_t> others;
    for (size_t i = 0; i < test.rows.size(); ++i) {
      if (test.rows[i].moment_Nmm != moment_Nmm) others.push_back(i);
    }
    const Pairs own = chosen(pairs, rows), rest = chosen(pairs, others);
    if (!sees_stiffness(own) || !sees_stiffness(rest)) continue;
    const OriginLine line = line_through_origin(own.x, own.y);
    const OriginLine rest_line = line_through_origin(rest.x, rest.y);
    const double deviations = (line.slope - rest_line.slope) / std::hypot(line.se, rest_line.se);
    const double limit = student_quantile(line.dof, strong_doubt / static_cast<double>(groups.size()));
    if (!(std::abs(deviations) > limit)) continue;
    fit.remarks.push_back(fmt::format(
        "The rows at {:.5g} N mm give {:.3f} kPa, the others {:.3f} kPa, {:.1f} standard errors of their "
        "difference away: check that load, or the gel is not neo-Hookean.",
        moment_Nmm, kPa_per_MPa / line.slope, kPa_per_MPa / rest_line.slope, std::abs(deviations)));
  }
}

/// Each load's scatter is its own where its rows suffice to show it: in the normalised form a small load's is the
/// larger one.
void judge_loads(ShearFit& fit, const ShearTest& test, const Pairs& pairs) {
  const auto groups = by_moment(test.rows);
  const bool each_by_itself = std::ranges::all_of(
      groups, [](const auto& group) { return group.second.size() >= rows_that_show_scatter; });
  std::vector<size_t> all;
  for (const auto& [moment_Nmm, rows] : groups) {
    add_load(fit, moment_Nmm, rows, pairs);
    if (each_by_itself) add_outliers(fit, test, pairs, rows);
    all.insert(all.end(), rows.begin(), rows.end());
  }
  if (!each_by_itself) add_outliers(fit, test, pairs, all);
  const bool scattered = !only_rounding(line_through_origin(pairs.x, pairs.y));
  if (each_by_itself && groups.size() > 1 && scattered) compare_loads(fit, test, pairs);
}

void remark_on_the_line(ShearFit& fit, const ShearTest& test, const OriginLine& line) {
  if (fit.C1_kPa < 0) {
    fit.remarks.push_back(
        "The markers turn against the load: give load and rotation positive in the same direction.");
  } else if (!fit.determined) {
    fit.remarks.push_back(
        "The rotations are lost in their scatter: C1 has no upper limit. Use larger loads.");
  }
  if (test.rows.size() >= 2 * rows_that_show_scatter && !only_rounding(line)) {
    const Pairs pairs = pairs_of(test.rows, ShearForm::normalised);
    const double deviations = intercept_deviations(pairs.x, pairs.y);
    const double limit = student_quantile(static_cast<double>(test.rows.size()) - 2, strong_doubt);
    if (std::abs(deviations) > limit) {
      fit.remarks.push_back(fmt::format(
          "The line misses the origin by {:.1f} standard errors: the gel at the inner cylinder seems to "
          "turn. Check its bond, the inner radius, and that the unloaded image was unloaded.",
          std::abs(deviations)));
    }
  }
  const auto other = std::ranges::find_if(
      test.rows, [&](const ShearRow& row) { return row.annulus != test.rows.front().annulus; });
  if (other != test.rows.end()) {
    fit.remarks.push_back(
        fmt::format("Line {} has another annulus than line {}; each row counts with its own.", other->line,
                    test.rows.front().line));
  }
}

/// What no gel and no camera is like: a wrong unit.
void remark_on_units(ShearFit& fit, const OriginLine& line) {
  if (fit.determined && (fit.C1_kPa < softest_kPa || fit.C1_kPa > stiffest_kPa)) {
    fit.remarks.push_back(
        fmt::format("C1 = {:.3g} kPa is no soft gel's ({:g} to {:g} kPa): check that rotations are in "
                    "degrees, moments in N mm and lengths in mm.",
                    fit.C1_kPa, softest_kPa, stiffest_kPa));
  } else if (fit.rms_deg < sharpest_deg && !only_rounding(line)) {
    fit.remarks.push_back(
        fmt::format("The rotations agree within {:.2g} degrees, better than markers can be tracked: check "
                    "that they are in degrees and were measured.",
                    fit.rms_deg));
  }
}

void remark_on_repeats(ShearFit& fit, const ShearTest& test) {
  std::set<std::array<double, 3>> seen;
  const auto repeats = std::ranges::count_if(test.rows, [&](const ShearRow& row) {
    return !seen.insert({row.moment_Nmm, row.radius_mm, row.rotation_rad}).second;
  });
  if (repeats == 0) return;
  fit.remarks.push_back(
      fmt::format("{} of {} rows repeat another to the last digit and count as measurements of their own, so "
                  "that the standard error is too small: remove them.",
                  repeats, test.rows.size()));
}

void remark_on_outliers(ShearFit& fit) {
  for (const ShearOutlier& outlier : fit.outliers) {
    fit.remarks.push_back(
        fmt::format("Line {} of the file lies {:+.2f} degrees off the fit, {:.1f} standard errors by the "
                    "other rows' scatter: look at that marker. It is counted like every other.",
                    outlier.line, outlier.residual_deg, std::abs(outlier.deviations)));
  }
}

}  // namespace

ShearFit fit_shear(const ShearTest& test, ShearForm form) {
  const Pairs pairs = pairs_of(test.rows, form);
  const OriginLine line = line_through_origin(pairs.x, pairs.y);
  const Pairs normalised = pairs_of(test.rows, ShearForm::normalised);
  ShearFit fit;
  fit.swapped_C1_kPa = kPa_per_MPa * line_through_origin(normalised.y, normalised.x).slope;
  set_estimate(fit, line, pairs);
  set_points(fit, test.rows, line.slope);
  remark_on_the_line(fit, test, line);
  remark_on_units(fit, line);
  remark_on_repeats(fit, test);
  judge_loads(fit, test, pairs);
  remark_on_outliers(fit);
  return fit;
}

OriginLine line_through_origin(std::span<const double> x, std::span<const double> y) {
  OriginLine line = {};
  double sum_xy = 0;
  for (size_t i = 0; i < x.size(); ++i) {
    line.sum_xx += x[i] * x[i];
    line.sum_yy += y[i] * y[i];
    sum_xy += x[i] * y[i];
  }
  line.slope = sum_xy / line.sum_xx;
  for (size_t i = 0; i < x.size(); ++i)
    line.sum_of_residuals2 += std::pow(y[i] - line.slope * x[i], 2);
  line.dof = static_cast<double>(x.size()) - 1;
  line.se = line.dof > 0 ? std::sqrt(line.sum_of_residuals2 / line.dof / line.sum_xx)
                         : std::numeric_limits<double>::quiet_NaN();
  return line;
}

double intercept_deviations(std::span<const double> x, std::span<const double> y) {
  const double n = static_cast<double>(x.size());
  double mean_x = 0, mean_y = 0, sum_xx = 0, sum_xy = 0, residuals2 = 0;
  for (size_t i = 0; i < x.size(); ++i) {
    mean_x += x[i] / n;
    mean_y += y[i] / n;
  }
  for (size_t i = 0; i < x.size(); ++i) {
    sum_xx += (x[i] - mean_x) * (x[i] - mean_x);
    sum_xy += (x[i] - mean_x) * (y[i] - mean_y);
  }
  if (n < 3 || sum_xx <= 0) return std::numeric_limits<double>::quiet_NaN();
  const double slope = sum_xy / sum_xx;
  const double intercept = mean_y - slope * mean_x;
  for (size_t i = 0; i < x.size(); ++i)
    residuals2 += std::pow(y[i] - intercept - slope * x[i], 2);
  return intercept / std::sqrt(residuals2 / (n - 2) * (1 / n + mean_x * mean_x / sum_xx));
}

}  // namespace diastole
