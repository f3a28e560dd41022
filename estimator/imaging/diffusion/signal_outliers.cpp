#include "estimator/imaging/diffusion/signal_outliers.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <map>
#include <optional>

#include "estimator/imaging/diffusion/tensor_fit.hpp"
#include "estimator/parallel/parallel_for.hpp"
#include "protocol/contract/input_error.hpp"
#include "protocol/signal/median.hpp"
#include "protocol/signal/quantile.hpp"

namespace diastole::imaging {
namespace {

/// A fifth. Of sound images in the labelled folders paper and modern this log is 0.1 at most; motion in a readout takes a third or more.
constexpr double least_log_gain = 0.18;
constexpr double least_sigmas = 6;
constexpr double own_prediction = 0.9;  ///< leverage above which an image is predicted by itself alone
constexpr size_t most_voxels = 600;  ///< of a slice: at an SNR of 10 their median log signal is known to 1 %
constexpr size_t least_bright_voxels = 20;
constexpr double brighter_than_noise = 5;    ///< without weighting: air of a slice beside the specimen goes
constexpr double predicted_above_noise = 3;  ///< below, magnitudes are more than the signal by 5 % and more

constexpr size_t least_in_shell = 5;  ///< of fewer, one that is off moves the middle

/// Gradients err by a few per cent, and those of imaging weight a little where none is asked for.
bool is_one_shell(double a_s_mm2, double b_s_mm2) {
  return std::abs(a_s_mm2 - b_s_mm2) <= std::max(0.05 * b_s_mm2, 20.0);
}

/// The voxels of a slice that are brighter than noise, every so many: signals by volume.
struct SliceSignals {
  std::vector<size_t> volumes;
  std::vector<Eigen::VectorXd> voxels;
};

SliceSignals signals_of(const DiffusionSeries& series, size_t slice) {
  SliceSignals signals;
  for (size_t v = 0; v < series.volumes.size(); ++v)
    if (series.volumes[v].images[slice]) signals.volumes.push_back(v);
  std::vector<Image> images;
  for (const size_t v : signals.volumes)
    images.push_back(positive_signals(*series.volumes[v].images[slice]));
  const SlicePlane& plane = series.slices[slice];
  std::vector<double>
      brightness;  // in whichever image a voxel is brightest: which ones are sound is not known yet
  for (int row = 0; row < plane.rows; ++row) {
    for (int column = 0; column < plane.columns; ++column) {
      Eigen::VectorXd voxel(static_cast<Eigen::Index>(images.size()));
      for (size_t i = 0; i < images.size(); ++i)
        voxel[static_cast<Eigen::Index>(i)] = static_cast<double>(images[i](row, column));
      brightness.push_back(voxel.maxCoeff());
      signals.voxels.push_back(std::move(voxel));
    }
  }
  if (brightness.size() < least_bright_voxels) return signals;
  // Air goes, tissue beside bright fluid stays.
  const double bright = 0.3 * signal::quantile(brightness, 0.99);
  std::vector<Eigen::VectorXd> chosen;
  for (size_t i = 0; i < brightness.size(); ++i)
    if (brightness[i] >= bright) chosen.push_back(std::move(signals.voxels[i]));
  const size_t stride = std::max<size_t>(1, chosen.size() / most_voxels);
  signals.voxels.clear();
  for (size_t i = 0; i < chosen.size(); i += stride)
    signals.voxels.push_back(chosen[i]);
  return signals;
}

struct LogGain {
  double middle, error;
};

/// Of each of the slice's images beside what the others predict; nothing where they predict nothing.
std::vector<std::optional<LogGain>> gains_of(const DiffusionSeries& series, const SliceSignals& signals) {
  std::vector<std::optional<LogGain>> gains(signals.volumes.size());
  const TensorDesign design = tensor_design(series, signals.volumes);
  if (design.rows() <= tensor_unknowns || signals.voxels.size() < least_bright_voxels) return gains;
  const TensorSolver solver(design);
  std::vector<TensorSolution> fits;
  std::vector<double> variances;
  for (const Eigen::VectorXd& voxel : signals.voxels) {
    fits.push_back(solver.solve(voxel));
    variances.push_back((fits.back().predicted.array() * fits.back().residual.array()).square().sum() /
                        static_cast<double>(design.rows() - tensor_unknowns));
  }
  const double sigma = std::sqrt(signal::median(std::move(variances)));
  for (size_t i = 0; i < signals.volumes.size(); ++i) {
    const auto at = static_cast<Eigen::Index>(i);
    std::vector<double> logs;
    for (size_t k = 0; k < fits.size(); ++k) {
      if (fits[k].leverage[at] > own_prediction ||
          std::exp(fits[k].unknowns[6]) < brighter_than_noise * sigma)
        continue;
      const double apart = fits[k].residual[at] / (1 - fits[k].leverage[at]);  // from what the others predict
      if (signals.voxels[k][at] * std::exp(-apart) > predicted_above_noise * sigma) logs.push_back(apart);
    }
    if (logs.size() < least_bright_voxels) continue;
    const double middle = signal::median(logs);
    const double count = static_cast<double>(logs.size());
    for (double& value : logs)
      value = std::abs(value - middle);
    // The error of a normal sample's median: 1.25 sigma / sqrt(n).
    gains[i] = {middle, 1.25 * signal::deviation_of_normal(std::move(logs)) / std::sqrt(count)};
  }
  return gains;
}

/// Of the images of about one b value that are predicted: their middle, or of few, of which one that is off moves it, the least.
std::optional<double> shell_gain(const DiffusionSeries& series, const SliceSignals& signals,
                                 const std::vector<std::optional<LogGain>>& gains, double b_s_mm2) {
  std::vector<double> shell;
  for (size_t i = 0; i < gains.size(); ++i)
    if (gains[i] && is_one_shell(series.volumes[signals.volumes[i]].b_s_mm2(), b_s_mm2))
      shell.push_back(gains[i]->middle);
  if (shell.size() < 2) return std::nullopt;  // it may be the one that is off
  if (shell.size() >= least_in_shell) return signal::median(std::move(shell));
  return *std::ranges::min_element(shell, {}, [](double gain) { return std::abs(gain); });
}

struct Outlier {
  size_t position;  ///< among the slice's volumes
  double log_gain;
};

/// The image that its siblings predict worst, if it is one. A whole shell may be off: tissue's signal is no exponential of b, and its
/// floor is noise; its images are held against each other.
std::optional<Outlier> worst(const DiffusionSeries& series, const SliceSignals& signals) {
  const std::vector<std::optional<LogGain>> gains = gains_of(series, signals);
  std::optional<Outlier> found;
  for (size_t i = 0; i < gains.size(); ++i) {
    if (!gains[i]) continue;
    const double b_s_mm2 = series.volumes[signals.volumes[i]].b_s_mm2();
    const double apart = gains[i]->middle - shell_gain(series, signals, gains, b_s_mm2).value_or(0.0);
    if (std::abs(apart) < std::max(least_log_gain, least_sigmas * gains[i]->error)) continue;
    if (!found || std::abs(apart) > std::abs(found->log_gain)) found = Outlier{i, apart};
  }
  return found;
}

void drop(SliceSignals& signals, size_t position) {
  signals.volumes.erase(signals.volumes.begin() + static_cast<std::ptrdiff_t>(position));
  for (Eigen::VectorXd& voxel : signals.voxels) {
    Eigen::VectorXd left(voxel.size() - 1);
    const auto at = static_cast<Eigen::Index>(position);
    left << voxel.head(at), voxel.tail(voxel.size() - at - 1);
    voxel = left;
  }
}

struct SliceOutliers {
  std::vector<SignalOutlier> outliers;
  std::map<double, double> shells;  ///< log gain of the images of each b value that are sound, by s/mm2
};

SliceOutliers outliers_of(const DiffusionSeries& series, size_t slice, const std::string& folder) {
  SliceSignals signals = signals_of(series, slice);
  const size_t all = signals.volumes.size();
  SliceOutliers of_slice;
  std::vector<SignalOutlier>& outliers = of_slice.outliers;
  while (const auto found = worst(series, signals)) {
    outliers.push_back({signals.volumes[found->position], slice, std::exp(found->log_gain)});
    if (3 * outliers.size() > all)
      throw InputError({folder, fmt::format("slice {}", slice + 1),
                        fmt::format("more than a third of its {} images contradict the others' tensors", all),
                        "Are they of one scan, with one scaling? --keep-outliers fits them as they are."});
    drop(signals, found->position);
    if (design_rank(tensor_design(series, signals.volumes)) < tensor_unknowns)
      throw InputError(
          {folder, fmt::format("slice {}", slice + 1),
           fmt::format("without the image of {}, which lost {:.0f} % of its signal, the others "
                       "determine no tensor",
                       series.volumes[outliers.back().volume].name(), 100 * (1 - outliers.back().gain)),
           "Acquire the series again, or keep it with --keep-outliers."});
  }
  const std::vector<std::optional<LogGain>> gains = gains_of(series, signals);
  for (const size_t v : signals.volumes) {
    const double b_s_mm2 = series.volumes[v].b_s_mm2();
    const auto known = std::ranges::find_if(
        of_slice.shells, [&](const auto& shell) { return is_one_shell(shell.first, b_s_mm2); });
    if (known != of_slice.shells.end()) continue;
    if (const auto gain = shell_gain(series, signals, gains, b_s_mm2)) of_slice.shells[b_s_mm2] = *gain;
  }
  return of_slice;
}

/// Of b values whose images a tensor does not explain as a whole, in most slices that show it.
void add_shell_findings(DiffusionSeries& series, const std::vector<SliceOutliers>& slices) {
  std::map<double, std::vector<double>> gains;
  for (const SliceOutliers& slice : slices)
    for (const auto& [b_s_mm2, gain] : slice.shells) {
      const auto known = std::ranges::find_if(
          gains, [&, b = b_s_mm2](const auto& shell) { return is_one_shell(shell.first, b); });
      (known == gains.end() ? gains[b_s_mm2] : known->second).push_back(gain);
    }
  for (auto& [b_s_mm2, of_shell] : gains) {
    const double gain = std::exp(signal::median(std::move(of_shell)));
    if (std::abs(std::log(gain)) < least_log_gain) continue;
    series.findings.push_back(
        {Severity::warning, "shell-misfit",
         fmt::format("the images of b {:.0f} have {:.0f} % of the signal that a tensor through all b values "
                     "allows them",
                     b_s_mm2, 100 * gain),
         series.name, gain, "",
         "Diffusion in tissue is slower at large b, and noise has a floor: FA and MD are biased, directions "
         "less. Leave the largest b values away."});
  }
}

std::string range_of(const std::vector<size_t>& slices, size_t all) {
  if (slices.size() == all) return "all slices";
  std::string text = slices.size() == 1 ? "slice " : "slices ";
  for (size_t i = 0; i < slices.size(); ++i)
    text += fmt::format("{}{}", i == 0 ? "" : ", ", slices[i] + 1);
  return text;
}

}  // namespace

std::vector<SignalOutlier> remove_outliers(DiffusionSeries& series, const std::string& folder) {
  std::vector<SliceOutliers> found(series.slices.size());
  parallel_for(found.size(), machine_threads(),
               [&](size_t slice) { found[slice] = outliers_of(series, slice, folder); });
  std::vector<SignalOutlier> all;
  for (const SliceOutliers& of_slice : found)
    all.insert(all.end(), of_slice.outliers.begin(), of_slice.outliers.end());
  add_shell_findings(series, found);
  std::sort(all.begin(), all.end(), [](const SignalOutlier& a, const SignalOutlier& b) {
    return std::pair(a.volume, a.slice) < std::pair(b.volume, b.slice);
  });
  std::map<size_t, std::vector<SignalOutlier>> by_volume;
  for (const SignalOutlier& outlier : all) {
    series.volumes[outlier.volume].images[outlier.slice].reset();
    by_volume[outlier.volume].push_back(outlier);
  }
  for (const auto& [volume, outliers] : by_volume) {
    std::vector<size_t> slices;
    double least = outliers[0].gain, most = least;
    for (const SignalOutlier& outlier : outliers) {
      slices.push_back(outlier.slice);
      least = std::min(least, outlier.gain);
      most = std::max(most, outlier.gain);
    }
    const std::string where = range_of(slices, series.slices.size());
    series.findings.push_back(
        {Severity::warning, "signal-outlier",
         fmt::format("the images of {} have {:.0f} to {:.0f} % of the signal that the others predict, in {}",
                     series.volumes[volume].name(), 100 * least, 100 * most, where),
         fmt::format("volume {}, {}", volume + 1, where), least, "",
         "They are left out. Motion during the readout does this; --keep-outliers keeps them."});
  }
  return all;
}

}  // namespace diastole::imaging
