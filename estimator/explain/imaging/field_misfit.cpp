#include "estimator/explain/imaging/field_misfit.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <array>
#include <cmath>
#include <functional>
#include <map>
#include <numbers>

#include "estimator/explain/imaging/linear_evidence.hpp"
#include "estimator/inference/tail_probability.hpp"
#include "estimator/mesh/wall_coordinates.hpp"

namespace diastole::explain {
namespace {

using Eigen::Index;

constexpr double significant_there = 1e-3;
/// By how much a coarser part must stand out more than any finer one to be the place.
constexpr double coarser_pays = 10.0;

/// Equal parts of the specimen.
struct Partition {
  size_t turns;
  size_t levels;
  size_t depths;

  [[nodiscard]] size_t cells() const { return turns * levels * depths; }

  static size_t part(double share, size_t count) {
    return static_cast<size_t>(
        std::clamp(share * static_cast<double>(count), 0.0, static_cast<double>(count) - 1.0));
  }

  [[nodiscard]] size_t cell_of(const WallPlace& place) const {
    const double turn = place.turn_rad / (2.0 * std::numbers::pi);
    return part(turn < 0.0 ? turn + 1.0 : turn, turns) +
           turns * (part(0.5 * (place.height + 1.0), levels) + levels * part(place.depth, depths));
  }

  [[nodiscard]] std::string words(const WallCoordinates& wall, size_t cell) const {
    const double theta_deg = (static_cast<double>(cell % turns) + 0.5) * 360.0 / static_cast<double>(turns);
    const double thick_mm = wall.height_mm() / static_cast<double>(levels);
    const double low_mm = wall.lowest_mm() + thick_mm * static_cast<double>(cell / turns % levels);
    std::string text = turns == 1 ? "all around" : fmt::format("around {:.0f} deg", theta_deg);
    if (levels > 1) text += fmt::format(", z {:.0f} to {:.0f} mm", low_mm, low_mm + thick_mm);
    if (depths > 1)
      text += fmt::format(", {} half of the wall", cell / turns / levels == 0 ? "inner" : "outer");
    return text;
  }
};

/// Fine ones show an inclusion's place, rings and layers what is the same all around.
constexpr std::array<Partition, 5> partitions{{{8, 4, 2}, {4, 2, 1}, {1, 4, 2}, {1, 2, 1}, {1, 1, 2}}};

/// Residuals of each row as predicted from the other folds.
Eigen::VectorXd held_out_residuals(const FieldFit& fit, const std::vector<size_t>& folds) {
  const Index rows = fit.residuals.size();
  const Eigen::MatrixXd normal = fit.jacobian.transpose() * fit.jacobian;
  const Eigen::VectorXd gradient = fit.jacobian.transpose() * fit.all_residuals();
  Eigen::VectorXd predicted = fit.residuals;
  const size_t count = folds.empty() ? 0 : 1 + std::ranges::max(folds);
  for (size_t fold = 0; fold < count; ++fold) {
    std::vector<Index> out;
    for (Index i = 0; i < rows; ++i)
      if (folds[static_cast<size_t>(i)] == fold) out.push_back(i);
    const Eigen::MatrixXd left_out = fit.jacobian(out, Eigen::all);
    const Eigen::VectorXd without = gradient - left_out.transpose() * fit.residuals(out);
    const Eigen::VectorXd step = -(normal - left_out.transpose() * left_out).ldlt().solve(without);
    predicted(out) = fit.residuals(out) + left_out * step;
  }
  return predicted;
}

}  // namespace

std::vector<size_t> deal_folds(const Measurement& measurement, const MotionResiduals& rows, size_t folds) {
  using Direction = std::array<long, 3>;
  const auto direction_of = [&](const ResidualRow& row) {
    Direction direction{};
    for (size_t i = 0; i < 3; ++i)
      direction[i] = std::lround(100.0 * measurement.tags[row.source].normal[i]);
    return direction;
  };
  std::map<Direction, size_t> sizes;
  for (const ResidualRow& row : rows.rows())
    if (rows.of_tag(row)) ++sizes[direction_of(row)];
  std::vector<std::pair<size_t, Direction>> largest_first;
  for (const auto& [direction, size] : sizes)
    largest_first.emplace_back(size, direction);
  std::ranges::sort(largest_first, std::greater{});
  std::vector<size_t> filled(folds, 0);
  std::map<Direction, size_t> fold_of;
  for (const auto& [size, direction] : largest_first) {
    const auto least = static_cast<size_t>(std::ranges::min_element(filled) - filled.begin());
    fold_of[direction] = least;
    filled[least] += size;
  }
  std::vector<size_t> result;
  for (const ResidualRow& row : rows.rows())
    result.push_back(rows.of_tag(row) ? fold_of[direction_of(row)] : row.source % folds);
  return result;
}

Gap field_gap(const FieldFit& base, const FieldFit& after, const std::vector<size_t>& folds,
              const Eigen::MatrixXd& directions) {
  const Eigen::MatrixXd basis = orthonormal_basis(directions);
  const Index rank = basis.cols();
  const auto reduced = [&](const FieldFit& fit) {
    return ((basis.transpose() * held_out_residuals(fit, folds)).squaredNorm() + fit.priors.squaredNorm()) /
           static_cast<double>(rank + fit.priors.size());
  };
  Gap gap;
  gap.before = reduced(base);
  gap.after = reduced(after);
  const double inside = (basis.transpose() * after.residuals).squaredNorm();
  gap.floor = (after.residuals.squaredNorm() - inside) / static_cast<double>(after.residuals.size() - rank);
  const double excess = gap.before - gap.floor;
  gap.closed = excess > 0.0 ? std::clamp(1.0 - (gap.after - gap.floor) / excess, 0.0, 1.0) : 0.0;
  gap.held_out = {"tags by their direction, a fifth at a time"};
  return gap;
}

std::vector<Misfit> misfit_regions(const HermiteMesh& mesh, const MotionResiduals& rows, const FieldFit& fit,
                                   size_t most) {
  const WallCoordinates wall(mesh);
  size_t cells = 0;
  for (const Partition& partition : partitions)
    cells += partition.cells();
  Eigen::MatrixXd columns = Eigen::MatrixXd::Zero(rows.size(), static_cast<Index>(3 * cells));
  const double highest_kPa = std::ranges::max(fit.pressures_kPa);
  std::vector<size_t> tags(cells, 0);
  for (Index i = 0; i < rows.size(); ++i) {
    const ResidualRow& row = rows.rows()[static_cast<size_t>(i)];
    const Eigen::RowVector3d along = by_cylindrical_motion(row);
    const WallPlace place = wall.at(mesh, row.point);
    size_t begun = 0;
    for (const Partition& partition : partitions) {
      const size_t cell = begun + partition.cell_of(place);
      columns.block<1, 3>(i, static_cast<Index>(3 * cell)) =
          fit.pressures_kPa[row.slot] / highest_kPa * along;
      ++tags[cell];
      begun += partition.cells();
    }
  }
  const LinearEvidence evidence(fit, columns);
  std::vector<Misfit> found;
  size_t begun = 0;
  for (const Partition& partition : partitions) {
    std::vector<Misfit> here;
    for (size_t cell = 0; cell < partition.cells(); ++cell) {
      const auto first = static_cast<Index>(3 * (begun + cell));
      if (tags[begun + cell] < 30) continue;
      const LinearEvidence::Gain gain = evidence.gain({first, first + 1, first + 2});
      if (gain.degrees == 0) continue;
      const double p =
          std::min(1.0, static_cast<double>(cells) *
                            inference::chi_square_tail(gain.chi_square, static_cast<double>(gain.degrees)));
      if (p > significant_there) continue;
      Misfit misfit;
      misfit.port = "field";
      misfit.channel = "tags";
      misfit.region = partition.words(wall, cell);
      misfit.excess_chi2 = gain.chi_square - static_cast<double>(gain.degrees);
      misfit.p_value = p;
      here.push_back(std::move(misfit));
    }
    begun += partition.cells();
    std::ranges::stable_sort(here, std::greater{}, &Misfit::excess_chi2);
    if (!here.empty() &&
        (found.empty() || here.front().excess_chi2 > found.front().excess_chi2 + coarser_pays))
      found = std::move(here);
  }
  if (found.size() > most) found.resize(most);
  return found;
}

}  // namespace diastole::explain
