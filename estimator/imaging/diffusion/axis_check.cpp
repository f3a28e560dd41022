#include "estimator/imaging/diffusion/axis_check.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <array>
#include <cmath>
#include <utility>

#include "estimator/imaging/diffusion/gradient_turn.hpp"
#include "estimator/imaging/diffusion/wall_agreement.hpp"
#include "protocol/contract/angle.hpp"

namespace diastole::imaging {
namespace {

/// A table is contradicted where its agreement is below this part of the best one's. On seven labelled ventricles right tables agree by 0.39 to
/// 0.85, one with x reversed by 0.10 where the right one has 0.63; what 50 % more or less would do is not measured.
constexpr double contradicted_share = 0.75;
/// Below, the voxels' anisotropy is noise, which agrees by about one over the voxels at a depth.
constexpr double least_agreement = 0.05;
/// Candidates nearer than this to the best are distinguished by the helix's hand alone.
constexpr double alike_share = 0.93;
/// Agreement over the part of deviators that is not noise: 0.85 to 0.98 of the right tables of nine labelled ventricles, 0.54 or less of the
/// best candidates where none was right. Halfway.
constexpr double doubtful_share = 0.7;

std::string name_of(const Eigen::Matrix3d& change, const std::array<const char*, 3>& axes) {
  std::string text;
  std::array<int, 3> from{};
  std::array<bool, 3> reversed{};
  for (int i = 0; i < 3; ++i) {
    Eigen::Index column = 0;
    change.row(i).cwiseAbs().maxCoeff(&column);
    from[static_cast<size_t>(i)] = static_cast<int>(column);
    reversed[static_cast<size_t>(i)] = change(i, column) < 0;
  }
  if (from == std::array{0, 1, 2}) {
    for (size_t i = 0; i < 3; ++i)
      if (reversed[i]) return fmt::format("{} reversed", axes[i]);
    return "as the headers say";
  }
  for (size_t i = 0; i < 3; ++i)
    text += fmt::format("{}{} = {}{}", text.empty() ? "" : ", ", axes[i], reversed[i] ? "-" : "",
                        axes[static_cast<size_t>(from[i])]);
  return text;
}

/// 6 permutations by 4 signs: none, or one axis reversed.
std::vector<AxisCandidate> signed_permutations(const Eigen::Matrix3d& frame,
                                               const std::array<const char*, 3>& axes) {
  std::vector<AxisCandidate> all;
  std::array<int, 3> order{0, 1, 2};
  do {
    for (int flipped = -1; flipped < 3; ++flipped) {
      Eigen::Matrix3d local = Eigen::Matrix3d::Zero();
      for (int i = 0; i < 3; ++i)
        local(i, order[static_cast<size_t>(i)]) = i == flipped ? -1 : 1;
      AxisCandidate candidate;
      candidate.change = frame * local * frame.transpose();
      candidate.name = name_of(local, axes);
      all.push_back(candidate);
    }
  } while (std::next_permutation(order.begin(), order.end()));
  return all;
}

/// The table's numbers along the axes of `frame` and not along those that they were read along.
std::vector<AxisCandidate> read_along(const Eigen::Matrix3d& frame, const Eigen::Matrix3d& table_axes,
                                      const std::array<const char*, 4>& names) {
  std::vector<AxisCandidate> all;
  for (int flipped = -1; flipped < 3; ++flipped) {
    Eigen::Vector3d signs = Eigen::Vector3d::Ones();
    if (flipped >= 0) signs[flipped] = -1;
    AxisCandidate candidate;
    candidate.change = frame * signs.asDiagonal() * table_axes.transpose();
    candidate.name = names[static_cast<size_t>(flipped + 1)];
    all.push_back(candidate);
  }
  return all;
}

/// Those that no tensor distinguishes from one that is there, half a turn about an axis or a few degrees from it, are left out.
void add_others(std::vector<AxisCandidate>& candidates, const std::vector<AxisCandidate>& others) {
  for (const AxisCandidate& other : others) {
    const bool known = std::any_of(candidates.begin(), candidates.end(), [&](const auto& candidate) {
      return std::min((candidate.change - other.change).norm(), (candidate.change + other.change).norm()) <
             0.1;
    });
    if (!known) candidates.push_back(other);
  }
}

std::vector<AxisCandidate> candidates_of(const TableFrames& frames) {
  const Eigen::Matrix3d patient = Eigen::Matrix3d::Identity();
  std::vector<AxisCandidate> all = signed_permutations(patient, {"x", "y", "z"});
  add_others(all, signed_permutations(frames.image_axes, {"rows", "columns", "normal"}));
  // A common sign is seen by no tensor: right, anterior, superior is left, posterior, superior with z reversed.
  add_others(all,
             read_along(patient, frames.table_axes,
                        {"the table in patient axes (left, posterior, superior)",
                         "the table in patient axes, x reversed", "the table in patient axes, y reversed",
                         "the table in patient axes (right, anterior, superior)"}));
  add_others(
      all,
      read_along(frames.image_axes, frames.table_axes,
                 {"the table in image axes (rows, columns, normal)", "the table in image axes, rows reversed",
                  "the table in image axes, columns reversed", "the table in image axes, normal reversed"}));
  return all;
}

/// Deviators as they are seen in the wall after a change of axes.
HelixCourse course_of(const std::vector<WallVoxel>& voxels, const Eigen::Matrix3d& change) {
  HelixCourse course;
  for (const WallVoxel& voxel : voxels)
    course.add(voxel.depth, deviator_in_wall(voxel, change));
  return course;
}

void judge(AxisCandidate& candidate, const std::vector<WallVoxel>& voxels, double all) {
  const HelixCourse course = course_of(voxels, candidate.change);
  const auto angles = course.angles_rad();
  candidate.agreement = agreeing_part(course) / all;
  candidate.helix_slope_deg = (angles.back() - angles.front()) / rad_per_deg;
}

/// Of those that agree as well as the best, the first with a heart's helix; along the patient's axes before the image's.
const AxisCandidate& hearts_best(const std::vector<AxisCandidate>& by_agreement) {
  const AxisCandidate& best = by_agreement.front();
  const auto hearts = std::find_if(by_agreement.begin(), by_agreement.end(), [&](const auto& candidate) {
    return candidate.agreement > alike_share * best.agreement && candidate.helix_slope_deg < 0;
  });
  return hearts != by_agreement.end() ? *hearts : best;
}

struct Turned {
  GradientTurn turn;
  AxisCandidate candidate;
};

/// By how much a candidate is turned, where that is clear, leaves a heart's helix and makes a table that agrees.
std::optional<Turned> turned(const AxisCandidate& from, const std::vector<WallVoxel>& voxels,
                             const DeviatorSize& size) {
  if (from.helix_slope_deg > 0) return std::nullopt;
  Turned found{find_gradient_turn(voxels, from.change), from};
  if (!found.turn.is_clear()) return std::nullopt;
  AxisCandidate& candidate = found.candidate;
  candidate.change = found.turn.rotation * from.change;
  candidate.name = from.change.isIdentity() ? "turned by " + found.turn.name()
                                            : from.name + ", turned by " + found.turn.name();
  judge(candidate, voxels, size.all);
  if (candidate.helix_slope_deg > 0 || candidate.agreement < from.agreement ||
      candidate.agreement < doubtful_share * size.signal_share())
    return std::nullopt;
  return found;
}

Finding contradiction(const AxisCheck& check) {
  return {
      Severity::warning,
      "gradient-axes",
      fmt::format("the gradient directions contradict the wall: fibres at one depth agree by {:.2f} as the "
                  "headers say, by {:.2f} with {}",
                  check.as_said.agreement, check.chosen.agreement, check.chosen.name),
      "gradient directions",
      check.as_said.agreement,
      "",
      fmt::format(
          "Corrected here: {}. --axes as-said keeps the headers' directions; tell whoever exports the "
          "series.",
          check.chosen.name)};
}

Finding turn_finding(const AxisCheck& check, const Turned& found) {
  const bool corrected = found.turn.is_no_field();
  return {
      Severity::warning,
      "gradient-turn",
      fmt::format("the gradient directions are turned against the wall: fibres agree best after {}, \u00b1 "
                  "{:.1f} degrees, by {:.2f} and not {:.2f}",
                  found.turn.name(), found.turn.sigma_deg, found.candidate.agreement, check.chosen.agreement),
      "gradient directions",
      found.turn.angle_deg,
      "deg",
      corrected
          ? "Corrected here. Was the table turned with the images, or the mesh placed askew? --axes as-said "
            "keeps the headers' directions; export both again."
          : "Not corrected: fibres that leave the wall by one angle everywhere look the same. Export "
            "table and images again together, or turn the table by this angle."};
}

Finding doubt(const AxisCheck& check, double signal_share) {
  const AxisCandidate& best = check.candidates.front();
  return {Severity::warning,
          "gradient-axes-doubtful",
          fmt::format(
              "no change of gradient axes makes fibres agree: at one depth by {:.2f} as the headers say, by "
              "{:.2f} at best ({}), of {:.2f} that noise leaves",
              check.as_said.agreement, best.agreement, best.name, signal_share),
          "gradient directions",
          best.agreement,
          "",
          "Nothing is corrected, and the fibres are doubtful: right tables reach 0.85 of what noise leaves. "
          "Are the "
          "table's order, its axes and the mesh those of these images?"};
}

Finding hand(const AxisCandidate& as_said) {
  return {Severity::warning,
          "helix-hand",
          fmt::format("the helix angle rises by {:.0f} degrees from inside to outside; in hearts it falls",
                      as_said.helix_slope_deg),
          "gradient directions",
          as_said.helix_slope_deg,
          "deg",
          "A gradient axis may be reversed along the ventricle's long axis, which the agreement of fibres "
          "hardly "
          "shows; --axes z (or x, y) undoes it. Is the mesh right-handed?"};
}

}  // namespace

std::optional<AxisCandidate> axis_change_named(const std::string& word) {
  if (word == "as-said") return AxisCandidate{.name = "as the headers say"};
  AxisCandidate candidate;
  candidate.name = word;
  if (word == "x" || word == "y" || word == "z") {
    candidate.change(word[0] - 'x', word[0] - 'x') = -1;
    candidate.name += " reversed";
    return candidate;
  }
  // "-y+x+z": the new x is the old -y.
  if (word.size() != 6) return std::nullopt;
  candidate.change.setZero();
  for (int i = 0; i < 3; ++i) {
    const char sign = word[static_cast<size_t>(2 * i)];
    const int axis = word[static_cast<size_t>(2 * i + 1)] - 'x';
    if ((sign != '+' && sign != '-') || axis < 0 || axis > 2) return std::nullopt;
    candidate.change(i, axis) = sign == '-' ? -1 : 1;
  }
  if (std::abs(std::abs(candidate.change.determinant()) - 1) > 1e-9) return std::nullopt;
  return candidate;
}

AxisCheck check_axes(const std::vector<WallVoxel>& voxels, const TableFrames& frames) {
  AxisCheck check;
  if (voxels.empty()) return check;
  check.candidates = candidates_of(frames);
  const DeviatorSize size = deviator_size(voxels);
  for (AxisCandidate& candidate : check.candidates)
    judge(candidate, voxels, size.all);
  check.as_said = check.chosen = check.candidates.front();
  std::stable_sort(check.candidates.begin(), check.candidates.end(),
                   [](const auto& a, const auto& b) { return a.agreement > b.agreement; });
  const AxisCandidate& best = check.candidates.front();
  check.informative = best.agreement > least_agreement;
  if (!check.informative) return check;
  const bool contradicted = check.as_said.agreement < contradicted_share * best.agreement;
  if (contradicted) check.chosen = hearts_best(check.candidates);
  const std::optional<Turned> turn = turned(check.chosen, voxels, size);
  if (!turn && best.agreement < doubtful_share * size.signal_share()) {
    check.chosen = check.as_said;
    check.is_doubtful = true;
    check.findings.push_back(doubt(check, size.signal_share()));
    return check;
  }
  if (contradicted) check.findings.push_back(contradiction(check));
  if (turn) check.findings.push_back(turn_finding(check, *turn));
  if (turn) {
    if (turn->turn.is_no_field())
      check.chosen = turn->candidate;
    else
      check.is_doubtful = true;
  }
  check.is_wrong = !check.chosen.change.isApprox(check.as_said.change);
  if (!check.is_wrong && check.as_said.helix_slope_deg > 0) check.findings.push_back(hand(check.as_said));
  return check;
}

void change_axes(TensorImage& tensors, const Eigen::Matrix3d& change) {
  // In the six numbers, a linear map: column k is what the tensor with 1 at number k becomes.
  TensorCovariance map;
  for (int k = 0; k < 6; ++k)
    map.col(k) = numbers_of(change * matrix_of(TensorNumbers::Unit(k)) * change.transpose());
  for (VoxelTensor& voxel : tensors.voxels) {
    voxel.tensor = map * voxel.tensor;
    voxel.covariance = map * voxel.covariance * map.transpose();
  }
}

}  // namespace diastole::imaging
