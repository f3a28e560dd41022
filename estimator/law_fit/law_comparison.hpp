#pragma once
// Laws compared by what they say of tests that they were not fitted to.
//
// Each kind of test is left out in turn, the law is fitted to the others and predicts it; with one kind only, every fifth reading
// is. The score is the RMS, over all readings, of prediction less measurement over the column's RMS. The law with the least
// score is preferred, or the one with the fewest parameters among those whose squares do not differ from its by more than the
// standard error of the difference, reading by reading (the rule of one standard error: Hastie, Tibshirani, Friedman, The
// Elements of Statistical Learning (2009), ch. 7.10). Readings of one curve err together where a law misses it, so that
// the standard error is a lower one.

#include <functional>
#include <optional>
#include <span>
#include <string>
#include <vector>

#include "estimator/law_fit/law_fit.hpp"

namespace diastole {

struct LeftOut {
  double error_percent = 0;  ///< infinite if the law fitted to the others has no answer here
  bool determined = false;   ///< by the others
};

struct ComparedLaw {
  LawFit fit;                     ///< to all tests
  std::vector<LeftOut> left_out;  ///< one a fold
  double predicted_percent = 0;   ///< over all folds
  bool distinguished = false;     ///< from the law with the least score
};

struct LawComparison {
  std::vector<std::string> folds;  ///< kinds of tests, or "every fifth reading, from 1"
  bool over_kinds = false;
  std::vector<ComparedLaw> laws;    ///< the least score first
  std::optional<size_t> preferred;  ///< none if no law's search settled
  std::string why;                  ///< a sentence
};

struct ComparisonOptions {
  std::function<bool()> interrupted = {};
  std::function<void(size_t done, size_t of)> on_fit = {};  ///< from several threads, one at a time
};

/// Precondition: each law can be fitted (why_not); at least one law.
LawComparison compare_laws(std::span<const Law* const> laws, const std::vector<BenchTest>& tests,
                           const ComparisonOptions& options = {});

}  // namespace diastole
