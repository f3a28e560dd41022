#include "tools/benchmarks/paper_search.hpp"

#include <gmock/gmock.h>

#include "estimator/fit/elastic_motion.hpp"
#include "tests/estimator/fit/synthetic.hpp"

namespace diastole {
namespace {

Measurement gel(size_t tags) {
  ElasticModel truth = test::coarse_gel(8.71);
  return test::synthetic(truth,
                         {.pressures_kPa = {3.0}, .tags_a_frame = tags, .sigma_mm = 0.3, .sigma_kPa = 0});
}

PaperFit fit(const Measurement& measurement, double start, const inference::SearchOptions& search) {
  ElasticMotion motion(test::coarse_gel(start), {whole_parameter(0)});
  return fit_as_the_paper(motion, {{start, 1.0, 15.0}}, measurement, {}, search);
}

TEST(ThePapersSearch, ComesToTheSameValue) {
  const Measurement measurement = gel(150);
  std::vector<double> costs_mm2;
  const PaperFit slow =
      fit(measurement, 6.0,
          {.on_step = [&](const inference::SearchStep& step) { costs_mm2.push_back(step.cost); }});
  const FitOutcome quick = test::fit_C1(measurement);
  EXPECT_EQ(slow.termination, inference::Termination::converged) << slow.reason;
  EXPECT_NEAR(slow.values.at(0) / quick.values[0].value, 1, 2e-3);
  EXPECT_GT(slow.iterations, 1);
  EXPECT_EQ(costs_mm2.size(), static_cast<size_t>(slow.iterations));
  EXPECT_GT(slow.forward_solves, quick.forward_solves);
}

TEST(ThePapersSearch, CanBeInterrupted) {
  int asked = 0;
  const PaperFit stopped = fit(gel(40), 2.0, {.interrupted = [&] { return ++asked > 1; }});
  EXPECT_EQ(stopped.termination, inference::Termination::interrupted);
  EXPECT_THAT(stopped.reason, testing::HasSubstr("Stopped on request"));
}

}  // namespace
}  // namespace diastole
