#include "estimator/imaging/geometry/ventricle_findings.hpp"

#include <fmt/format.h>
#include <fmt/ranges.h>

#include <algorithm>

#include "estimator/imaging/geometry/wall_map.hpp"

namespace diastole::imaging {
namespace {

constexpr double much_noise = 1.5;
/// A rat's left ventricle; those of mice are half as long, and all others longer.
constexpr double rat_mm = 15;

void add_no_plane(std::vector<Finding>& findings, const GuidePoints& guide,
                  const std::vector<GuideSlice>& slices, const VentricleOptions& options) {
  if (!options.estimate_shifts) return;
  std::vector<std::string> names;
  for (size_t s = 0; s < slices.size(); ++s) {
    const bool is_named = std::find(options.reference_slices.begin(), options.reference_slices.end(),
                                    guide.slices[s]) != options.reference_slices.end();
    if (slices[s].points > 0 && !slices[s].is_plane && !is_named) names.push_back(guide.slices[s]);
  }
  if (names.empty()) return;
  findings.push_back(
      {Severity::warning, "no-plane",
       fmt::format("{} of {} slices make no plane: whether they were displaced is not looked for",
                   names.size(), slices.size()),
       fmt::format("slice {}", fmt::join(names, ", ")), static_cast<double>(names.size()), "",
       "Name each image's points as a slice of its own, four at least; let sigma_mm be no less than their "
       "scatter across it."});
}

void add_no_points(std::vector<Finding>& findings, const GuidePoints& guide,
                   const std::vector<GuideSlice>& slices) {
  std::vector<std::string> names;
  for (size_t s = 0; s < slices.size(); ++s)
    if (slices[s].points == 0) names.push_back(guide.slices[s]);
  if (names.empty()) return;
  findings.push_back(
      {Severity::note, "no-points",
       fmt::format("{} of {} slices have no points of a wall: where they lie is not measured", names.size(),
                   slices.size()),
       fmt::format("slice {}", fmt::join(names, ", ")), static_cast<double>(names.size()), "",
       "Beyond the apex and the base there is none. If a wall is seen there, give points of it "
       "in a table (docs/lv.md)."});
}

/// From the outer apex to the base.
double length_mm(const VentricleFit& fit) {
  const VentricleWalls& walls = fit.phases.front();
  return walls.base[0] - WallMap(fit.frame, walls).place_mm(0.5, 0, 1e-6).z();
}

}  // namespace

std::vector<Finding> ventricle_findings(const VentricleFit& fit, const GuidePoints& guide,
                                        const std::vector<GuideSlice>& slices,
                                        const VentricleOptions& options) {
  std::vector<Finding> findings;
  add_no_plane(findings, guide, slices, options);
  add_no_points(findings, guide, slices);
  if (fit.noise_factor > much_noise)
    findings.push_back(
        {Severity::warning, "noise",
         fmt::format("points lie {:.1f} times as far from their walls as sigma_mm says", fit.noise_factor),
         guide.file, fit.noise_factor, "",
         "Look whether slices, phases and walls are named rightly, or state a larger error."});
  if (const double length = length_mm(fit); length < rat_mm)
    findings.push_back({Severity::warning, "unit",
                        fmt::format("the ventricle is {:.3g} mm long, shorter than a rat's: are its "
                                    "coordinates in mm?",
                                    length),
                        guide.file, length, "mm", "Give coordinates in mm. A mouse's heart is so small."});
  return findings;
}

}  // namespace diastole::imaging
