#include "estimator/explain/imaging/field_next_experiment.hpp"

#include <fmt/format.h>
#include <fmt/ranges.h>

#include <algorithm>
#include <array>
#include <bit>
#include <cmath>

#include "estimator/explain/verdict/experiment_plan.hpp"
#include "estimator/inference/information.hpp"

namespace diastole::explain {
namespace {

using Eigen::Index;

constexpr double separated_sigma = 5.0;
constexpr double volume_error = 0.01;  // of gated phase contrast, each frame's
constexpr double shear_error = 0.007;  // of a rotational shear test
constexpr double higher = 1.3;         // pressure of added frames over the highest so far
constexpr int added_frames = 3;

/// One acquisition.
struct Imaging {
  double tags = 1.0;  ///< as many times
  double pressure_error = 1.0;
  bool volumes = false;
  bool shear_test = false;
  bool higher_frames = false;
};

/// Something that can be changed, the cheapest first.
struct Change {
  const char* words;
  void (*make)(Imaging&);
};

constexpr std::array<Change, 5> changes{
    {{"gated cavity volumes by phase contrast", [](Imaging& i) { i.volumes = true; }},
     {"an independent C1 by a rotational shear test", [](Imaging& i) { i.shear_test = true; }},
     {"three more frames at 1.3 times the highest pressure", [](Imaging& i) { i.higher_frames = true; }},
     {"frame pressures four times as exact (averaged over more cycles)",
      [](Imaging& i) { i.pressure_error = 0.25; }},
     {"every slice imaged twice, with tags in between", [](Imaging& i) { i.tags = 2.0; }}}};

/// Sums over rows of [delta K]' [delta K].
class Gram {
 public:
  explicit Gram(Index unknowns) : sum_(Eigen::MatrixXd::Zero(unknowns + 1, unknowns + 1)) {}

  void add(const Eigen::VectorXd& delta, const Eigen::MatrixXd& k, double weight) {
    Eigen::MatrixXd all(delta.size(), sum_.cols());
    all << delta, k;
    sum_ += weight * weight * all.transpose() * all;
  }
  /// A single row with one derivative.
  void add_one(double delta, Index unknown, double derivative) {
    Eigen::VectorXd row = Eigen::VectorXd::Zero(sum_.cols());
    row[0] = delta;
    row[1 + unknown] = derivative;
    sum_ += row * row.transpose();
  }
  /// Sums of rows that know fewer unknowns.
  void add_sums(const Eigen::MatrixXd& sums, double weight) {
    sum_.topLeftCorner(sums.rows(), sums.cols()) += weight * weight * sums;
  }
  [[nodiscard]] const Eigen::MatrixXd& sums() const { return sum_; }
  [[nodiscard]] double separation() const { return inference::separation(sum_, weak_prior()); }
  [[nodiscard]] Eigen::MatrixXd information() const {
    const Index n = sum_.cols() - 1;
    return sum_.bottomRightCorner(n, n) + weak_prior();
  }

 private:
  /// So that unknowns of which the rows say nothing are harmless.
  [[nodiscard]] Eigen::MatrixXd weak_prior() const {
    const Index n = sum_.cols() - 1;
    return 1e-12 * Eigen::MatrixXd::Identity(n, n);
  }

  Eigen::MatrixXd sum_;
};

/// What an acquisition would say of B's unknowns if A were true.
class Outlook {
 public:
  Outlook(const FieldCase& field, const MotionResiduals& rows, const ImagedModel& truth,
          const ImagedModel& adapting)
      : field_(field),
        rows_(rows),
        a_(truth.hypothesis->fit),
        b_(adapting.hypothesis->fit),
        truth_(truth),
        adapting_(adapting),
        slots_(static_cast<Index>(b_.pressures_kPa.size())),
        effects_(static_cast<Index>(b_.choice.free.size())),
        tags_(b_.jacobian.cols()) {
    tags_.add(b_.residuals - a_.residuals, b_.jacobian.topRows(b_.residuals.size()), 1.0);
  }

  [[nodiscard]] Gram of(const Imaging& imaging) const {
    const Index unknowns = b_.jacobian.cols() + (imaging.higher_frames ? added_frames : 0);
    Gram gram(unknowns);
    gram.add_sums(tags_.sums(), std::sqrt(imaging.tags));
    add_loads(imaging, gram);
    add_knowledge(imaging, gram);
    if (imaging.higher_frames) add_higher_frames(imaging, unknowns, gram);
    return gram;
  }

 private:
  static Eigen::MatrixXd padded(const Eigen::MatrixXd& k, Index unknowns) {
    Eigen::MatrixXd result = Eigen::MatrixXd::Zero(k.rows(), unknowns);
    result.leftCols(k.cols()) = k;
    return result;
  }

  [[nodiscard]] Index pressure_unknown(Index slot) const {
    return static_cast<Index>(b_.law.size()) + effects_ + slot;
  }

  [[nodiscard]] double sigma_kPa(Index slot) const {
    const int frame = rows_.frames()[static_cast<size_t>(slot)];
    return std::max(1e-4, field_.measurement.frames[static_cast<size_t>(frame)].sigma_kPa);
  }

  [[nodiscard]] double pressure_difference_kPa(Index slot) const {
    const auto s = static_cast<size_t>(slot);
    return b_.pressures_kPa[s] - a_.pressures_kPa[s];
  }

  void add_loads(const Imaging& imaging, Gram& gram) const {
    for (Index slot = 0; slot < slots_; ++slot) {
      const double sigma = imaging.pressure_error * sigma_kPa(slot);
      gram.add_one(pressure_difference_kPa(slot) / sigma, pressure_unknown(slot), 1.0 / sigma);
    }
  }

  void add_knowledge(const Imaging& imaging, Gram& gram) const {
    double C1_sigma = field_.C1_start_kPa.sigma;
    if (imaging.shear_test && C1_sigma == 0.0 && b_.law.size() == 1) C1_sigma = shear_error * a_.law[0];
    if (C1_sigma > 0.0) gram.add_one((b_.law[0] - a_.law[0]) / C1_sigma, 0, b_.law[0] / C1_sigma);
    Index prior = slots_ + (field_.C1_start_kPa.sigma > 0.0 ? 1 : 0);
    const auto add_prior = [&](double delta) {
      Eigen::VectorXd row = b_.jacobian.row(b_.residuals.size() + prior);
      for (Index unknown = 0; unknown < row.size(); ++unknown)
        if (row[unknown] != 0.0) gram.add_one(delta, unknown, row[unknown]);
      ++prior;
    };
    if (field_.inner_radius_mm) {
      const bool own = b_.jacobian.row(b_.residuals.size() + prior).squaredNorm() > 0.0;
      if (own) add_prior(b_.priors[prior] - a_.priors[prior]);
      if (!own) ++prior;
    }
    while (prior < b_.priors.size())
      add_prior(0.0);  // what is known of inclusions in general
    if (imaging.volumes && std::isfinite(truth_.volume_change_mL) &&
        std::isfinite(adapting_.volume_change_mL)) {
      const double error_mL = volume_error * truth_.volume_change_mL / std::sqrt(static_cast<double>(slots_));
      // The cavity answers to C1 about as 1 / C1.
      gram.add_one((adapting_.volume_change_mL - truth_.volume_change_mL) / error_mL, 0,
                   -adapting_.volume_change_mL / error_mL);
    }
  }

  void add_higher_frames(const Imaging& imaging, Index unknowns, Gram& gram) const {
    const auto loudest =
        static_cast<Index>(std::ranges::max_element(b_.pressures_kPa) - b_.pressures_kPa.begin());
    const Eigen::VectorXd delta = at_equal_pressure(loudest);
    const double growth = std::pow(higher, power_of_growth(loudest, delta.norm()));
    Eigen::MatrixXd k = higher * block(loudest);
    const Eigen::VectorXd by_pressure = k.col(pressure_unknown(loudest));
    k.col(pressure_unknown(loudest)).setZero();
    for (int frame = 0; frame < added_frames; ++frame) {
      const Index own = b_.jacobian.cols() + frame;
      Eigen::MatrixXd all = padded(k, unknowns);
      all.col(own) = by_pressure;
      gram.add(growth * delta, all, std::sqrt(imaging.tags));
      gram.add_one(0.0, own, 1.0 / (imaging.pressure_error * sigma_kPa(loudest)));
    }
  }

  [[nodiscard]] Eigen::MatrixXd block(Index slot) const {
    const auto s = static_cast<size_t>(slot);
    return b_.jacobian.middleRows(rows_.first(s), rows_.count(s));
  }

  [[nodiscard]] Eigen::VectorXd at_equal_pressure(Index slot) const {
    const auto s = static_cast<size_t>(slot);
    const Eigen::VectorXd delta = (b_.residuals - a_.residuals).segment(rows_.first(s), rows_.count(s));
    return delta - pressure_difference_kPa(slot) * block(slot).col(pressure_unknown(slot));
  }

  /// Between the frame of highest pressure and that nearest to half of it.
  [[nodiscard]] double power_of_growth(Index loudest, double loud) const {
    const auto pressure = [&](Index slot) { return b_.pressures_kPa[static_cast<size_t>(slot)]; };
    Index half = loudest;
    for (Index slot = 0; slot < slots_; ++slot)
      if (std::abs(pressure(slot) - 0.5 * pressure(loudest)) <
          std::abs(pressure(half) - 0.5 * pressure(loudest)))
        half = slot;
    if (half == loudest || !(loud > 0.0)) return 1.0;
    const double quiet = std::max(1e-9, at_equal_pressure(half).norm());
    return std::clamp(std::log(loud / quiet) / std::log(pressure(loudest) / pressure(half)), 1.0, 3.0);
  }

  const FieldCase& field_;
  const MotionResiduals& rows_;
  const FieldFit& a_;
  const FieldFit& b_;
  ImagedModel truth_;
  ImagedModel adapting_;
  Index slots_;
  Index effects_;
  Gram tags_;  ///< of the present tags
};

/// A set of changes as bits.
Imaging imaging_of(unsigned set) {
  Imaging imaging;
  for (size_t i = 0; i < changes.size(); ++i)
    if ((set >> i & 1U) != 0) changes[i].make(imaging);
  return imaging;
}

std::string words_of(unsigned set) {
  std::vector<std::string> words;
  for (size_t i = 0; i < changes.size(); ++i)
    if ((set >> i & 1U) != 0) words.emplace_back(changes[i].words);
  return fmt::format("{}", fmt::join(words, ", "));
}

constexpr unsigned every_set = 1U << changes.size();

std::string file_of(double volume_change_mL, unsigned set, const std::string& remark) {
  constexpr double usual_mL = 24.0;
  constexpr double period_s = 1.2;
  constexpr int cycles_a_slice = 38;
  constexpr int slices = 12;
  const Imaging imaging = imaging_of(set);
  const double stroke_mL = (std::isfinite(volume_change_mL) ? volume_change_mL : usual_mL) *
                           (imaging.higher_frames ? higher : 1.0);
  PlannedExperiment plan;
  plan.volumes = imaging.volumes;
  plan.stiffness = imaging.shear_test;
  const int cycles = cycles_a_slice * slices * static_cast<int>(imaging.tags);
  plan.segments = {{0.0, "parabolic", 0.5 * std::round(2.0 * stroke_mL), period_s, 0.0, cycles}};
  return to_toml(plan, remark);
}

}  // namespace

std::optional<NextExperiment> separating_images(const FieldCase& field, const MotionResiduals& rows,
                                                const std::vector<ImagedModel>& competing) {
  if (competing.size() < 2) return {};
  std::vector<Outlook> outlooks;  // of every pair, whichever of the two is true
  for (const ImagedModel& truth : competing)
    for (const ImagedModel& other : competing)
      if (&truth != &other) outlooks.emplace_back(field, rows, truth, other);
  unsigned best = 1;
  double best_sigma = -1.0;
  for (int most = 1; most <= static_cast<int>(changes.size()) && best_sigma < separated_sigma; ++most) {
    for (unsigned set = 1; set < every_set; ++set) {
      if (std::popcount(set) != most) continue;
      double least = HUGE_VAL;
      for (const Outlook& outlook : outlooks)
        least = std::min(least, outlook.of(imaging_of(set)).separation());
      if (least <= best_sigma + 0.1) continue;
      best_sigma = least;
      best = set;
    }
  }
  NextExperiment next;
  next.predicted_separation_sigma = best_sigma;
  for (const ImagedModel& model : competing)
    next.separates.push_back(model.hypothesis->name());
  next.reason = fmt::format("Image again, with {}: {} would part by {:.1f} sigmas.", words_of(best),
                            fmt::join(next.separates, ", "), best_sigma);
  next.toml = file_of(competing.front().volume_change_mL, best, next.reason);
  return next;
}

NextExperiment sharpening_images(const FieldCase& field, const MotionResiduals& rows,
                                 const ImagedModel& named) {
  const FieldFit& fit = named.hypothesis->fit;
  const Outlook outlook(field, rows, named, named);
  const size_t size_of_effect = fit.choice.free.front();
  const EffectParameter& parameter = fit.choice.parameter(size_of_effect);
  const auto unknown = static_cast<Index>(fit.law.size());
  const auto distance = [&](double variance) {
    const inference::Parameter scale = searched(parameter);
    const double away =
        parameter.neutral == 0.0 && parameter.scale == SearchScale::logarithmic
            ? 1.0
            : scale.coordinate(fit.choice.values[size_of_effect]) - scale.coordinate(parameter.neutral);
    return std::abs(away) / std::sqrt(variance);
  };
  unsigned best = 1;
  double best_sigma = 0.0;
  for (unsigned i = 0; i < changes.size(); ++i) {
    const Eigen::MatrixXd covariance =
        inference::covariance_of_information(outlook.of(imaging_of(1U << i)).information()).matrix;
    const double sigma = distance(covariance(unknown, unknown));
    if (sigma <= best_sigma) continue;
    best_sigma = sigma;
    best = 1U << i;
  }
  NextExperiment next;
  next.predicted_separation_sigma = best_sigma;
  next.reason =
      fmt::format("To know {} of {} better, image again with {}: {:.1f} sigmas from none instead of {:.1f}.",
                  parameter.name, named.hypothesis->name(), words_of(best), best_sigma,
                  distance(inference::estimate_covariance(fit.jacobian).matrix(unknown, unknown)));
  next.toml = file_of(named.volume_change_mL, best, next.reason);
  return next;
}

NextExperiment exposing_images() {
  NextExperiment next;
  next.reason =
      "Image the same loads again with the specimen turned by 90 degrees about its axis, and the unloaded "
      "state after them: what turns along is the specimen's, what does not is the plates' or the images', "
      "and what stays without load is not elastic.";
  next.toml = file_of(std::nan(""), 0, next.reason);
  return next;
}

}  // namespace diastole::explain
