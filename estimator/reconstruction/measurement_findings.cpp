#include "estimator/reconstruction/measurement_findings.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <array>
#include <cmath>
#include <map>
#include <optional>

#include "estimator/mesh/point_locator.hpp"
#include "estimator/motion_residuals/tag_match.hpp"
#include "estimator/reconstruction/frame_field.hpp"
#include "protocol/signal/median.hpp"
#include "protocol/signal/quantile.hpp"

namespace diastole {
namespace {

using Eigen::Vector3d;
using Findings = std::vector<Finding>;

constexpr size_t least_rows = 30;  // fewer say nothing about a spread

struct Body {
  Vector3d centre_mm = Vector3d::Zero();
  double reach_mm = 0.0;  ///< of the farthest node
};

Body body_of(const HermiteMesh& mesh) {
  Body body;
  const auto place = [&](size_t node) {
    return Vector3d(Eigen::Map<const Vector3d>(&mesh.reference()[dof_of(node, 0, 0)]));
  };
  for (size_t node = 0; node < mesh.node_count(); ++node)
    body.centre_mm += place(node) / static_cast<double>(mesh.node_count());
  for (size_t node = 0; node < mesh.node_count(); ++node)
    body.reach_mm = std::max(body.reach_mm, (place(node) - body.centre_mm).norm());
  return body;
}

struct LengthUnit {
  const char* name;
  double in_mm;
};
constexpr std::array<LengthUnit, 4> length_units{
    {{"metres", 1000.0}, {"centimetres", 10.0}, {"inches", 25.4}, {"micrometres", 0.001}}};

/// Coordinates that reach far less or far more than the body.
void check_lengths(Findings& findings, const std::vector<Vector3d>& places, const Body& body,
                   const char* columns) {
  if (places.empty()) return;
  // About the origin as well as about the centre: a wrong unit moves the points away from the body's centre.
  std::vector<double> distances;
  for (const Vector3d& place : places)
    distances.push_back(place.norm());
  const double reach_mm = signal::quantile(std::move(distances), 0.98);
  const double expected_mm = body.reach_mm + body.centre_mm.norm();
  const double ratio = reach_mm / expected_mm;
  if (ratio > 0.4 && ratio < 2.5) return;
  Finding finding{Severity::error,
                  "length-unit",
                  fmt::format("The points reach {:.3g} mm from the origin, but the specimen {:.3g} mm",
                              reach_mm, expected_mm),
                  columns,
                  ratio,
                  "",
                  "Give coordinates in mm, in the specimen's axes."};
  const auto off = [&](const LengthUnit& unit) { return std::abs(std::log(ratio * unit.in_mm)); };
  const LengthUnit& best = *std::ranges::min_element(length_units, {}, off);
  if (off(best) < std::log(1.9)) {
    finding.what += fmt::format(": they seem to be in {}.", best.name);
    finding.remedy = fmt::format("Multiply these columns by {:g}.", best.in_mm);
  } else {
    finding.what += ".";
  }
  findings.push_back(finding);
}

double off_plane_mm(const TagPoint& tag) {
  return vector_of(tag.normal).dot(vector_of(tag.x_mm)) - tag.plane_mm;
}

/// At rest a tag point lies on its own plane, within its sigma.
void check_rest(Findings& findings, const Measurement& measurement, const Body& body) {
  std::vector<double> off_mm, in_sigmas;
  for (const TagPoint& tag : measurement.tags) {
    if (tag.frame != 0) continue;
    off_mm.push_back(off_plane_mm(tag));
    in_sigmas.push_back(off_mm.back() / tag.sigma_mm);
  }
  for (const ObservedPoint& point : measurement.points) {
    if (point.frame != 0) continue;
    for (size_t k = 0; k < 3; ++k) {
      off_mm.push_back(point.x_mm[k] - point.X_mm[k]);
      in_sigmas.push_back(off_mm.back() / point.sigma_mm);
    }
  }
  if (off_mm.size() < least_rows) return;
  const double spread_mm = robust_spread(off_mm), spread = robust_spread(in_sigmas);
  if (spread_mm > 0.05 * body.reach_mm && spread > 3) {
    findings.push_back(
        {Severity::error, "tag-planes",
         fmt::format("At rest (frame 0) the tag points lie {:.3g} mm off their own planes.", spread_mm),
         "column plane_mm, frame 0", spread_mm, "mm",
         "Give plane_mm in mm for the row's own normal, n·X of the undeformed stripe."});
  } else if (spread > 1.5 || spread < 0.67) {
    findings.push_back(
        {Severity::warning, "sigma",
         fmt::format("At rest (frame 0) the points scatter by {:.2g} of their sigma_mm.", spread),
         "column sigma_mm, frame 0", spread, "", fmt::format("Multiply sigma_mm by {:.2g}.", spread)});
  }
}

void check_sigma_range(Findings& findings, const Measurement& measurement, const Body& body) {
  double least = 1e300, most = 0.0;
  const auto look = [&](const auto& rows) {
    for (const auto& row : rows) {
      least = std::min(least, row.sigma_mm);
      most = std::max(most, row.sigma_mm);
    }
  };
  look(measurement.tags);
  look(measurement.points);
  if (most == 0.0) return;
  // Own errors are as different as the pixels that the points have.
  if (most > 100.0 * least && !measurement.planes_as_seen) {
    findings.push_back({Severity::warning, "sigma-range",
                        fmt::format("sigma_mm goes from {:.3g} to {:.3g} mm: the sharpest points count "
                                    "{:.0f} times as much as the dullest.",
                                    least, most, (most / least) * (most / least)),
                        "column sigma_mm", most / least, "", "Check the smallest and the largest values."});
  }
  if (least < 1e-3 || most > 0.2 * body.reach_mm) {
    const double value = least < 1e-3 ? least : most;
    findings.push_back({Severity::warning, "sigma-range",
                        fmt::format("A sigma_mm of {:.3g} mm is no measurement error of images.", value),
                        "column sigma_mm", value, "mm", "Give each point's standard deviation in mm."});
  }
}

/// Rows that are there twice, and frames that repeat another frame's rows.
void check_duplicates(Findings& findings, const Measurement& measurement) {
  using Key = std::array<double, 7>;
  std::map<Key, std::vector<int>> frames_of;
  for (const TagPoint& t : measurement.tags)
    frames_of[{t.normal[0], t.normal[1], t.normal[2], t.plane_mm, t.x_mm[0], t.x_mm[1], t.x_mm[2]}].push_back(
        t.frame);
  for (const ObservedPoint& p : measurement.points)
    frames_of[{p.X_mm[0], p.X_mm[1], p.X_mm[2], p.x_mm[0], p.x_mm[1], p.x_mm[2], 0.0}].push_back(p.frame);
  size_t twice = 0;
  std::map<int, size_t> repeated, rows;
  for (auto& [key, frames] : frames_of) {
    std::sort(frames.begin(), frames.end());
    const auto end = std::unique(frames.begin(), frames.end());
    twice += static_cast<size_t>(frames.end() - end);
    for (auto frame = frames.begin(); frame != end; ++frame) {
      ++rows[*frame];
      if (frame != frames.begin()) ++repeated[*frame];
    }
  }
  const size_t all = measurement.tags.size() + measurement.points.size();
  if (twice > 0) {
    findings.push_back({Severity::warning, "duplicate-rows",
                        fmt::format("{} of {} rows are there twice: they would count double.", twice, all),
                        measurement.tags.empty() ? "points file" : "tags file", static_cast<double>(twice),
                        "rows", "Remove the repeated rows."});
  }
  if (const size_t once = measurement.repeated_rows; once > 0) {
    findings.push_back(
        {Severity::warning, "duplicate-rows",
         fmt::format("{} of {} rows repeat another to the last digit: each counts once.", once, all + once),
         measurement.tags.empty() ? "points file" : "tags file", static_cast<double>(once), "rows",
         "Remove the repeated rows."});
  }
  for (const auto& [frame, count] : repeated) {
    if (static_cast<double>(count) < 0.1 * static_cast<double>(rows[frame])) continue;
    findings.push_back(
        {Severity::error, "repeated-frame",
         fmt::format("{} of {} rows of frame {} are those of an earlier frame, to the last digit.", count,
                     rows[frame], frame),
         fmt::format("frame {}", frame), static_cast<double>(count), "rows",
         "Export the frame's own points again."});
  }
}

/// "1, 2 and 5".
std::string list_words(const std::vector<int>& numbers) {
  std::string words;
  for (size_t i = 0; i < numbers.size(); ++i)
    words += fmt::format("{}{}", i == 0 ? "" : i + 1 == numbers.size() ? " and " : ", ", numbers[i]);
  return words;
}

std::vector<size_t> rows_of_frames(const Measurement& measurement) {
  std::vector<size_t> rows(measurement.frames.size(), 0);
  for (const TagPoint& tag : measurement.tags)
    ++rows[static_cast<size_t>(tag.frame)];
  for (const ObservedPoint& point : measurement.points)
    ++rows[static_cast<size_t>(point.frame)];
  return rows;
}

void check_frames(Findings& findings, const Measurement& measurement) {
  const std::vector<size_t> rows = rows_of_frames(measurement);
  std::vector<size_t> loaded(rows.begin() + 1, rows.end());
  if (loaded.empty()) return;
  const size_t usual = signal::median(std::move(loaded));
  std::vector<int> missing, sparse;
  for (size_t frame = 1; frame < rows.size(); ++frame) {
    if (rows[frame] == 0)
      missing.push_back(static_cast<int>(frame));
    else if (4 * rows[frame] < usual)
      sparse.push_back(static_cast<int>(frame));
  }
  const auto report = [&](const std::vector<int>& frames, const char* id, const char* one, const char* many,
                          const char* remedy) {
    if (frames.empty()) return;
    findings.push_back({Severity::warning, id,
                        fmt::format("Frame{} {} {}.", frames.size() == 1 ? "" : "s", list_words(frames),
                                    frames.size() == 1 ? one : many),
                        "column frame", static_cast<double>(frames.size()), "frames", remedy});
  };
  report(missing, "missing-frames", "of the frames file has no points", "of the frames file have no points",
         "Track those frames too, or remove their rows from the frames file and number the others anew.");
  report(sparse, "sparse-frames", "has less than a quarter of the points of the others",
         "have less than a quarter of the points of the others",
         "Check that all slices of these frames were tracked and exported.");
}

void check_pressures(Findings& findings, const std::vector<Frame>& frames) {
  double largest_kPa = 0.0;
  for (const Frame& frame : frames)
    largest_kPa = std::max(largest_kPa, std::abs(frame.pressure_kPa));
  const auto certain_kPa = [&](const Frame& frame, double share) {
    return std::max(4.0 * frame.sigma_kPa, share * largest_kPa);
  };
  const Frame& rest = frames.front();
  if (std::abs(rest.pressure_kPa) > certain_kPa(rest, 0.02)) {
    findings.push_back(
        {Severity::warning, "pressure-at-rest",
         fmt::format("The undeformed frame 0 has a pressure of {:.3g} kPa.", rest.pressure_kPa),
         "column pressure_kPa, frame 0", rest.pressure_kPa, "kPa",
         "If the transducer has an offset subtract it from every frame; else take the unloaded frame as "
         "frame 0."});
  }
  std::vector<int> unloaded, negative;
  for (size_t frame = 1; frame < frames.size(); ++frame) {
    const double pressure_kPa = frames[frame].pressure_kPa;
    if (std::abs(pressure_kPa) <= certain_kPa(frames[frame], 0.01))
      unloaded.push_back(static_cast<int>(frame));
    else if (pressure_kPa < 0)
      negative.push_back(static_cast<int>(frame));
  }
  if (!unloaded.empty()) {
    const bool all = unloaded.size() + 1 == frames.size();
    findings.push_back(
        {all ? Severity::error : Severity::warning, "unloaded-frames",
         fmt::format("Frame{} {} carr{} no load: no stiffness shows there.", unloaded.size() == 1 ? "" : "s",
                     list_words(unloaded), unloaded.size() == 1 ? "ies" : "y"),
         "column pressure_kPa", static_cast<double>(unloaded.size()), "frames",
         "Leave such frames out, or check that the pressures belong to these frames."});
  }
  if (!negative.empty()) {
    findings.push_back({Severity::warning, "negative-pressure",
                        fmt::format("The pressure is below that of the outside in frame{} {}.",
                                    negative.size() == 1 ? "" : "s", list_words(negative)),
                        "column pressure_kPa", static_cast<double>(negative.size()), "frames",
                        "Give the cavity's pressure above the outside, positive when it inflates."});
  }
}

/// How far a place lies outside the undeformed body, at most; nothing when it is far away.
std::optional<double> outside_mm(const HermiteMesh& mesh, const PointLocator& locator,
                                 const Vector3d& place) {
  const auto found = locator.find(place);
  if (!found) return {};
  if (found->overshoot_xi == 0.0) return 0.0;
  MaterialPoint nearest = found->point;
  for (double& xi : nearest.xi)
    xi = std::clamp(xi, 0.0, 1.0);
  return (mesh.value(mesh.reference(), nearest) - place).norm();
}

/// Undeformed places beyond the wall, more than noise can bring there.
void check_wall(Findings& findings, const Measurement& measurement, const HermiteMesh& mesh) {
  constexpr double slack_mm = 0.5, sigmas = 5.0, tolerated = 0.005;
  const PointLocator locator(mesh, mesh.reference(), {.outside_xi = 0.5});
  size_t looked = 0, outside = 0;
  double farthest_mm = 0.0;
  const auto look = [&](const Vector3d& place, double sigma_mm) {
    ++looked;
    const auto distance_mm = outside_mm(mesh, locator, place);
    if (distance_mm && *distance_mm <= sigmas * sigma_mm + slack_mm) return;
    ++outside;
    if (distance_mm) farthest_mm = std::max(farthest_mm, *distance_mm);
  };
  for (const TagPoint& tag : measurement.tags) {
    if (tag.frame == 0) look(vector_of(tag.x_mm), tag.sigma_mm);
  }
  int first_frame = 1'000'000;
  for (const ObservedPoint& point : measurement.points)
    first_frame = std::min(first_frame, point.frame);
  for (const ObservedPoint& point : measurement.points) {
    if (point.frame == first_frame) look(vector_of(point.X_mm), 0.0);
  }
  if (static_cast<double>(outside) <= std::max(2.0, tolerated * static_cast<double>(looked))) return;
  findings.push_back({2 * outside > looked ? Severity::error : Severity::warning, "outside-wall",
                      fmt::format("{} of {} undeformed points lie outside the specimen's wall, by more than "
                                  "{:.1f} mm and {:g} sigma.",
                                  outside, looked, slack_mm, sigmas),
                      "frame 0", static_cast<double>(outside), "points",
                      "Check the specimen's radii and height, the origin of the coordinates, and that only "
                      "tissue was tracked."});
}

}  // namespace

std::vector<Finding> measurement_findings(const Measurement& measurement, const HermiteMesh& mesh) {
  Findings findings;
  const Body body = body_of(mesh);
  std::vector<Vector3d> seen, undeformed;
  for (const TagPoint& tag : measurement.tags)
    seen.push_back(vector_of(tag.x_mm));
  for (const ObservedPoint& point : measurement.points) {
    seen.push_back(vector_of(point.x_mm));
    undeformed.push_back(vector_of(point.X_mm));
  }
  check_lengths(findings, seen, body, "columns x_mm, y_mm, z_mm");
  check_lengths(findings, undeformed, body, "columns X_mm, Y_mm, Z_mm");
  check_frames(findings, measurement);
  check_pressures(findings, measurement.frames);
  check_duplicates(findings, measurement);
  check_sigma_range(findings, measurement, body);
  if (has_error(findings)) return findings;  // nothing else means anything then
  check_rest(findings, measurement, body);
  check_wall(findings, measurement, mesh);
  return findings;
}

}  // namespace diastole
