#include "estimator/law_fit/law_comparison.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <limits>
#include <mutex>

#include "estimator/parallel/parallel_for.hpp"

namespace diastole {
namespace {

constexpr size_t parts_of_one_kind = 5;

/// What a law is fitted to, and what it then predicts.
struct Fold {
  std::string name;
  std::vector<BenchTest> kept, left_out;
};

void add_if_any(std::vector<BenchTest>& tests, BenchTest test) {
  if (!test.readings.empty()) tests.push_back(std::move(test));
}

std::vector<Fold> folds_by_kind(const std::vector<BenchTest>& tests) {
  std::vector<Fold> folds;
  for (const TestKind& kind : test_kinds()) {
    Fold fold{std::string(kind.name), {}, {}};
    for (const BenchTest& test : tests)
      (test.kind == &kind ? fold.left_out : fold.kept).push_back(test);
    if (!fold.left_out.empty()) folds.push_back(std::move(fold));
  }
  return folds;
}

std::vector<Fold> folds_by_reading(const std::vector<BenchTest>& tests) {
  std::vector<Fold> folds;
  for (size_t part = 0; part < parts_of_one_kind; ++part) {
    Fold fold{fmt::format("every fifth reading, from {}", part + 1), {}, {}};
    for (const BenchTest& test : tests) {
      BenchTest kept = test, left_out = test;
      kept.readings.clear();
      left_out.readings.clear();
      for (size_t i = 0; i < test.readings.size(); ++i)
        (i % parts_of_one_kind == part ? left_out : kept).readings.push_back(test.readings[i]);
      add_if_any(fold.kept, std::move(kept));
      add_if_any(fold.left_out, std::move(left_out));
    }
    if (!fold.left_out.empty()) folds.push_back(std::move(fold));
  }
  return folds;
}

/// Squares of a law's errors on what was left out, in the order of folds.
struct Prediction {
  Eigen::VectorXd residuals2;
  bool determined = false;
};

Prediction prediction_of(const Law& law, const Fold& fold, const LawFitOptions& options) {
  Eigen::Index count = 0;
  for (const BenchTest& test : fold.left_out)
    count += std::ssize(test.readings) * std::ssize(test.channels);
  Prediction prediction{Eigen::VectorXd::Constant(count, std::numeric_limits<double>::infinity())};
  if (!why_not(law, fold.kept).empty()) return prediction;
  const LawFit fit = fit_law(law, fold.kept, options);
  if (fit.parameters.empty()) return prediction;
  const Eigen::VectorXd residuals = relative_residuals(law, fit.values(), fold.left_out);
  if (residuals.size() > 0) prediction.residuals2 = residuals.cwiseAbs2();
  prediction.determined = fit.determined();
  return prediction;
}

double percent_of(const Eigen::VectorXd& residuals2) { return 100 * std::sqrt(residuals2.mean()); }

/// Whether the mean of one law's squares lies above the other's by more than the standard error of the difference.
bool lies_above(const Eigen::VectorXd& squares, const Eigen::VectorXd& least) {
  const Eigen::VectorXd difference = squares - least;
  const double mean = difference.mean();
  if (!std::isfinite(mean)) return true;
  const auto count = static_cast<double>(difference.size());
  return mean > std::sqrt((difference.array() - mean).square().sum() / (count - 1) / count);
}

void prefer(LawComparison& comparison) {
  for (size_t i = 0; i < comparison.laws.size(); ++i) {
    const ComparedLaw& law = comparison.laws[i];
    if (!law.fit.settled || law.distinguished) continue;
    const auto parameters = [&](size_t at) { return comparison.laws[at].fit.parameters.size(); };
    if (!comparison.preferred || parameters(i) < parameters(*comparison.preferred)) comparison.preferred = i;
  }
  if (!comparison.preferred) {
    comparison.why = "No search ended where it was to end.";
    return;
  }
  const ComparedLaw& chosen = comparison.laws[*comparison.preferred];
  const auto name = [](const ComparedLaw& law) { return law.fit.law->name(); };
  if (comparison.laws.size() == 1) {
    comparison.why = fmt::format("{} was the only law.", name(chosen));
  } else if (*comparison.preferred == 0) {
    comparison.why = fmt::format("{} predicts best what it was not fitted to.", name(chosen));
  } else {
    comparison.why =
        fmt::format("{} predicts what it was not fitted to no worse than {}, with fewer parameters.",
                    name(chosen), name(comparison.laws.front()));
  }
}

}  // namespace

LawComparison compare_laws(std::span<const Law* const> laws, const std::vector<BenchTest>& tests,
                           const ComparisonOptions& options) {
  LawComparison comparison;
  std::vector<Fold> folds = folds_by_kind(tests);
  comparison.over_kinds = folds.size() > 1;
  if (!comparison.over_kinds) folds = folds_by_reading(tests);
  for (const Fold& fold : folds)
    comparison.folds.push_back(fold.name);

  const size_t jobs_a_law = 1 + folds.size();
  std::vector<LawFit> fits(laws.size());
  std::vector<Prediction> predictions(laws.size() * folds.size());
  std::mutex reporting;
  size_t done = 0;
  parallel_for(laws.size() * jobs_a_law, machine_threads(), [&](size_t job) {
    if (options.interrupted && options.interrupted()) return;
    const size_t law = job / jobs_a_law, part = job % jobs_a_law;
    if (part == 0) {
      fits[law] = fit_law(*laws[law], tests, {options.interrupted});
    } else {
      predictions[law * folds.size() + part - 1] =
          prediction_of(*laws[law], folds[part - 1], {options.interrupted});
    }
    const std::scoped_lock lock(reporting);
    if (options.on_fit) options.on_fit(++done, laws.size() * jobs_a_law);
  });
  if (options.interrupted && options.interrupted()) {
    comparison.why = "Stopped on request.";
    return comparison;
  }

  std::vector<Eigen::VectorXd> squares(laws.size());
  for (size_t law = 0; law < laws.size(); ++law) {
    ComparedLaw& compared = comparison.laws.emplace_back();
    compared.fit = std::move(fits[law]);
    for (size_t fold = 0; fold < folds.size(); ++fold) {
      const Prediction& prediction = predictions[law * folds.size() + fold];
      compared.left_out.push_back({percent_of(prediction.residuals2), prediction.determined});
      const Eigen::Index before = squares[law].size();
      squares[law].conservativeResize(before + prediction.residuals2.size());
      squares[law].tail(prediction.residuals2.size()) = prediction.residuals2;
    }
    compared.predicted_percent = percent_of(squares[law]);
  }
  const auto least = std::ranges::min_element(comparison.laws, {}, &ComparedLaw::predicted_percent) -
                     comparison.laws.begin();
  for (size_t law = 0; law < laws.size(); ++law)
    comparison.laws[law].distinguished = lies_above(squares[law], squares[static_cast<size_t>(least)]);
  std::ranges::stable_sort(comparison.laws, {}, &ComparedLaw::predicted_percent);
  prefer(comparison);
  return comparison;
}

}  // namespace diastole
