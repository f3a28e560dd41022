#include "estimator/imaging/geometry/ventricle_record.hpp"

#include <fmt/format.h>

#include <cmath>
#include <numbers>

#include "estimator/imaging/geometry/wall_map.hpp"
#include "protocol/contract/angle.hpp"

namespace diastole::imaging {
namespace {

using Eigen::Vector3d;
constexpr double pi = std::numbers::pi;

struct Section {
  double theta;
  size_t slice;  ///< whose points are shown; the number of slices: none
  std::string title;
};

std::vector<Section> sections_of(const VentricleFit& fit, const GuidePoints& guide) {
  const std::vector<GuideSlice> slices = guide_slices(guide);
  std::vector<Section> sections;
  for (size_t s = 0; s < slices.size(); ++s) {
    if (!slices[s].is_plane || slices[s].is_short_axis(fit.frame.axes.col(2))) continue;
    const Vector3d normal = fit.frame.axes.transpose() * slices[s].normal;
    sections.push_back({std::atan2(normal.y(), normal.x()) + pi / 2, s,
                        fmt::format("Slice {} with its points.", guide.slices[s])});
  }
  if (!sections.empty()) return sections;
  for (const double degrees : {0.0, 60.0, 120.0})
    sections.push_back(
        {degrees * rad_per_deg, slices.size(), fmt::format("At {:.0f} degrees around the axis.", degrees)});
  return sections;
}

void draw_wall(const WallMap& map, double side, double theta, std::vector<double>& r,
               std::vector<double>& z) {
  constexpr int parts = 60;
  for (int i = -parts; i <= parts; ++i) {
    const double around = i < 0 ? theta + pi : theta;
    const double mu = map.base_mu(side, around) * std::abs(i) / parts;
    const Vector3d x = map.place_mm(side, around, mu);
    r.push_back(std::copysign(std::hypot(x.x(), x.y()), i));
    z.push_back(x.z());
  }
}

VentricleSectionRecord drawn(const Section& section, const VentricleSession& session,
                             const GuidePoints& guide) {
  const VentricleFit& fit = session.fit;
  VentricleSectionRecord record;
  record.title = section.title;
  const WallMap map(fit.frame, fit.phases[session.chosen]);
  draw_wall(map, -0.5, section.theta, record.inner_r, record.inner_z);
  draw_wall(map, 0.5, section.theta, record.outer_r, record.outer_z);
  if (session.smallest() != session.chosen)
    draw_wall(WallMap(fit.frame, fit.phases[session.smallest()]), -0.5, section.theta, record.small_r,
              record.small_z);
  for (const GuidePoint& point : guide.points) {
    if (point.slice != section.slice || point.phase != session.chosen || point.surface == GuideSurface::base)
      continue;
    const Vector3d x = fit.frame.inside(point.place_mm - fit.shifts[point.slice].shift_mm);
    const double side = x.x() * std::cos(section.theta) + x.y() * std::sin(section.theta);
    (is_inner(point.surface) ? record.inner_point_r : record.outer_point_r)
        .push_back(std::copysign(std::hypot(x.x(), x.y()), side));
    (is_inner(point.surface) ? record.inner_point_z : record.outer_point_z).push_back(x.z());
  }
  return record;
}

}  // namespace

VentricleRecord ventricle_record(const VentricleSession& session, const GuidePoints& guide) {
  const VentricleFit& fit = session.fit;
  VentricleRecord record;
  record.source = guide.file;
  record.phase = session.phases[session.chosen].phase;
  record.noise_factor = fit.noise_factor;
  record.rms_mm = fit.rms_mm;
  record.ejection = session.ejection_fraction();
  record.ejection_sigma = session.ejection_sigma();
  record.findings = fit.findings;
  for (size_t p = 0; p < session.phases.size(); ++p) {
    const VentriclePhase& phase = session.phases[p];
    record.phases.push_back({phase.phase, phase.mesh.cavity_mL, phase.cavity_sigma_mL, phase.mesh.wall_mL,
                             phase.mean_thickness_mm, phase.least_thickness_mm, phase.most_thickness_mm,
                             fit.phases[p].rms_mm});
  }
  for (const SliceShift& shift : fit.shifts)
    record.slices.push_back({shift.slice, shift.is_reference, shift.shift_mm.norm(), shift.sigma_mm});
  for (const Section& section : sections_of(fit, guide))
    record.sections.push_back(drawn(section, session, guide));
  return record;
}

}  // namespace diastole::imaging
