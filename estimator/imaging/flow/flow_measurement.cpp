#include "estimator/imaging/flow/flow_measurement.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <complex>
#include <numbers>

#include "estimator/imaging/flow/lumen_movement.hpp"
#include "estimator/imaging/flow/phase_unwrapping.hpp"
#include "protocol/contract/input_error.hpp"
#include "protocol/signal/median.hpp"

namespace diastole::imaging {
namespace {

/// Ringing of the lumen's edge has fallen to a hundredth this far away.
constexpr int clear_px = 6;
/// A lumen of fewer pixels across has no core whose phase is its own.
constexpr double least_radius_px = 2.5;
/// From phase to phase the velocity may change by this share of half a turn before its turns are a guess by time alone.
constexpr double sure_step = 0.75;
/// Chi-square by which another turn must be worse where time alone does not decide: odds of one in a hundred.
constexpr double sure_margin = 9.2;

/// Uncorrected backgrounds of 12 scanners were 0.4 to 4.9 cm/s (J. Cardiovasc. Magn. Reson. 12 (2010) 5).
constexpr double usual_background_cm_s = 2.0;
/// A fast phase whose chi-square is so many times that of the best, and no small one, has more wraps than were found.
constexpr double worst_wrapped = 3.0, worst_chi_square = 4.0;

const MovingRegion& chosen_region(const std::vector<MovingRegion>& regions, const FlowRequest& request,
                                  const std::string& folder, const std::string& name) {
  if (regions.empty() || (!request.centre_px && regions[0].radius_px < least_radius_px))
    throw InputError(
        {folder, name, "no lumen is found: nowhere do pixels with signal change their phase over the cycle",
         "Was the pump running, and does the slice cross the tube? If a lumen is to be seen, give "
         "its centre with --centre COLUMN,ROW (pixels from 0)."});
  if (!request.centre_px) return regions[0];
  const auto nearest = std::min_element(regions.begin(), regions.end(), [&](const auto& a, const auto& b) {
    return (a.centre - *request.centre_px).norm() / a.radius_px <
           (b.centre - *request.centre_px).norm() / b.radius_px;
  });
  if ((nearest->centre - *request.centre_px).norm() > nearest->radius_px ||
      nearest->radius_px < least_radius_px)
    throw InputError(
        {folder, fmt::format("--centre {:g},{:g}", request.centre_px->x(), request.centre_px->y()),
         fmt::format("nothing moves there; the nearest lumen of {} is at column {:.0f}, row {:.0f}",
                     regions.size(), nearest->centre.x(), nearest->centre.y()),
         "Give a place within it."});
  return *nearest;
}

double mean_over_ring(const Image& image, const Eigen::Vector2d& centre, double from_px, double to_px) {
  std::vector<double> values;
  for (Eigen::Index column = 0; column < image.cols(); ++column) {
    for (Eigen::Index row = 0; row < image.rows(); ++row) {
      const double apart =
          std::hypot(static_cast<double>(column) - centre.x(), static_cast<double>(row) - centre.y());
      if (apart >= from_px && apart < to_px) values.push_back(static_cast<double>(image(row, column)));
    }
  }
  return values.empty() ? 0.0 : signal::median(std::move(values));
}

/// Where the brightness outwards of the lumen has come back to half of what lies beyond the wall.
LumenScene first_scene(const SlicePlane& plane, const MotionMap& map, const MovingRegion& region,
                       const std::vector<Image>& magnitude, const std::vector<double>& core_rad,
                       const std::vector<Eigen::Vector2i>& core) {
  LumenScene scene;
  const double pixel_mm = std::sqrt(plane.column_spacing_mm * plane.row_spacing_mm);
  scene.shape.centre_mm = {region.centre.x() * plane.column_spacing_mm,
                           region.centre.y() * plane.row_spacing_mm};
  scene.shape.radius_mm = region.radius_px * pixel_mm;
  const Image& mean = map.mean_magnitude;
  const double radius = region.radius_px;
  constexpr double reach_px = 10;
  double darkest = mean_over_ring(mean, region.centre, radius, radius + 1), darkest_px = 0;
  for (double out = 0.5; out < reach_px; out += 0.5) {
    const double here = mean_over_ring(mean, region.centre, radius + out, radius + out + 1);
    if (here >= darkest) continue;
    darkest = here;
    darkest_px = out;
  }
  double beyond = 0;
  for (double out = darkest_px; out < darkest_px + reach_px; out += 1)
    beyond = std::max(beyond, mean_over_ring(mean, region.centre, radius + out, radius + out + 2));
  double wall_px = darkest_px;
  while (wall_px < darkest_px + reach_px && mean_over_ring(mean, region.centre, radius + wall_px,
                                                           radius + wall_px + 1) < 0.5 * (darkest + beyond))
    wall_px += 0.5;
  const bool is_dark_outside = beyond < 4 * map.noise.magnitude_times_phase;
  scene.shape.wall_mm = pixel_mm * (is_dark_outside ? 3.0 : std::max(0.0, wall_px));
  scene.brightness.still = is_dark_outside ? 0 : beyond;
  // Brightness of the core against its velocity.
  const auto count = static_cast<Eigen::Index>(magnitude.size());
  Eigen::MatrixXd rows(count, 3);
  Eigen::VectorXd bright(count);
  for (Eigen::Index k = 0; k < count; ++k) {
    const double phi = core_rad[static_cast<size_t>(k)];
    rows.row(k) << 1, std::abs(phi), phi * phi;
    bright[k] = 0;
    for (const Eigen::Vector2i& at : core)
      bright[k] += static_cast<double>(magnitude[static_cast<size_t>(k)](at.y(), at.x())) /
                   static_cast<double>(core.size());
  }
  // Ridged by a tenth of the brightness at a radian: few phases, or all of one speed, do not determine three numbers.
  Eigen::Matrix3d normal = rows.transpose() * rows;
  normal.diagonal().tail<2>().array() += 1e-3 * static_cast<double>(count);
  scene.brightness.fluid = normal.ldlt().solve(rows.transpose() * bright);
  return scene;
}

std::vector<Image> without_background(const PhaseContrast& scan, const BackgroundPhase& background) {
  std::vector<Image> phases = scan.phase_rad;
  for (Eigen::Index column = 0; column < phases[0].cols(); ++column) {
    for (Eigen::Index row = 0; row < phases[0].rows(); ++row) {
      const double phase = background.at(static_cast<double>(column), static_cast<double>(row));
      for (Image& image : phases)
        image(row, column) =
            static_cast<float>(within_half_turn(static_cast<double>(image(row, column)) - phase));
    }
  }
  return phases;
}

/// The scan without background, moved so that the lumen stays in its place.
struct HeldLumen {
  PhaseContrast scan;
  MotionMap map;
  MovingRegion region;
};

HeldLumen held_lumen(const PhaseContrast& scan, const LumenData& data, const MotionMap& map,
                     const MovingRegion& region, const std::vector<Eigen::Vector2d>& movement_px) {
  HeldLumen held{scan, map, region};
  held.scan.phase_rad = data.phase_rad;
  if (movement_px.empty()) return held;
  held.scan.magnitude = held_still(data.magnitude, movement_px);
  held.scan.phase_rad = held_still(data.phase_rad, movement_px);
  held.map = motion_map(held.scan);
  // All places of the lumen together held its mean place.
  for (const MovingRegion& part : moving_regions(held.map)) {
    if ((part.centre - region.centre).norm() > region.radius_px || part.radius_px < least_radius_px) continue;
    held.region = part;
    break;
  }
  return held;
}

/// The sum of a phase's steps to the next, the last to the first one's return, in usual ones.
std::vector<double> gaps_of(const PhaseContrast& scan) {
  const size_t count = scan.phases();
  std::vector<double> steps;
  for (size_t k = 0; k + 1 < count; ++k)
    steps.push_back(scan.time_s[k + 1] - scan.time_s[k]);
  const double usual = signal::median(steps);
  steps.push_back(scan.interval_s - (scan.time_s.back() - scan.time_s.front()));
  for (double& step : steps)
    step = std::max(0.1, step / usual);
  return steps;
}

/// Whole turns follow from the course over the cycle or from the profile across the lumen, which goes to zero at the wall; and the images must look as
/// the fit says.
void require_known_turns(const FlowMeasurement& flow, const std::string& folder) {
  constexpr double half_turn = std::numbers::pi;
  const double cm_s = flow.scan.cm_s_per_radian();
  const size_t count = flow.scan.phases();
  const std::vector<double> gap = gaps_of(flow.scan);
  const std::vector<double>& core = flow.lumen.core_cm_s;
  const double best =
      *std::min_element(flow.lumen.phase_chi_square.begin(), flow.lumen.phase_chi_square.end());
  for (size_t k = 0; k < count; ++k) {
    if (std::abs(core[k]) < 0.5 * flow.scan.venc_cm_s) continue;
    const size_t last = (k + count - 1) % count;
    const double step = std::max(std::abs(core[k] - core[last]) / gap[last],
                                 std::abs(core[(k + 1) % count] - core[k]) / gap[k]);
    const bool unambiguous = step < sure_step * half_turn * cm_s || flow.lumen.turn_margin[k] > sure_margin;
    if (unambiguous && flow.lumen.phase_chi_square[k] < std::max(worst_chi_square, worst_wrapped * best))
      continue;
    throw InputError(
        {folder, fmt::format("{}, phase at {:.0f} ms", flow.scan.name, 1e3 * flow.scan.time_s[k]),
         fmt::format(
             "at a venc of {:.4g} cm/s the velocity wraps beyond recovery: it changes by {:.0f} cm/s from "
             "phase to phase, and chi-square of the profile across the lumen is {:.1f} beside {:.1f} of the "
             "best "
             "phase",
             flow.scan.venc_cm_s, step, flow.lumen.phase_chi_square[k], best),
         "Image with a venc above the peak velocity, or with more phases."});
  }
}

/// Sigmas are the curvature of chi-square where it is least, times its root per degree of freedom: of a fit that has ended elsewhere they mean nothing.
/// And whole turns are recognised by what velocities look like: by nothing where the fit does not explain them.
void require_trustworthy(const FlowMeasurement& flow, const std::string& folder) {
  const bool may_wrap = std::ranges::any_of(flow.lumen.core_cm_s, [&](double core_cm_s) {
    return std::abs(core_cm_s) > 0.5 * flow.scan.venc_cm_s;
  });
  const bool is_settled = flow.lumen.converged || flow.lumen.reduced_chi_square < worst_chi_square;
  if (may_wrap && (!is_settled || flow.lumen.velocity_chi_square > worst_chi_square)) {
    throw InputError(
        {folder, flow.scan.name,
         fmt::format(
             "at a venc of {:.4g} cm/s the velocity wraps beyond recovery, or the images do not look "
             "like one tube: the fit of the lumen leaves a chi-square of {:.1f} per pixel of the phases",
             flow.scan.venc_cm_s, flow.lumen.velocity_chi_square),
         "Image with a venc above the peak velocity, or with more phases. Does the lumen leave the image, "
         "change its shape or touch another? --centre COLUMN,ROW may start the fit elsewhere."});
  }
  if (is_settled) return;
  throw InputError(
      {folder, flow.scan.name,
       fmt::format("the fit of the lumen has not settled, and leaves a chi-square of {:.1f} per pixel: the "
                   "images do not look like one tube, its wall and still material",
                   flow.lumen.reduced_chi_square),
       "Look at the magnitudes: does the lumen leave the image, change its shape or touch another? --centre "
       "COLUMN,ROW may start the fit elsewhere."});
}

void add_fit_findings(FlowMeasurement& flow) {
  const LumenFit& lumen = flow.lumen;
  if (lumen.describes_images()) return;
  const std::string remedy = "Look at the outline on the page; --centre may start it elsewhere.";
  if (!lumen.converged)
    flow.findings.push_back({Severity::warning, "lumen-fit", "the fit of the lumen has not settled",
                             flow.scan.name, lumen.reduced_chi_square, "", remedy});
  else
    flow.findings.push_back(
        {Severity::warning, "lumen-misfit",
         fmt::format("the images differ from the lumen that was fitted by more than their noise, chi-square "
                     "{:.1f} per pixel; the sigmas are {:.1f} times as large for it",
                     lumen.reduced_chi_square, std::sqrt(lumen.reduced_chi_square)),
         flow.scan.name, lumen.reduced_chi_square, "", remedy});
}

/// Volumes of the whole interval on even times; their extremes are the stroke.
void join_cycle(FlowMeasurement& flow, const FlowRequest& request) {
  const PhaseContrast& scan = flow.scan;
  const Eigen::VectorXd time =
      Eigen::Map<const Eigen::VectorXd>(scan.time_s.data(), static_cast<Eigen::Index>(scan.phases()));
  flow.flow = periodic_regression(time, flow.lumen.flow_mL_s, flow.lumen.covariance, scan.interval_s);
  const Eigen::VectorXd whole = flow.flow.integral_row(scan.interval_s);
  flow.closure_mL = {flow.flow.of(whole), flow.flow.sigma_of(whole)};
  flow.is_closed = request.close;
  if (request.close) flow.flow = closed(flow.flow);
  constexpr int times = 720;
  double lowest = 0, highest = 0, lowest_s = 0, highest_s = 0;
  for (int i = 0; i <= times; ++i) {
    const double t = scan.interval_s * i / times;
    const double volume = flow.flow.of(flow.flow.integral_row(t));
    if (volume < lowest) {
      lowest = volume;
      lowest_s = t;
    }
    if (volume > highest) {
      highest = volume;
      highest_s = t;
    }
  }
  flow.least_s = lowest_s;
  flow.stroke_mL = flow.volume_at(highest_s);
}

void add_other_lumens(FlowMeasurement& flow, const std::vector<MovingRegion>& regions,
                      const MovingRegion& chosen) {
  for (const MovingRegion& other : regions) {
    if (&other == &chosen || other.radius_px < 0.5 * chosen.radius_px) continue;
    flow.findings.push_back(
        {Severity::warning, "other-lumen",
         fmt::format("fluid moves also around column {:.0f}, row {:.0f}", other.centre.x(), other.centre.y()),
         flow.scan.name, other.radius_px, "px",
         "If that is the tube, give --centre with this column and row."});
  }
}

void find_background(FlowMeasurement& flow, const FlowRequest& request, const MotionMap& map,
                     const Eigen::Array<bool, Eigen::Dynamic, Eigen::Dynamic>& still,
                     const MovingRegion& region) {
  flow.background.order = -1;
  if (request.remove_background)
    flow.background = background_phase(map, still, region.centre, region.radius_px);
  if (flow.background.order >= 0) return;
  flow.findings.push_back(
      {Severity::warning, "background-unknown",
       request.remove_background
           ? "there is no still material around the lumen: the background phase is not known"
           : "the background phase was left, as asked for",
       flow.scan.name, static_cast<double>(flow.background.pixels), "pixels",
       "A block of still gel around the tube shows the background; --close takes off what a cycle "
       "does not return."});
}

/// An error of the background is the same in all phases.
void add_background_error(FlowMeasurement& flow) {
  const double background_cm_s = flow.background.order < 0
                                     ? usual_background_cm_s
                                     : flow.background.sigma_rad * flow.scan.cm_s_per_radian();
  const double background_mL_s = background_cm_s * 0.01 * flow.lumen.area_mm2;
  flow.lumen.covariance.array() += background_mL_s * background_mL_s;
}

/// The lumen's pixels away from its wall.
std::vector<Eigen::Vector2i> core_of(const MovingRegion& region) {
  std::vector<Eigen::Vector2i> core;
  for (const Eigen::Vector2i& at : region.pixels)
    if ((at.cast<double>() - region.centre).norm() < std::max(1.5, 0.6 * region.radius_px))
      core.push_back(at);
  return core;
}

/// Of each image, that of the pixels' sum.
std::vector<double> mean_phases_rad(const PhaseContrast& scan, const std::vector<Eigen::Vector2i>& pixels) {
  std::vector<double> phases;
  for (size_t k = 0; k < scan.phases(); ++k) {
    std::complex<double> sum = 0;
    for (const Eigen::Vector2i& at : pixels)
      sum += std::polar(static_cast<double>(scan.magnitude[k](at.y(), at.x())),
                        static_cast<double>(scan.phase_rad[k](at.y(), at.x())));
    phases.push_back(std::arg(sum));
  }
  return phases;
}

/// Flow and volume of each image; `core_phase_rad`: as measured in the core.
void add_phases(FlowMeasurement& flow, const FlowRequest& request,
                const std::vector<double>& core_phase_rad) {
  for (size_t k = 0; k < flow.scan.phases(); ++k) {
    PhaseFlow phase;
    phase.phase_s = flow.scan.time_s[k];
    const auto at = static_cast<Eigen::Index>(k);
    phase.flow_mL_s = {flow.lumen.flow_mL_s[at], std::sqrt(flow.lumen.covariance(at, at))};
    if (request.close) phase.flow_mL_s = flow.flow_at(phase.phase_s);
    phase.volume_mL = flow.volume_at(phase.phase_s);
    phase.core_cm_s = flow.lumen.core_cm_s[k];
    phase.turns = static_cast<int>(std::lround(
        (phase.core_cm_s / flow.scan.cm_s_per_radian() - core_phase_rad[k]) / (2 * std::numbers::pi)));
    flow.unwrapped += phase.turns != 0 ? 1U : 0U;
    flow.phases.push_back(phase);
  }
}

}  // namespace

ValueWithError FlowMeasurement::flow_at(double time_s) const {
  const Eigen::VectorXd row = flow.value_row(time_s);
  return {flow.of(row), flow.sigma_of(row)};
}

ValueWithError FlowMeasurement::volume_at(double time_s) const {
  const Eigen::VectorXd row = flow.integral_row(time_s) - flow.integral_row(least_s);
  return {flow.of(row), flow.sigma_of(row)};
}

FlowMeasurement measure_flow(PhaseContrast scan, const FlowRequest& request, const std::string& folder) {
  FlowMeasurement flow;
  flow.scan = std::move(scan);
  flow.findings = flow.scan.findings;
  const SlicePlane& plane = flow.scan.plane;
  const MotionMap map = motion_map(flow.scan);
  const std::vector<MovingRegion> regions = moving_regions(map);
  const MovingRegion& region = chosen_region(regions, request, folder, flow.scan.name);
  add_other_lumens(flow, regions, region);
  const auto still = still_pixels(map, regions, clear_px);
  find_background(flow, request, map, still, region);
  LumenData data{plane,
                 flow.scan.magnitude,
                 without_background(flow.scan, flow.background),
                 map.noise,
                 measured_share(flow.scan, map, still),
                 flow.scan.cm_s_per_radian()};
  // With a lumen that is held still place, size and core are read as of one at rest.
  const std::vector<Eigen::Vector2d> movement_px =
      lumen_movement_px(data.magnitude, region, map.noise.magnitude);
  const HeldLumen held = held_lumen(flow.scan, data, map, region, movement_px);
  const std::vector<Eigen::Vector2i> core = core_of(held.region);
  const std::vector<double> core_phase = mean_phases_rad(held.scan, core);
  const UnwrappedCycle cycle = unwrapped(core_phase, gaps_of(flow.scan));
  LumenStart start{first_scene(plane, held.map, held.region, held.scan.magnitude, cycle.phase_rad, core),
                   {},
                   cycle.phase_rad};
  for (const Eigen::Vector2d& moved : movement_px)
    start.moved_mm.emplace_back(moved.x() * plane.column_spacing_mm, moved.y() * plane.row_spacing_mm);
  flow.lumen = fit_lumen(data, start);
  require_known_turns(flow, folder);
  require_trustworthy(flow, folder);

  add_background_error(flow);
  join_cycle(flow, request);
  add_phases(flow, request, core_phase);
  add_fit_findings(flow);
  return flow;
}

}  // namespace diastole::imaging
