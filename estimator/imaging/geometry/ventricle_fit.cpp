#include "estimator/imaging/geometry/ventricle_fit.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <array>
#include <cmath>
#include <limits>
#include <map>
#include <numbers>
#include <optional>
#include <string_view>
#include <utility>

#include "estimator/imaging/geometry/base_points.hpp"
#include "estimator/imaging/geometry/phased_fit.hpp"
#include "estimator/imaging/geometry/ventricle_findings.hpp"
#include "estimator/imaging/geometry/ventricle_frame.hpp"
#include "estimator/imaging/geometry/wall_harmonics.hpp"
#include "estimator/imaging/geometry/wild_points.hpp"
#include "protocol/contract/input_error.hpp"

namespace diastole::imaging {
namespace {

using Eigen::Index;
using Eigen::MatrixXd;
using Eigen::Vector3d;
using Eigen::VectorXd;

/// Eight waves around and from pole to pole: shorter ones than the elements of a usual mesh can show.
constexpr int wall_degree = 8;
constexpr Index wall_count = harmonic_count(wall_degree);

/// Unknowns of a phase, and of its departure from what all phases have in common: middle and thickness of the wall, the base plane.
constexpr Index base_place = 2 * wall_count;
constexpr Index state_count = base_place + 3;
constexpr double huber_sigmas = 3;
constexpr double wild_sigmas = 5;
/// Below this share of the normal in the image's plane a click slides along the wall, and the wall's curvature makes an error of
/// its own: it never counts for more than one on a wall so inclined.
constexpr double least_normal_in_plane = 0.3;

/// Variance of harmonics by degree: amplitude times (l (l + 1) / 2)^-power; degree zero by itself.
struct Spectrum {
  double zero = std::numeric_limits<double>::infinity();
  double amplitude = 0;
  double power = 3;

  [[nodiscard]] double variance(int degree) const {
    return degree == 0 ? zero : amplitude * std::pow(0.5 * degree * (degree + 1), -power);
  }
};

VectorXd variances(const Spectrum& spectrum, Index count) {
  VectorXd v(count);
  for (Index k = 0; k < count; ++k)
    v[k] = spectrum.variance(harmonic_degree(k));
  return v;
}

/// The likeliest spectrum of coefficients whose expected squares are these.
Spectrum likeliest_spectrum(const VectorXd& squares) {
  Spectrum best;
  double least = std::numeric_limits<double>::infinity();
  // Below a power of 2 a wall would have no slope, and waves beyond a power of 6 have no say.
  for (double power = 2; power <= 6.001; power += 0.1) {
    Spectrum trial{.amplitude = 1, .power = power};
    double weighted = 0, logarithms = 0;
    const auto count = static_cast<double>(squares.size() - 1);
    for (Index k = 1; k < squares.size(); ++k) {
      const double shape = trial.variance(harmonic_degree(k));
      weighted += squares[k] / shape;
      logarithms += std::log(shape);
    }
    trial.amplitude = std::max(1e-12, weighted / count);
    const double cost = count * std::log(trial.amplitude) + logarithms + weighted / trial.amplitude;
    if (cost >= least) continue;
    least = cost;
    best = trial;
  }
  return best;
}

/// Where a click is beside its wall.
struct Misfit {
  Prolate at;
  double distance_mm;    ///< outside the wall: positive
  double mm_per_lambda;  ///< by which the wall moves along its normal
  Vector3d normal;       ///< outwards, in the frame's axes
  VectorXd basis;
};

Misfit misfit(const ProlateFrame& frame, const Vector3d& patient_mm, const VectorXd& middle,
              const VectorXd& thickness, double side) {
  Prolate at = frame.coordinates(frame.inside(patient_mm));
  // The axis itself has no direction around it.
  at.mu = std::max(at.mu, 1e-6);
  const Harmonics basis = harmonics(wall_degree, at.mu, at.theta);
  const VectorXd coefficients = middle + side * thickness;
  const double wall = basis.value.dot(coefficients);
  const double by_mu = basis.by_mu.dot(coefficients);
  const double by_theta = basis.by_theta.dot(coefficients);
  const Prolate between{0.5 * (wall + at.lambda), at.mu, at.theta};
  const double scale = frame.scale_mm(between);
  const Eigen::Matrix3d tangents = frame.tangents(between);
  const double around = scale / tangents.col(2).norm();
  const double norm = std::sqrt(1 + by_mu * by_mu + by_theta * by_theta * around * around);
  Misfit m{at, scale * (at.lambda - wall) / norm, scale / norm, {}, basis.value};
  m.normal = (tangents.col(0).normalized() - by_mu * tangents.col(1).normalized() -
              by_theta * around * tangents.col(2).normalized()) /
             norm;
  return m;
}

constexpr double side_of(GuideSurface surface) { return is_inner(surface) ? -0.5 : 0.5; }

/// Which slices may move, and along which two directions (in the frame's axes).
struct FreeSlice {
  size_t slice;
  Eigen::Matrix<double, 3, 2> directions;
};

class WallFit {
 public:
  WallFit(const GuidePoints& guide, const std::vector<GuideSlice>& slices, const VentricleFrame& start,
          std::vector<FreeSlice> free)
      : guide_(guide), frame_(start.frame), free_(std::move(free)), place_(slices.size(), -1) {
    for (size_t i = 0; i < free_.size(); ++i)
      place_[free_[i].slice] = static_cast<Index>(i);
    for (const GuideSlice& slice : slices) {
      in_plane_.push_back(slice.is_plane ? projection(frame_.axes.transpose() * slice.normal)
                                         : Eigen::Matrix3d(Eigen::Matrix3d::Identity()));
      across_mm_.emplace_back(slice.is_plane ? slice.scatter_mm * (frame_.axes.transpose() * slice.normal)
                                             : Vector3d(Vector3d::Zero()));
    }
    const double whole = std::sqrt(4 * std::numbers::pi);  // of a constant one
    VectorXd first = VectorXd::Zero(state_count);
    first[0] = whole * 0.5 * (start.inner_lambda + start.outer_lambda);
    first[wall_count] = whole * (start.outer_lambda - start.inner_lambda);
    coefficients_.assign(guide.phases.size(), first);
    shifts_ = VectorXd::Zero(2 * static_cast<Index>(free_.size()));
  }

  /// Returns whether it settled.
  bool run(int limit) {
    for (iterations_ = 1; iterations_ <= limit; ++iterations_) {
      // The equations change little once the walls are near: then every fifth time does.
      if (iterations_ <= 6 || iterations_ % 5 == 0) fit_.emplace(equations(), departures());
      fit_->solve(prior());
      const double moved = take_over();
      const double evidence_moved = set_variances();
      if (iterations_ > 8 && iterations_ % 5 == 0 && moved < 0.005 && evidence_moved < 0.05) return true;
    }
    return false;
  }

  [[nodiscard]] const VectorXd& coefficients(size_t phase) const { return coefficients_[phase]; }
  [[nodiscard]] MatrixXd covariance(size_t phase) const {
    MatrixXd of_common = MatrixXd::Zero(state_count, state_count + shifts_.size());
    of_common.leftCols(state_count).setIdentity();
    return fit_->covariance(phase, of_common, MatrixXd::Identity(state_count, departures()));
  }
  [[nodiscard]] Vector3d shift_mm(size_t free) const {
    return frame_.axes * (free_[free].directions * shifts_.segment<2>(2 * static_cast<Index>(free)));
  }
  [[nodiscard]] double shift_sigma_mm(size_t free) const {
    const Index at = state_count + 2 * static_cast<Index>(free);
    return std::sqrt(fit_->common_covariance().diagonal().segment<2>(at).mean());
  }
  [[nodiscard]] double noise_factor() const { return std::sqrt(noise_variance_); }
  [[nodiscard]] double shift_spread_mm() const { return free_.empty() ? 0.0 : std::sqrt(shift_variance_); }
  [[nodiscard]] int iterations() const { return iterations_; }
  [[nodiscard]] Misfit misfit_of(const GuidePoint& point) const {
    const VectorXd& c = coefficients_[point.phase];
    return misfit(frame_, true_place(point), c.head(wall_count), c.segment(wall_count, wall_count),
                  side_of(point.surface));
  }
  [[nodiscard]] double sigma_mm(const GuidePoint& point, const Misfit& m) const {
    const double in_plane = std::max(least_normal_in_plane, (in_plane_[point.slice] * m.normal).norm());
    return std::hypot(point.sigma_mm * in_plane, across_mm_[point.slice].dot(m.normal));
  }

 private:
  static Eigen::Matrix3d projection(const Vector3d& normal) {
    return Eigen::Matrix3d::Identity() - normal * normal.transpose();
  }

  /// Without the slice's displacement.
  [[nodiscard]] Vector3d true_place(const GuidePoint& point) const {
    const Index free = place_[point.slice];
    return free < 0 ? point.place_mm : Vector3d(point.place_mm - shift_mm(static_cast<size_t>(free)));
  }

  [[nodiscard]] std::vector<PhaseEquations> equations() const {
    std::vector<Index> rows(guide_.phases.size(), 0);
    for (const GuidePoint& point : guide_.points)
      ++rows[point.phase];
    std::vector<PhaseEquations> all;
    for (const Index count : rows)
      all.push_back({MatrixXd::Zero(count, state_count + shifts_.size()), VectorXd::Zero(count)});
    std::fill(rows.begin(), rows.end(), 0);
    for (const GuidePoint& point : guide_.points) {
      PhaseEquations& e = all[point.phase];
      const Index row = rows[point.phase]++;
      if (point.surface == GuideSurface::base) {
        add_base_row(e, row, point);
      } else {
        add_wall_row(e, row, point);
      }
    }
    return all;
  }

  /// The square root of what remains of a point's weight (Huber).
  [[nodiscard]] double robust_share(double sigmas) const {
    // At first walls and slices are far from where they belong.
    const double far = sigmas / (huber_sigmas * noise_factor());
    return iterations_ > 3 && far > 1 ? std::sqrt(1 / far) : 1.0;
  }

  void add_wall_row(PhaseEquations& e, Index row, const GuidePoint& point) const {
    const Misfit m = misfit_of(point);
    double weight = 1 / sigma_mm(point, m);
    weight *= robust_share(std::abs(m.distance_mm) * weight);
    const double side = side_of(point.surface);
    e.common.row(row).head<wall_count>() = weight * m.mm_per_lambda * m.basis.transpose();
    e.common.row(row).segment<wall_count>(wall_count) = side * e.common.row(row).head<wall_count>();
    if (const Index free = place_[point.slice]; free >= 0)
      e.common.row(row).segment<2>(state_count + 2 * free) =
          weight * m.normal.transpose() * free_[static_cast<size_t>(free)].directions;
    e.y[row] = weight * m.distance_mm +
               e.common.row(row).head<state_count>().dot(coefficients_[point.phase]) +
               e.common.row(row).tail(shifts_.size()).dot(shifts_);
  }

  void add_base_row(PhaseEquations& e, Index row, const GuidePoint& point) const {
    const Vector3d x = frame_.inside(true_place(point));
    const Vector3d terms(1, x.x(), x.y());
    double weight = 1 / point.sigma_mm;
    weight *= robust_share(weight * std::abs(x.z() - terms.dot(coefficients_[point.phase].tail<3>())));
    e.common.row(row).segment<3>(base_place) = weight * terms;
    e.y[row] = weight * x.z();
  }

  [[nodiscard]] PhasedPrior prior() const {
    PhasedPrior prior;
    prior.common_variance.resize(state_count + shifts_.size());
    prior.common_variance << variances(common_[0], wall_count), variances(common_[1], wall_count),
        Vector3d::Constant(std::numeric_limits<double>::infinity()),
        VectorXd::Constant(shifts_.size(), shift_variance_);
    if (has_departures()) prior.departure_variance = departure_variance_;
    prior.noise_variance = noise_variance_;
    return prior;
  }

  /// The solution becomes the state; returns by how much the walls moved where they are seen: the RMS of the worst phase, in points' sigmas.
  double take_over() {
    double moved = 0;
    for (size_t p = 0; p < coefficients_.size(); ++p) {
      VectorXd now = fit_->common().head(state_count);
      if (has_departures()) now += fit_->departure(p);
      moved = std::max(moved, fit_->rms_of(p, now - coefficients_[p]));
      coefficients_[p] = now;
    }
    shifts_ = fit_->common().tail(shifts_.size());
    return moved;
  }

  /// The maximisation step; returns the largest relative change of a standard deviation that matters.
  double set_variances() {
    double change = 0;
    const auto set = [&](double& variance, double now) {
      change = std::max(change, std::abs(std::log(now / variance)) / 2);
      variance = now;
    };
    const VectorXd squares = fit_->square_of_common();
    for (Index field = 0; field < 2; ++field)
      common_[static_cast<size_t>(field)] =
          likeliest_spectrum(squares.segment(field * wall_count, wall_count));
    if (has_departures()) learn_departures();
    if (shifts_.size() > 0) set(shift_variance_, std::max(1e-4, squares.tail(shifts_.size()).mean()));
    // What a person says of the error of clicks counts like twenty points.
    constexpr double stated = 20;
    set(noise_variance_, (fit_->noise_square() + stated) / (static_cast<double>(fit_->rows()) + stated));
    return change;
  }

  /// One variance a degree for m = 0, one for the other orders: what holds a base and what fills a cavity moves walls alike all around, and far
  /// more than all else does.
  void learn_departures() {
    const double phases = static_cast<double>(guide_.phases.size());
    const VectorXd squares = fit_->square_of_departures() / phases;
    for (const Index field : {Index{0}, wall_count}) {
      for (Index l = 0; l <= wall_degree; ++l) {
        const Index first = field + l * l, count = 2 * l + 1, alike = first + l;
        const double others = squares.segment(first, count).sum() - squares[alike];
        departure_variance_.segment(first, count)
            .setConstant(std::max(1e-12, others / std::max(1.0, 2.0 * static_cast<double>(l))));
        departure_variance_[alike] = std::max(1e-12, squares[alike]);
      }
    }
    departure_variance_[base_place] = std::max(1e-6, squares[base_place]);
    departure_variance_.tail<2>().setConstant(std::max(1e-9, squares.tail<2>().mean()));
  }

  [[nodiscard]] bool has_departures() const { return guide_.phases.size() > 1; }
  [[nodiscard]] Index departures() const { return has_departures() ? state_count : 0; }

  const GuidePoints& guide_;
  ProlateFrame frame_;
  std::vector<FreeSlice> free_;
  std::vector<Index> place_;  // of a slice among the free ones; -1: it is not
  std::vector<Eigen::Matrix3d> in_plane_;
  std::vector<Vector3d> across_mm_;     // of each slice: how far its points scatter, along its normal
  std::vector<VectorXd> coefficients_;  // of each phase: middle, thickness
  VectorXd shifts_;
  // To start: departures from an ellipsoid of a twentieth, and shifts of 2 mm.
  std::array<Spectrum, 2> common_{Spectrum{.amplitude = 0.01}, Spectrum{.amplitude = 0.003}};
  // ... a base that moves by a centimetre and tilts by a tenth.
  VectorXd departure_variance_ =
      (VectorXd(state_count) << variances({.zero = 0.1, .amplitude = 0.003}, wall_count),
       variances({.zero = 0.1, .amplitude = 0.001}, wall_count), 100, 0.01, 0.01)
          .finished();
  double shift_variance_ = 4;
  double noise_variance_ = 1;
  int iterations_ = 0;
  std::optional<PhasedFit> fit_;
};

std::vector<bool> held_slices(const GuidePoints& guide, const std::vector<GuideSlice>& slices,
                              const VentricleOptions& options, const Vector3d& axis) {
  std::vector<bool> held(slices.size());
  for (const std::string& name : options.reference_slices) {
    if (std::find(guide.slices.begin(), guide.slices.end(), name) != guide.slices.end()) continue;
    throw InputError(
        {guide.file, "--reference", fmt::format("no slice is called \"{}\"", name),
         fmt::format("It has {} slices, the first is \"{}\".", guide.slices.size(), guide.slices[0])});
  }
  for (size_t s = 0; s < slices.size(); ++s) {
    const bool is_named = std::find(options.reference_slices.begin(), options.reference_slices.end(),
                                    guide.slices[s]) != options.reference_slices.end();
    held[s] = !options.estimate_shifts || !slices[s].is_plane || is_named ||
              (options.reference_slices.empty() && !slices[s].is_short_axis(axis));
  }
  return held;
}

/// Long-axis planes in two directions hold a ventricle in place.
bool has_reference(const std::vector<GuideSlice>& slices, const std::vector<bool>& held,
                   const Vector3d& axis) {
  for (size_t a = 0; a < slices.size(); ++a)
    for (size_t b = 0; b < a; ++b) {
      if (!held[a] || !held[b] || !slices[a].is_plane || !slices[b].is_plane) continue;
      const Vector3d across = slices[a].normal.cross(slices[b].normal);
      // By 20 degrees at least: below that the two see the same displacement.
      if (slices[a].is_short_axis(axis) || slices[b].is_short_axis(axis) || across.norm() > std::sin(0.35))
        return true;
    }
  return false;
}

/// One finding for each wall in a slice: what is wrong there is so in phase after phase.
void add_wild_points(VentricleFit& fit, const GuidePoints& guide, const WallFit& walls) {
  struct Wild {
    size_t points = 0, phase = 0;
    double farthest_mm = 0;
  };
  std::map<std::pair<size_t, GuideSurface>, Wild> found;  // by slice and wall
  for (const GuidePoint& point : guide.points) {
    if (point.surface == GuideSurface::base) continue;
    const Misfit m = walls.misfit_of(point);
    if (std::abs(m.distance_mm) <= wild_sigmas * walls.sigma_mm(point, m) * fit.noise_factor) continue;
    Wild& wild = found[{point.slice, point.surface}];
    ++wild.points;
    if (std::abs(m.distance_mm) <= std::abs(wild.farthest_mm)) continue;
    wild.farthest_mm = m.distance_mm;
    wild.phase = point.phase;
  }
  for (const auto& [place, wild] : found) {
    const auto& [slice, surface] = place;
    const std::string_view wall = name_of(surface);
    fit.findings.push_back(
        {Severity::warning, "wild-point",
         wild.points == 1
             ? fmt::format("a point of the {} lies {:.1f} mm beside its wall", wall, wild.farthest_mm)
             : fmt::format("{} points of the {} lie beside their wall, the farthest by {:.1f} mm",
                           wild.points, wall, wild.farthest_mm),
         fmt::format("phase {}, slice {}", guide.phases[wild.phase], guide.slices[slice]), wild.farthest_mm,
         "mm", "Look at the image there; none pulls more than one three sigmas off."});
  }
}

struct FreeSlices {
  std::vector<FreeSlice> slices;
  std::vector<size_t> place;  ///< of each slice among them, if it is one
};

FreeSlices free_slices(const std::vector<GuideSlice>& slices, const std::vector<bool>& held,
                       const Eigen::Matrix3d& axes) {
  FreeSlices free{{}, std::vector<size_t>(slices.size(), 0)};
  for (size_t s = 0; s < slices.size(); ++s) {
    if (held[s]) continue;
    const Vector3d normal = axes.transpose() * slices[s].normal;
    FreeSlice one{s, {}};
    one.directions.col(0) = normal.unitOrthogonal();
    one.directions.col(1) = normal.cross(one.directions.col(0));
    free.place[s] = free.slices.size();
    free.slices.push_back(one);
  }
  return free;
}

/// Each phase's walls, and how far its points lie beside them.
void add_phases(VentricleFit& fit, const GuidePoints& guide, const WallFit& walls) {
  std::vector<double> squares(guide.phases.size(), 0);
  std::vector<size_t> counts(guide.phases.size(), 0);
  for (const GuidePoint& point : guide.points) {
    if (point.surface == GuideSurface::base) continue;
    squares[point.phase] += std::pow(walls.misfit_of(point).distance_mm, 2);
    ++counts[point.phase];
  }
  double all_squares = 0;
  size_t all_points = 0;
  for (size_t p = 0; p < guide.phases.size(); ++p) {
    VentricleWalls one;
    one.phase = guide.phases[p];
    one.middle = walls.coefficients(p).head(wall_count);
    one.thickness = walls.coefficients(p).segment(wall_count, wall_count);
    one.base = walls.coefficients(p).tail<3>();
    one.covariance = walls.covariance(p);
    one.points = counts[p];
    one.rms_mm = counts[p] > 0 ? std::sqrt(squares[p] / static_cast<double>(counts[p])) : 0.0;
    all_squares += squares[p];
    all_points += counts[p];
    fit.phases.push_back(std::move(one));
  }
  fit.rms_mm = std::sqrt(all_squares / static_cast<double>(all_points));
}

}  // namespace

VentricleFit fit_ventricle(const GuidePoints& given, const VentricleOptions& options) {
  VentricleFit fit;
  fit.findings = given.findings;
  const GuidePoints sound = without_wild_points(given, fit.findings);
  const std::vector<GuideSlice> slices = guide_slices(sound);
  const VentricleFrame start = ventricle_frame(sound, slices);
  const Vector3d axis = start.frame.axes.col(2);
  fit.frame = start.frame;
  const GuidePoints guide = with_base(sound, slices, start.frame, fit.findings);
  const std::vector<bool> held = held_slices(guide, slices, options, axis);

  const FreeSlices free = free_slices(slices, held, fit.frame.axes);
  if (!free.slices.empty() && !has_reference(slices, held, axis))
    fit.findings.push_back(
        {Severity::warning, "no-reference",
         "no two long-axis slices show where the short-axis slices belong: their mean displacement is taken "
         "as none",
         guide.file, 0, "",
         "Set points in long-axis images too, or name slices that are right: --reference."});

  WallFit walls(guide, slices, start, free.slices);
  constexpr int limit = 100;
  fit.converged = walls.run(limit);
  fit.iterations = walls.iterations();
  fit.noise_factor = walls.noise_factor();
  fit.shift_spread_mm = walls.shift_spread_mm();
  for (size_t s = 0; s < slices.size(); ++s) {
    SliceShift shift{guide.slices[s], held[s]};
    if (options.estimate_shifts && slices[s].points == 0) {
      shift = {.slice = guide.slices[s], .sigma_mm = walls.shift_spread_mm()};  // nothing is seen of it
    } else if (!held[s]) {
      shift.shift_mm = walls.shift_mm(free.place[s]);
      shift.sigma_mm = walls.shift_sigma_mm(free.place[s]);
    }
    fit.shifts.push_back(shift);
  }
  add_wild_points(fit, guide, walls);
  add_phases(fit, guide, walls);
  for (Finding& finding : ventricle_findings(fit, guide, slices, options))
    fit.findings.push_back(std::move(finding));
  return fit;
}

}  // namespace diastole::imaging
