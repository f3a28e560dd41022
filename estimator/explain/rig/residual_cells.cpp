#include "estimator/explain/rig/residual_cells.hpp"

#include <algorithm>
#include <cmath>
#include <unsupported/Eigen/FFT>

#include "estimator/explain/verdict/chi_square.hpp"

namespace diastole::explain {
namespace {

constexpr std::array band_edges_Hz{0.05, 0.5, 2.0, 6.0, 15.0, 40.0, 75.0, 150.0};

/// One channel of one run.
class ChannelView {
 public:
  ChannelView(const rig::SessionRun& run, const rig::ResidualBlock& block, const Eigen::VectorXd& residuals,
              const Eigen::VectorXd& variance)
      : run_(run),
        block_(block),
        r_(residuals.segment(static_cast<Eigen::Index>(block.first), static_cast<Eigen::Index>(block.count))),
        v_(variance.segment(static_cast<Eigen::Index>(block.first), static_cast<Eigen::Index>(block.count))) {
  }

  void add_segments(std::vector<ResidualCell>& out) const;
  void add_rest(std::vector<ResidualCell>& out) const;
  void add_bands(std::vector<ResidualCell>& out) const;

 private:
  [[nodiscard]] ResidualCell cell(CellKind kind) const {
    ResidualCell made;
    made.kind = kind;
    made.run = block_.run;
    made.channel = block_.channel;
    return made;
  }
  void add_bins(const std::vector<rig::CycleRows>& cycles, int segment, std::vector<ResidualCell>& out) const;
  void add_cycles(const std::vector<rig::CycleRows>& cycles, int segment,
                  std::vector<ResidualCell>& out) const;
  [[nodiscard]] double r(size_t row) const { return r_[static_cast<Eigen::Index>(row)]; }
  [[nodiscard]] double v(size_t row) const { return v_[static_cast<Eigen::Index>(row)]; }

  const rig::SessionRun& run_;
  const rig::ResidualBlock& block_;
  Eigen::VectorXd r_;
  Eigen::VectorXd v_;
};

std::vector<std::vector<rig::CycleRows>> cycles_by_segment(const rig::SessionRun& run) {
  std::vector<std::vector<rig::CycleRows>> list(run.segments.size());
  for (const rig::CycleRows& rows : rig::cycles_of(run)) {
    const double middle_s = run.sample_s[(rows.first + rows.last) / 2];
    for (size_t s = 0; s < run.segments.size(); ++s)
      if (middle_s >= run.segments[s].start_s && middle_s < run.segments[s].end_s()) list[s].push_back(rows);
  }
  return list;
}

void ChannelView::add_segments(std::vector<ResidualCell>& out) const {
  const auto segments = cycles_by_segment(run_);
  for (size_t s = 0; s < segments.size(); ++s) {
    if (segments[s].empty()) continue;
    add_bins(segments[s], static_cast<int>(s), out);
    add_cycles(segments[s], static_cast<int>(s), out);
  }
}

void ChannelView::add_bins(const std::vector<rig::CycleRows>& cycles, int segment,
                           std::vector<ResidualCell>& out) const {
  const auto count = static_cast<double>(cycles.size());
  for (size_t bin = 0; bin < phase_bins; ++bin) {
    ResidualCell scatter = cell(CellKind::scatter);
    scatter.segment = segment;
    scatter.phase = {static_cast<double>(bin) / phase_bins, static_cast<double>(bin + 1) / phase_bins};
    ResidualCell shape = scatter;
    shape.kind = CellKind::shape;
    const size_t length = cycles.front().last - cycles.front().first;
    for (size_t j = bin * length / phase_bins; j < (bin + 1) * length / phase_bins; ++j) {
      double sum = 0.0;
      double error = 0.0;
      for (const rig::CycleRows& rows : cycles) {
        if (rows.first + j >= rows.last) continue;
        const double value = r(rows.first + j);
        scatter.chi_square += value * value / (1.0 + v(rows.first + j));
        scatter.dofs += 1.0;
        sum += value;
        error += v(rows.first + j);
      }
      shape.chi_square += sum * sum / count / (1.0 + error);
      shape.dofs += 1.0;
    }
    out.push_back(scatter);
    if (cycles.size() > 2) out.push_back(shape);
  }
}

void ChannelView::add_cycles(const std::vector<rig::CycleRows>& cycles, int segment,
                             std::vector<ResidualCell>& out) const {
  ResidualCell drift = cell(CellKind::cycles);
  drift.segment = segment;
  for (const rig::CycleRows& rows : cycles) {
    double sum = 0.0;
    double error = 0.0;
    for (size_t k = rows.first; k < rows.last; ++k) {
      sum += r(k);
      error += v(k);
    }
    const auto count = static_cast<double>(rows.last - rows.first);
    drift.chi_square += sum * sum / count / (1.0 + error / count);
    drift.dofs += 1.0;
  }
  out.push_back(drift);
}

void ChannelView::add_rest(std::vector<ResidualCell>& out) const {
  std::vector<bool> moving(block_.count, false);
  for (const rig::CycleRows& rows : rig::cycles_of(run_))
    std::fill(moving.begin() + static_cast<std::ptrdiff_t>(rows.first),
              moving.begin() + static_cast<std::ptrdiff_t>(rows.last), true);
  ResidualCell scatter = cell(CellKind::rest);
  ResidualCell level = scatter;
  double sum = 0.0;
  double part = 0.0;
  const size_t second = 300;
  for (size_t k = 0; k < block_.count; ++k) {
    if (!moving[k]) {
      scatter.chi_square += r(k) * r(k) / (1.0 + v(k));
      scatter.dofs += 1.0;
      sum += r(k);
      part += 1.0;
    }
    if (part > 0.0 && (moving[k] || k + 1 == block_.count || part >= static_cast<double>(second))) {
      level.chi_square += sum * sum / part / (1.0 + v(k));
      level.dofs += 1.0;
      sum = 0.0;
      part = 0.0;
    }
  }
  if (scatter.dofs > 0.0) out.push_back(scatter);
  if (level.dofs > 0.0) out.push_back(level);
}

void ChannelView::add_bands(std::vector<ResidualCell>& out) const {
  std::vector<double> scaled(block_.count);
  double models_part = 0.0;  // of the variance
  for (size_t k = 0; k < block_.count; ++k) {
    scaled[k] = r(k) / std::sqrt(1.0 + v(k));
    models_part += v(k) / (1.0 + v(k)) / static_cast<double>(block_.count);
  }
  const bool rings = block_.channel == name_of(rig::Channel::pump);
  Eigen::FFT<double> transform;
  std::vector<std::complex<double>> spectrum;
  transform.fwd(spectrum, scaled);
  const double spacing_Hz = 1.0 / (run_.sample_s.back() - run_.sample_s.front());
  for (size_t band = 0; band + 1 < band_edges_Hz.size(); ++band) {
    ResidualCell made = cell(CellKind::band);
    made.band_Hz = {band_edges_Hz[band], band_edges_Hz[band + 1]};
    const auto from = static_cast<size_t>(band_edges_Hz[band] / spacing_Hz) + 1;
    const auto to = std::min(static_cast<size_t>(band_edges_Hz[band + 1] / spacing_Hz) + 1, block_.count / 2);
    for (size_t k = from; k < to; ++k) {
      made.chi_square += 2.0 * std::norm(spectrum[k]) / static_cast<double>(block_.count);
      made.dofs += 2.0;
    }
    if (made.dofs == 0.0) continue;
    // The line rings at single frequencies: all of the model's error may lie in this band.
    const double share = made.dofs / static_cast<double>(block_.count);
    if (rings) made.chi_square /= 1.0 + models_part * (1.0 / share - 1.0);
    out.push_back(made);
  }
}

ResidualCell volume_cell(const rig::ResidualBlock& block, const Eigen::VectorXd& residuals,
                         const Eigen::VectorXd& variance) {
  ResidualCell cell;
  cell.kind = CellKind::volume;
  cell.run = block.run;
  cell.channel = block.channel;
  for (size_t k = 0; k < block.count; ++k) {
    const auto row = static_cast<Eigen::Index>(block.first + k);
    cell.chi_square += residuals[row] * residuals[row] / (1.0 + variance[row]);
    cell.dofs += 1.0;
  }
  return cell;
}

}  // namespace

std::vector<ResidualCell> residual_cells(const rig::Session& session,
                                         const std::vector<rig::ResidualBlock>& blocks,
                                         const Eigen::VectorXd& residuals, const Eigen::VectorXd& variance) {
  std::vector<ResidualCell> cells;
  for (const rig::ResidualBlock& block : blocks) {
    if (block.channel == "cavity_mL") {
      cells.push_back(volume_cell(block, residuals, variance));
      continue;
    }
    const ChannelView view(session.runs[block.run], block, residuals, variance);
    view.add_segments(cells);
    view.add_rest(cells);
    view.add_bands(cells);
  }
  for (ResidualCell& cell : cells)
    cell.p_value = chi_square_tail(cell.chi_square / (1.0 + noise_uncertainty), cell.dofs);
  return cells;
}

std::vector<ResidualCell> significant(std::vector<ResidualCell> cells, double rate) {
  std::vector<double> p_values;
  for (const ResidualCell& cell : cells)
    p_values.push_back(cell.p_value);
  const double limit = discovery_limit(p_values, rate);
  std::erase_if(cells, [&](const ResidualCell& cell) { return cell.p_value > limit; });
  std::sort(cells.begin(), cells.end(),
            [](const ResidualCell& a, const ResidualCell& b) { return a.excess() > b.excess(); });
  return cells;
}

bool is_structured(const std::vector<ResidualCell>& left, size_t cells) {
  return std::ranges::any_of(
      left, [&](const ResidualCell& cell) { return cell.p_value * static_cast<double>(cells) < 1e-6; });
}

}  // namespace diastole::explain
