#include "estimator/reconstruction/motion_findings.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <limits>

#include "estimator/inference/covariance.hpp"

namespace diastole {
namespace {

using Findings = std::vector<Finding>;

constexpr double certain = 5.0;  // standard errors

double largest_pressure(const std::vector<FrameField>& fields) {
  double largest_kPa = 0.0;
  for (const FrameField& field : fields)
    largest_kPa = std::max(largest_kPa, std::abs(field.load.pressure_kPa));
  return largest_kPa;
}

std::string frame_words(const FrameField& field) { return fmt::format("frame {}", field.number); }

void check_points(Findings& findings, const std::vector<FrameField>& fields) {
  size_t rows = 0, rejected = 0, not_found = 0;
  for (const FrameField& field : fields) {
    rows += field.rows.size();
    rejected += field.rows.size() - field.used();
    not_found += field.tags_not_found.size() + field.points_not_found.size();
  }
  const double all = static_cast<double>(rows + not_found);
  const auto share = [&](size_t count) { return 100.0 * static_cast<double>(count) / all; };
  if (static_cast<double>(rejected) > std::max(2.0, 0.0005 * all)) {
    findings.push_back(
        {share(rejected) > 25 ? Severity::error : Severity::warning, "wild-points",
         fmt::format("{} of {} measured numbers ({:.2g} %) lie more than five times their spread away from "
                     "the motion of the others; they were left out.",
                     rejected, rows + not_found, share(rejected)),
         "rows marked as wild in the report's map", share(rejected), "%",
         "Look at those points in the images: a stripe may have been taken for its neighbour."});
  }
  if (static_cast<double>(not_found) > std::max(2.0, 0.005 * all)) {
    findings.push_back(
        {share(not_found) > 25 ? Severity::error : Severity::warning, "not-found",
         fmt::format("{} of {} points ({:.2g} %) lie outside the moved specimen's wall; they were left out.",
                     not_found, rows + not_found, share(not_found)),
         "loaded frames", share(not_found), "%",
         "Check the specimen's size and axes, and that only tissue was tracked."});
  }
}

void check_sigma(Findings& findings, const std::vector<FrameField>& fields) {
  double squares = 0.0, rows = 0.0;
  for (const FrameField& field : fields) {
    const auto count = static_cast<double>(field.rows.size());
    squares += count * field.scale * field.scale;
    rows += count;
  }
  const double scale = std::sqrt(squares / std::max(rows, 1.0));
  if (scale > 0.75 && scale < 1.33) return;
  findings.push_back(
      {scale > 1 ? Severity::warning : Severity::note, "sigma",
       fmt::format("The points scatter about the smooth motion by {:.2g} of their sigma_mm.", scale),
       "column sigma_mm, loaded frames", scale, "",
       fmt::format("Multiply sigma_mm by {:.2g}, or find what makes the points {}.", scale,
                   scale > 1 ? "so much worse" : "seem so good")});
}

void check_families(Findings& findings, const MotionEvidence& evidence) {
  double chi2 = 0.0, freedom = 0.0;
  for (const FamilyFit& fit : evidence.families) {
    if (fit.frame >= 0) continue;
    chi2 += fit.chi2;
    freedom += fit.freedom;
  }
  const double usual = chi2 / std::max(freedom, 1.0);
  for (const FamilyFit& fit : evidence.families) {
    if (fit.frame >= 0 || fit.freedom < 30) continue;
    const double ratio = fit.chi2 / fit.freedom / usual;
    if (ratio < 1.3 || (ratio - 1.0) < certain * std::sqrt(2.0 / fit.freedom)) continue;
    const std::string direction = direction_words(evidence.groups.families[fit.family].normal);
    findings.push_back(
        {Severity::warning, "tag-family",
         fmt::format("Tags along {} fit {:.2g} times worse than the others (chi² per degree of freedom).",
                     direction, ratio),
         "tags along " + direction, ratio, "",
         "Check these images' tracking, or state a larger sigma_mm for them."});
  }
}

void check_slices(Findings& findings, const MotionEvidence& evidence) {
  for (const SliceOffset& slice : evidence.slices) {
    if (!slice.displaced) continue;
    const std::string words = slice_words(evidence.groups, evidence.groups.slices[slice.slice]);
    findings.push_back(
        {Severity::warning, "slice-offset",
         fmt::format("All {} are off by {:+.2f} ± {:.2f} mm along their normal: the slice is misplaced.",
                     words, slice.offset_mm, slice.se_mm),
         words, slice.offset_mm, "mm", "Register this slice against the others, or leave it out."});
  }
}

/// A body that has gone elsewhere, by what its points see of it: the frame's axes have another origin.
void check_size(Findings& findings, const MotionEvidence& evidence) {
  constexpr double plausible = 0.2;  // of the body's extent, RMS
  const HermiteMesh& mesh = evidence.forms->space.mesh();
  for (const FrameField& field : evidence.fields) {
    double squares = 0.0;
    for (const FieldRow& row : field.rows)
      squares += std::pow(row.normal.dot(mesh.value(field.displacement_mm, row.point)), 2);
    // A direction sees a third of a motion's square, on average.
    const double rms_mm =
        std::sqrt(3.0 * squares / static_cast<double>(std::max<size_t>(field.rows.size(), 1)));
    if (rms_mm < plausible * mesh.extent_mm()) continue;
    findings.push_back(
        {Severity::error, "far-motion",
         fmt::format("The body of frame {} seems to have moved by {:.3g} mm RMS.", field.number, rms_mm),
         frame_words(field), rms_mm, "mm",
         "Give all frames in the same axes, and tag planes that belong to the row's own stripe."});
  }
}

/// Whether pressures and motions agree, frame by frame.
bool check_load_order(Findings& findings, const MotionEvidence& evidence) {
  const size_t before = findings.size();
  const double largest_kPa = largest_pressure(evidence.fields);
  for (size_t i = 0; i < evidence.fields.size(); ++i) {
    const FrameField& field = evidence.fields[i];
    const MotionAmplitude& amplitude = evidence.amplitudes[i];
    const double share = field.load.pressure_kPa / largest_kPa;
    const double share_se = std::max(field.load.sigma_kPa / largest_kPa, 0.01);
    if (share > std::max(certain * share_se, 0.1) && amplitude.value + certain * amplitude.se < 0.2 * share) {
      findings.push_back({Severity::error, "no-motion",
                          fmt::format("The points of frame {} have not moved ({:.2g} of the most loaded "
                                      "frame's motion), although its pressure is {:.3g} kPa.",
                                      field.number, amplitude.value, field.load.pressure_kPa),
                          frame_words(field), amplitude.value, "",
                          "Check which frame these points belong to."});
    } else if (share < certain * share_se && amplitude.value > std::max(0.15, certain * amplitude.se)) {
      findings.push_back({Severity::error, "motion-without-load",
                          fmt::format("The points of frame {} have moved ({:.2g} of the most loaded frame's "
                                      "motion) without pressure ({:.3g} kPa).",
                                      field.number, amplitude.value, field.load.pressure_kPa),
                          frame_words(field), amplitude.value, "",
                          "Check which pressure belongs to this frame."});
    }
  }
  if (findings.size() > before) return false;
  for (size_t i = 0; i < evidence.fields.size(); ++i) {
    for (size_t j = 0; j < evidence.fields.size(); ++j) {
      const Frame &low = evidence.fields[i].load, &high = evidence.fields[j].load;
      const MotionAmplitude &less = evidence.amplitudes[i], &more = evidence.amplitudes[j];
      const double sigma_kPa = std::max(std::hypot(low.sigma_kPa, high.sigma_kPa), 0.005 * largest_kPa);
      if (high.pressure_kPa - low.pressure_kPa < certain * sigma_kPa) continue;
      if (less.value - more.value < std::max(0.03, certain * std::hypot(less.se, more.se))) continue;
      findings.push_back(
          {Severity::error, "frames-disagree",
           fmt::format("Frame {} has more pressure than frame {} ({:.3g} against {:.3g} kPa) but moved less "
                       "({:.2g} against {:.2g} of the most loaded frame's motion).",
                       evidence.fields[j].number, evidence.fields[i].number, high.pressure_kPa,
                       low.pressure_kPa, more.value, less.value),
           "column frame of both files", high.pressure_kPa - low.pressure_kPa, "kPa",
           "Give both files the same frame numbers."});
      return false;
    }
  }
  return true;
}

/// Pressure at which the motion would vanish, extrapolated from the frames by a parabola p(amplitude). Needs four
/// frames; the standard error is infinite with fewer, or where their amplitudes do not determine it. Tag planes that are wrong shift all amplitudes, as an offset of the pressure does; those of all
/// images are taken to be wrong alike, as they are where the first image shows the body already moved.
struct PressureAtNoMotion {
  double value_kPa = 0.0;
  double se_kPa = 0.0;
};

PressureAtNoMotion pressure_at_no_motion(const std::vector<FrameField>& fields,
                                         const std::vector<MotionAmplitude>& amplitudes) {
  constexpr Eigen::Index terms = 3;
  const auto rows = static_cast<Eigen::Index>(fields.size());
  if (rows <= terms) return {0.0, std::numeric_limits<double>::infinity()};
  const double largest_kPa = largest_pressure(fields);
  Eigen::MatrixXd A(rows, terms);
  Eigen::VectorXd b(rows);
  for (Eigen::Index i = 0; i < rows; ++i) {
    const Frame& load = fields[static_cast<size_t>(i)].load;
    const MotionAmplitude& amplitude = amplitudes[static_cast<size_t>(i)];
    // Half a hundredth of the largest pressure: what the parabola itself may be off.
    const double sigma_kPa = std::hypot(load.sigma_kPa, amplitude.se * largest_kPa) + 0.005 * largest_kPa;
    A.row(i) = Eigen::RowVector3d(1.0, amplitude.value, amplitude.value * amplitude.value) / sigma_kPa;
    b[i] = load.pressure_kPa / sigma_kPa;
  }
  const auto [covariance, undetermined] = inference::estimate_covariance(A);
  if (!undetermined.empty()) return {0.0, std::numeric_limits<double>::infinity()};
  const Eigen::Vector3d coefficients = covariance * (A.transpose() * b);
  const Eigen::RowVectorXd weights = covariance.row(0) * A.transpose();
  Eigen::VectorXd by_planes = Eigen::VectorXd::Zero(amplitudes.front().by_planes.size());
  for (Eigen::Index i = 0; i < rows; ++i) {
    const MotionAmplitude& amplitude = amplitudes[static_cast<size_t>(i)];
    const double slope_kPa = coefficients[1] + 2.0 * coefficients[2] * amplitude.value;
    by_planes += weights[i] * A(i, 0) * slope_kPa * amplitude.by_planes;
  }
  return {coefficients[0], std::sqrt(covariance(0, 0) + std::pow(by_planes.lpNorm<1>(), 2))};
}

void check_pressure_offset(Findings& findings, const MotionEvidence& evidence) {
  const PressureAtNoMotion rest = pressure_at_no_motion(evidence.fields, evidence.amplitudes);
  const double largest_kPa = largest_pressure(evidence.fields);
  constexpr double significant = 4.0;  // one test, not one a slice
  if (!(std::abs(rest.value_kPa) >= std::max(significant * rest.se_kPa, 0.06 * largest_kPa))) return;
  findings.push_back(
      {Severity::warning, "pressure-offset",
       fmt::format("The motion vanishes at {:+.3g} ± {:.2g} kPa and not at 0.", rest.value_kPa, rest.se_kPa),
       "column pressure_kPa, loaded frames", rest.value_kPa, "kPa",
       fmt::format("If the transducer has an offset subtract {:.3g} kPa from the loaded frames, or let the "
                   "fit find it: `diastole fit --pressure-offset {:.1g}`; if the two files number their "
                   "frames differently, number them alike.",
                   rest.value_kPa, std::abs(rest.value_kPa))});
}

void check_volumes(Findings& findings, const MotionEvidence& evidence) {
  constexpr double least_change = 0.01;  // less no mesh of a few elements keeps
  for (size_t i = 0; i < evidence.volumes.size(); ++i) {
    const VolumeCheck& volume = evidence.volumes[i];
    const double change = volume.mean_ratio - 1.0;
    if (std::abs(change) < std::max(certain * volume.se, least_change)) continue;
    findings.push_back(
        {Severity::warning, "volume",
         fmt::format("The body's volume seems to change by {:+.2f} ± {:.2f} %.", 100 * change,
                     100 * volume.se),
         frame_words(evidence.fields[i]), 100 * change, "%",
         "Check the images' scale (mm a pixel) along each axis; tissue may also gain or lose fluid."});
  }
}

void check_coverage(Findings& findings, const Coverage& coverage) {
  constexpr double unseen_mm = 1.0, mainly = 0.8;
  size_t unseen = 0;
  Eigen::Vector3d along = Eigen::Vector3d::Zero();
  for (const AffineMode& mode : coverage.affine_modes) {
    if (mode.se_mm < unseen_mm) continue;
    ++unseen;
    along += mode.along;
  }
  if (unseen == 0) return;
  Eigen::Index axis = 0;
  const bool one_axis = along.maxCoeff(&axis) > mainly * along.sum();
  const std::string direction =
      one_axis ? fmt::format("motion along {}", "xyz"[axis]) : coverage.affine_modes.front().words;
  findings.push_back({Severity::warning, "unseen-motion",
                      fmt::format("{} of the twelve shifts, turns, stretches and shears of the body are not "
                                  "seen to {:g} mm; what is missed is {}.",
                                  unseen, unseen_mm, direction),
                      "most loaded frame", static_cast<double>(unseen), "motions",
                      "Add images whose tags have a normal along it; until then smoothness decides it."});
}

void check_method(Findings& findings, const std::vector<FrameField>& fields) {
  for (const FrameField& field : fields) {
    if (!field.converged) {
      findings.push_back({Severity::warning, "not-settled",
                          fmt::format("The field of frame {} had not come to rest after {} rounds.",
                                      field.number, field.rounds),
                          frame_words(field), static_cast<double>(field.rounds), "rounds",
                          "Look at the frame's residuals; a larger --lambda steadies it."});
    }
    if (field.smoothing.at_edge) {
      findings.push_back(
          {Severity::note, "smoothing-edge",
           fmt::format("Cross-validation wants a smoothing weight beyond those tried ({:.1g}).",
                       field.smoothing.lambda),
           frame_words(field), field.smoothing.lambda, "",
           "The frame has too few points, or hardly any motion, to say how rough it is."});
    }
  }
}

}  // namespace

std::vector<MotionAmplitude> motion_amplitudes(const FieldForms& forms, const std::vector<FrameField>& fields,
                                               const TagPlanes& planes) {
  std::vector<MotionAmplitude> amplitudes;
  const FrameField& most = most_loaded(fields);
  const Eigen::VectorXd whole_motion = forms.space.unknowns_of(most.displacement_mm);
  for (const FrameField& field : fields) {
    const auto& rows = field.system->weighted_rows();
    Eigen::VectorXd seen = rows * forms.space.unknowns_of(field.displacement_mm);
    for (size_t i = 0; i < field.rows.size(); ++i)
      seen[static_cast<Eigen::Index>(i)] += field.rows[i].rejected ? 0.0 : field.rows[i].residual;
    const Eigen::VectorXd expected = rows * whole_motion;
    const double information = std::max(expected.squaredNorm(), 1e-12);
    Eigen::VectorXd by_planes = Eigen::VectorXd::Zero(planes.unknowns());
    for (size_t i = 0; planes.unknowns() > 0 && i < field.rows.size(); ++i) {
      const FieldRow& row = field.rows[i];
      if (!row.of_tag) continue;
      by_planes.segment<TagPlanes::of_a_set>(planes.first_unknown(row.source)) +=
          TagPlanes::loose_mm * expected[static_cast<Eigen::Index>(i)] / (row.sigma_mm * information) *
          planes.derivatives(row.source);
    }
    amplitudes.push_back({expected.dot(seen) / information,
                          std::max(field.scale, 1.0) / std::sqrt(information), std::move(by_planes)});
  }
  const double whole = amplitudes[static_cast<size_t>(&most - fields.data())].value;
  if (!(whole > 0.0)) return amplitudes;
  for (MotionAmplitude& amplitude : amplitudes)
    amplitude = {amplitude.value / whole, amplitude.se / whole, amplitude.by_planes / whole};
  return amplitudes;
}

std::vector<FamilyFit> family_fits(const std::vector<FrameField>& fields, const TagGroups& groups,
                                   size_t tags) {
  std::vector<int> family_of(tags, -1);
  for (size_t f = 0; f < groups.families.size(); ++f) {
    for (const size_t i : groups.families[f].tags)
      family_of[i] = static_cast<int>(f);
  }
  const size_t count = groups.families.size();
  std::vector<FamilyFit> together, single;
  for (size_t f = 0; f < count; ++f)
    together.push_back({f, -1, 0, 0.0, 0.0});
  for (const FrameField& field : fields) {
    const size_t first = single.size();
    for (size_t f = 0; f < count; ++f)
      single.push_back({f, field.number, 0, 0.0, 0.0});
    for (size_t i = 0; i < field.rows.size(); ++i) {
      const FieldRow& row = field.rows[i];
      if (!row.of_tag || row.rejected || family_of[row.source] < 0) continue;
      FamilyFit& fit = single[first + static_cast<size_t>(family_of[row.source])];
      ++fit.rows;
      fit.chi2 += row.residual * row.residual;
      fit.freedom += field.residual_shares[static_cast<Eigen::Index>(i)];
    }
    for (size_t f = 0; f < count; ++f) {
      together[f].rows += single[first + f].rows;
      together[f].chi2 += single[first + f].chi2;
      together[f].freedom += single[first + f].freedom;
    }
  }
  together.insert(together.end(), single.begin(), single.end());
  return together;
}

std::vector<Finding> motion_findings(const MotionEvidence& evidence) {
  Findings findings;
  check_points(findings, evidence.fields);
  check_sigma(findings, evidence.fields);
  check_families(findings, evidence);
  check_slices(findings, evidence);
  check_size(findings, evidence);
  if (check_load_order(findings, evidence)) check_pressure_offset(findings, evidence);
  check_volumes(findings, evidence);
  check_coverage(findings, evidence.coverage);
  check_method(findings, evidence.fields);
  return findings;
}

}  // namespace diastole
