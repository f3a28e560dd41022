#include "estimator/explain/rig/reference.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <memory>
#include <span>
#include <utility>

#include "estimator/explain/rig/set_fit.hpp"
#include "estimator/inference/information.hpp"
#include "estimator/rig_fit/base_fit.hpp"
#include "protocol/contract/input_error.hpp"

namespace diastole::explain {
namespace {

using Eigen::Index;
using Eigen::MatrixXd;
using Eigen::VectorXd;
using rig::basic_nuisances;
using rig::error_groups;
using rig::ErrorGroup;
using rig::FeatureBlock;
using rig::ModelError;
using rig::Nuisance;
using rig::SessionProblem;
using rig::SharePrior;
using rig::Shares;
using rig::signal_count;

/// In sds of the tolerances' list: what a rig's parts change from day to day, and a specimen from casting to casting.
constexpr double rig_changes = 0.1;
constexpr double castings_differ = 0.5;
/// Of a single reference's misfit, that comes again.
constexpr double once_seen = 0.5;

/// What is known of the tolerances, in sds of their list's.
struct Knowledge {
  VectorXd mean;
  MatrixXd covariance;

  [[nodiscard]] MatrixXd root() const { return covariance.llt().matrixL(); }
};

std::vector<std::string_view> all_learnt() {
  std::vector<std::string_view> names;
  for (const rig::Tolerance& tolerance : rig::all_tolerances())
    if (tolerance.is_unknown != rig::IsUnknown::always) names.push_back(tolerance.name);
  return names;
}

/// A reference session and its fit.
struct Fitted {
  Study study;
  rig::Session session;
  rig::SpecimenFamily family;
  SessionProblem problem;
  rig::EvidenceFit evidence;
  inference::Termination termination = inference::Termination::no_solution;

  Fitted(Study of, size_t threads)
      : study(std::move(of)),
        session(rig::read_session(study)),
        family(study),
        problem(session, family, threads, all_learnt()) {}
  /// With this knowledge as the prior; the search starts at these tolerances.
  void fit(const Knowledge& before, const VectorXd& tolerances) {
    const MatrixXd root = before.root();
    problem.set_tolerances(before.mean, root);
    rig::LinearisedModel start = rig::declared_rig(problem);
    start.at.nuisances.tail(tolerances.size()) =
        root.triangularView<Eigen::Lower>().solve(tolerances - before.mean);
    start.columns = problem.nuisance_columns(start.at, start.there);
    const EffectSet linear = fit_set(problem, start.at, start, problem.error().prior.share);
    EffectSet exact = fit_set_exactly(problem, linear);
    evidence = std::move(exact.evidence);
    termination = exact.termination;
  }
  /// What is known after it.
  [[nodiscard]] Knowledge knowledge(const Knowledge& before) const {
    const auto count = before.mean.size();
    const MatrixXd root = before.root();
    return {
        before.mean + root * evidence.estimate.tail(count),
        root *
            inference::covariance_of_information(evidence.precision).matrix.bottomRightCorner(count, count) *
            root.transpose()};
  }
};

using Fits = std::vector<std::unique_ptr<Fitted>>;

bool is_of_specimen(const Nuisance& nuisance) {
  return nuisance.name.starts_with("gel_") || nuisance.name == "inner_radius";
}

/// Wider by what changes from one session to the next.
void widen(Knowledge& known, const std::vector<Nuisance>& list) {
  for (Index i = 0; i < known.mean.size(); ++i) {
    const bool of_specimen = is_of_specimen(list[basic_nuisances + static_cast<size_t>(i)]);
    known.covariance(i, i) += std::pow(of_specimen ? castings_differ : rig_changes, 2);
  }
}

/// What all sessions teach, one after the other. Far from what is declared a search ends early: each pass starts where the
/// one before ended, with nothing known again.
Knowledge learn_tolerances(const Fits& fits, const std::function<void(const std::string&)>& report) {
  constexpr int passes = 4;
  const auto& list = fits.front()->problem.nuisances();
  const auto count = static_cast<Index>(list.size() - basic_nuisances);
  Knowledge known;
  VectorXd start = VectorXd::Zero(count);
  for (int pass = 0; pass < passes; ++pass) {
    known = {VectorXd::Zero(count), MatrixXd::Identity(count, count)};
    for (const auto& fit : fits) {
      report(fmt::format("fitting the reference {}", fit->study.file.filename().string()));
      fit->fit(known, start);
      known = fit->knowledge(known);
      widen(known, list);
      start = known.mean;
    }
  }
  return known;
}

/// From each feature's difference of two references, of the segments that both hold.
void learn_what_differs(const Fits& fits, Reference& out) {
  if (fits.size() < 2) {
    out.again = out.all;
    for (double& share : out.again)
      share *= std::sqrt(1.0 - once_seen);
    return;
  }
  std::vector<double> differences, noise, unit;
  ModelError error;
  for (size_t b = 1; b < fits.size(); ++b)
    for (const FeatureBlock& block : fits[b]->problem.features().blocks())
      for (const FeatureBlock& other : fits[b - 1]->problem.features().blocks()) {
        if (other.key != block.key || other.features.size() != block.features.size()) continue;
        for (size_t i = 0; i < block.features.size(); ++i) {
          const auto row = static_cast<Index>(block.first + i);
          const auto row_before = static_cast<Index>(other.first + i);
          const ModelError &now = fits[b]->problem.error(), &before = fits[b - 1]->problem.error();
          differences.push_back(fits[b]->evidence.left[row] - fits[b - 1]->evidence.left[row_before]);
          noise.push_back(now.noise[row] + before.noise[row_before]);
          unit.push_back(now.unit[row] + before.unit[row_before]);
          error.group.push_back(now.group[static_cast<size_t>(row)]);
        }
      }
  const auto rows = static_cast<Index>(differences.size());
  error.noise = Eigen::Map<VectorXd>(noise.data(), rows);
  error.unit = Eigen::Map<VectorXd>(unit.data(), rows);
  error.prior.share = out.all;
  for (double& share : error.prior.share)
    share *= once_seen;
  const rig::EvidenceFit fit = fit_with_shares(Eigen::Map<VectorXd>(differences.data(), rows),
                                               MatrixXd(rows, 0), error, error.prior.share);
  out.termination = inference::of_both(out.termination, fit.termination);
  for (size_t g = 0; g < error_groups; ++g)
    out.again[g] = std::min(fit.shares[g], out.all[g]);
}

/// How large the misfit is that the fits leave: shares of all, and what of it each signal holds.
void measure_misfit(const Fits& fits, Reference& out) {
  std::array<double, signal_count> squares{}, rows{};
  for (const auto& fit : fits) {
    for (size_t g = 0; g < error_groups; ++g)
      out.all[g] += std::pow(fit->evidence.shares[g], 2) / static_cast<double>(fits.size());
    for (const FeatureBlock& block : fit->problem.features().blocks()) {
      const auto s = static_cast<size_t>(block.signal);
      for (size_t i = 0; i < block.features.size(); ++i)
        squares[s] += std::pow(fit->evidence.left[static_cast<Index>(block.first + i)], 2);
      rows[s] += block.features.empty() ? 0.0 : block.features.front().rows;
      out.percent_of_range[s] = std::max(out.percent_of_range[s], fit->problem.error().range[s]);
    }
  }
  for (double& share : out.all)
    share = std::sqrt(share);
  for (size_t s = 0; s < signal_count; ++s) {
    out.rms[s] = rows[s] > 0.0 ? std::sqrt(squares[s] / rows[s]) : 0.0;
    out.percent_of_range[s] = rows[s] > 0.0 ? 100.0 * out.rms[s] / out.percent_of_range[s] : 0.0;
  }
}

/// The common misfit of each segment, shrunk to what is known of it.
void learn_common_misfit(const Fits& fits, Reference& out) {
  struct Sum {
    VectorXd misfit, noise, unit;
    std::vector<ErrorGroup> group;
    double count = 0.0;
  };
  std::map<std::string, Sum> sums;
  for (const auto& fit : fits)
    for (const FeatureBlock& block : fit->problem.features().blocks()) {
      const auto first = static_cast<Index>(block.first);
      const auto count = static_cast<Index>(block.features.size());
      Sum& sum = sums[block.key];
      if (sum.count == 0.0) {
        sum.misfit = sum.noise = sum.unit = VectorXd::Zero(count);
        const auto from = fit->problem.error().group.begin() + first;
        sum.group.assign(from, from + count);
      } else if (sum.misfit.size() != count) {
        continue;
      }
      sum.misfit += fit->evidence.left.segment(first, count);
      sum.noise += fit->problem.error().noise.segment(first, count);
      sum.unit += fit->problem.error().unit.segment(first, count);
      sum.count += 1.0;
    }
  for (auto& [key, sum] : sums) {
    ReferenceSegment& segment = out.segments[key];
    segment.misfit = sum.misfit / sum.count;
    segment.noise.resize(sum.misfit.size());
    for (Index i = 0; i < sum.misfit.size(); ++i) {
      const auto g = static_cast<size_t>(sum.group[static_cast<size_t>(i)]);
      const double unit = sum.unit[i] / sum.count;
      const double common = std::max(std::pow(out.all[g], 2) - std::pow(out.again[g], 2), 0.0) * unit;
      const double scatter = (std::pow(out.again[g], 2) * unit + sum.noise[i] / sum.count) / sum.count;
      const double part = common + scatter > 0.0 ? common / (common + scatter) : 0.0;
      segment.misfit[i] *= part;
      segment.noise[i] = common * (1.0 - part);
    }
  }
}

}  // namespace

void require_rig_of(const Reference& reference, const rig::Session& session, const Study& study) {
  const rig::Hose& hose = session.base.hose;
  if (reference.hose_length_m == 0.0 ||
      (hose.length_m == reference.hose_length_m && hose.bore_mm == reference.hose_bore_mm))
    return;
  throw InputError(
      {.file = study.file.string(),
       .place = "attributes /rig hose_length_m, hose_bore_mm of its runs",
       .problem = fmt::format("are {:g} m and {:g} mm, and those of the reference {:g} m and {:g} mm",
                              hose.length_m, hose.bore_mm, reference.hose_length_m, reference.hose_bore_mm),
       .remedy = "A reference is a session of the same rig: name one, or leave [data] reference out."});
}

Reference learn_reference(const std::vector<Study>& studies, size_t threads,
                          const std::function<void(std::string_view)>& progress) {
  const auto report = [&](const std::string& what) {
    if (progress) progress(what);
  };
  Reference out;
  Fits fits;
  for (const Study& study : studies)
    fits.push_back(std::make_unique<Fitted>(study, threads));
  out.sessions = fits.size();
  out.hose_length_m = fits.front()->session.base.hose.length_m;
  out.hose_bore_mm = fits.front()->session.base.hose.bore_mm;
  for (const auto& fit : fits)
    require_rig_of(out, fit->session, fit->study);
  const Knowledge known = learn_tolerances(fits, report);
  for (const Nuisance& nuisance : std::span(fits.front()->problem.nuisances()).subspan(basic_nuisances))
    out.tolerances.push_back(nuisance.name);
  out.mean = known.mean;
  out.covariance = known.covariance;
  report("learning what the rig's model leaves");
  for (const auto& fit : fits) {
    fit->fit(known, known.mean);
    out.termination = inference::of_both(out.termination, fit->termination);
  }
  measure_misfit(fits, out);
  learn_what_differs(fits, out);
  learn_common_misfit(fits, out);
  return out;
}

std::vector<std::string_view> learnt_tolerances(const Reference& reference) {
  constexpr double by_half = 0.5;  // of a variance of one before: as much again is learnt
  std::vector<std::string_view> names;
  for (const rig::Tolerance& tolerance : rig::all_tolerances()) {
    if (tolerance.is_unknown == rig::IsUnknown::always) continue;
    const auto found = std::ranges::find(reference.tolerances, tolerance.name);
    if (found == reference.tolerances.end()) continue;
    const Index i = found - reference.tolerances.begin();
    if (tolerance.is_unknown == rig::IsUnknown::with_references || reference.covariance(i, i) < by_half)
      names.push_back(tolerance.name);
  }
  return names;
}

void use_reference(const Reference& reference, SessionProblem& problem) {
  // Tolerances that the reference does not know keep their list's prior.
  const auto& list = problem.nuisances();
  const auto count = static_cast<Index>(list.size() - basic_nuisances);
  VectorXd mean = VectorXd::Zero(count);
  MatrixXd covariance = MatrixXd::Identity(count, count);
  std::vector<Index> place;
  for (const std::string& name : reference.tolerances) {
    const auto found = std::ranges::find(list, name, &Nuisance::name);
    place.push_back(found == list.end() ? -1 : found - list.begin() - static_cast<Index>(basic_nuisances));
  }
  for (size_t i = 0; i < place.size(); ++i) {
    if (place[i] < 0) continue;
    mean[place[i]] = reference.mean[static_cast<Index>(i)];
    for (size_t j = 0; j < place.size(); ++j)
      if (place[j] >= 0)
        covariance(place[i], place[j]) = reference.covariance(static_cast<Index>(i), static_cast<Index>(j));
  }
  problem.set_tolerances(mean, covariance.llt().matrixL());
  ModelError& error = problem.error();
  for (size_t g = 0; g < error_groups; ++g)
    error.prior.share[g] = std::max(reference.again[g], SharePrior::least[g]);
  error.prior.down.fill(0.7);
  VectorXd misfit = VectorXd::Zero(problem.features().count());
  for (const FeatureBlock& block : problem.features().blocks()) {
    const auto first = static_cast<Index>(block.first);
    const auto rows = static_cast<Index>(block.features.size());
    const auto found = reference.segments.find(block.key);
    if (found != reference.segments.end() && found->second.misfit.size() == rows) {
      misfit.segment(first, rows) = found->second.misfit;
      error.noise.segment(first, rows) += found->second.noise;
      continue;
    }
    for (Index i = first; i < first + rows; ++i) {
      const auto g = static_cast<size_t>(error.group[static_cast<size_t>(i)]);
      error.unit[i] *= std::pow(std::max(reference.all[g] / error.prior.share[g], 1.0), 2);
    }
  }
  problem.take_off(misfit);
}

}  // namespace diastole::explain
