#include "estimator/reconstruction/slice_offsets.hpp"

#include <algorithm>
#include <cmath>
#include <limits>

namespace diastole {
namespace {

struct Information {
  Eigen::MatrixXd S;
  Eigen::VectorXd t;
  Eigen::VectorXd
      of_tags;  ///< what each slice's tags would know of its offset in a body whose motion is known: the diagonal of C'C
};

Information information_of(const FrameField& field, const std::vector<int>& slice_of_tag,
                           Eigen::Index slices) {
  const auto rows = static_cast<Eigen::Index>(field.rows.size());
  Eigen::MatrixXd C = Eigen::MatrixXd::Zero(rows, slices);
  Eigen::VectorXd residual = Eigen::VectorXd::Zero(rows);
  const double scale = std::max(field.scale, 1.0);
  for (Eigen::Index i = 0; i < rows; ++i) {
    const FieldRow& row = field.rows[static_cast<size_t>(i)];
    if (row.rejected) continue;
    residual[i] = row.residual / scale;
    const int slice = row.of_tag ? slice_of_tag[row.source] : -1;
    if (slice >= 0) C(i, slice) = 1.0 / (row.sigma_mm * scale);
  }
  // K is made of the rows as the system has them, weighted by 1/sigma without the scale; both scales cancel in K.
  const Eigen::MatrixXd seen = field.system->weighted_rows().transpose() * C;
  const Eigen::MatrixXd all = C.transpose() * C;
  return {all - seen.transpose() * field.system->solve(seen), C.transpose() * residual, all.diagonal()};
}

}  // namespace

std::vector<SliceOffset> slice_offsets(const std::vector<FrameField>& fields, const TagGroups& groups,
                                       std::span<const TagPoint> tags) {
  constexpr double significant = 5.0, smallest_mm = 0.1, least_sigmas = 0.5, least_left = 1e-4;
  const auto slices = static_cast<Eigen::Index>(groups.slices.size());
  std::vector<int> slice_of_tag(tags.size(), -1);
  std::vector<SliceOffset> result;
  std::vector<double> least_mm;
  for (size_t s = 0; s < groups.slices.size(); ++s) {
    double sigma_mm = 0.0;
    for (const size_t i : groups.slices[s].tags) {
      slice_of_tag[i] = static_cast<int>(s);
      sigma_mm += tags[i].sigma_mm / static_cast<double>(groups.slices[s].tags.size());
    }
    least_mm.push_back(std::max(smallest_mm, least_sigmas * sigma_mm));
    result.push_back({s, 0.0, std::numeric_limits<double>::infinity(), false});
  }
  if (slices == 0) return result;
  Information all{Eigen::MatrixXd::Zero(slices, slices), Eigen::VectorXd::Zero(slices),
                  Eigen::VectorXd::Zero(slices)};
  for (const FrameField& field : fields) {
    const Information one = information_of(field, slice_of_tag, slices);
    all.S += one.S;
    all.t += one.t;
    all.of_tags += one.of_tags;
  }
  std::vector<Eigen::Index> selected;
  for (;;) {
    // What is left of each slice beside those taken.
    const Eigen::MatrixXd chosen = all.S(selected, selected);
    const Eigen::MatrixXd between = all.S(selected, Eigen::all);
    const Eigen::LDLT<Eigen::MatrixXd> factor(chosen);
    const Eigen::VectorXd offsets =
        selected.empty() ? Eigen::VectorXd() : Eigen::VectorXd(factor.solve(all.t(selected)));
    const Eigen::MatrixXd inverse =
        selected.empty()
            ? Eigen::MatrixXd()
            : Eigen::MatrixXd(factor.solve(Eigen::MatrixXd::Identity(chosen.rows(), chosen.cols())));
    Eigen::Index best = -1;
    double most = significant;
    for (Eigen::Index s = 0; s < slices; ++s) {
      SliceOffset& offset = result[static_cast<size_t>(s)];
      const auto found = std::find(selected.begin(), selected.end(), s);
      if (found != selected.end()) {
        const Eigen::Index at = found - selected.begin();
        offset = {static_cast<size_t>(s), offsets[at], std::sqrt(inverse(at, at)), true};
        continue;
      }
      double information = all.S(s, s), pull = all.t[s];
      if (!selected.empty()) {
        const Eigen::VectorXd column = between.col(s);
        information -= column.dot(factor.solve(column));
        pull -= column.dot(offsets);
      }
      const double left = information / all.of_tags[s];  // of the offset, beside the field that bends to it
      if (!(left > least_left)) continue;
      offset = {static_cast<size_t>(s), pull / information, 1.0 / std::sqrt(information), false};
      const double significance = std::abs(offset.offset_mm) / offset.se_mm;
      if (significance > most && std::abs(offset.offset_mm) * left > least_mm[static_cast<size_t>(s)]) {
        most = significance;
        best = s;
      }
    }
    if (best < 0) return result;
    selected.push_back(best);
  }
}

}  // namespace diastole
